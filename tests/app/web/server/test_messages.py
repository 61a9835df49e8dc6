"""What a browser may send: the page's own messages, and nothing that viser would choke on or pass on."""

import itertools
import math

import msgspec
import numpy as np
import pytest
from dockpose.app.web.server.messages import LARGEST_BYTES, RefusedError, check_message, why_not
from viser import _messages as messages

from tests.support.visitors import VIEWPOINT, packed


@pytest.fixture(scope="module")
def gui(served):
    return served[0].gui


@pytest.fixture(scope="module")
def controls(gui):
    with gui.add_form("form") as form:
        text = gui.add_text("text", "")
    return {
        "form": form,
        "text": text,
        "slider": gui.add_slider("slider", min=0.5, max=10.0, step=0.5, initial_value=1.0),
        "whole": gui.add_slider("whole", min=0, max=255, step=1, initial_value=7),
        "number": gui.add_number("number", 10, min=0, max=64),
        "free": gui.add_number("free", 1.0),
        "choice": gui.add_dropdown("choice", ("one", "two")),
        "buttons": gui.add_button_group("buttons", ("left", "right")),
        "button": gui.add_button("button"),
        "box": gui.add_checkbox("box", False),
        "corner": gui.add_vector2("corner", (1.0, 1.0), min=(0.0, 0.0)),
        "upload": gui.add_upload_button("upload"),
        "progress": gui.add_progress_bar(0.0),
    }


def check(gui, raw, **keywords):
    return check_message(raw, gui._gui_input_handle_from_uuid.get, gui._container_handle_from_uuid.get, **keywords)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("slider", 0.5), ("slider", 10), ("whole", 255), ("number", 0), ("number", 64.0), ("free", -12.5)],
        *[("text", "x" * 10_000), ("text", ""), ("text", "<b>ä</b>"), ("choice", "two"), ("buttons", "left")],
        *[("button", True), ("box", False), ("corner", [3, 4.5])],
    ],
)
def test_what_the_page_sends_passes(gui, controls, name, value):
    raw = packed(messages.GuiUpdateMessage(controls[name]._impl.uuid, {"value": value}))
    assert check(gui, raw).updates.value == value


NO_NUMBERS = [1e20, -1e20, 2**63, math.nan, math.inf, "9" * 23, "7", True, None, [1], {"a": 1}, b"1"]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("slider", 0.3), ("slider", 10.2), ("whole", -1), ("number", 65), ("free", 1e10)],
        *[("text", "x" * 10_001), ("text", 1), ("text", ["a"]), ("choice", "three"), ("choice", 1), ("choice", "")],
        *[("buttons", "up"), ("button", 1), ("button", "true"), ("box", 0), ("box", "x")],
        *[("corner", [-1, 2]), ("corner", [1]), ("corner", [1, 2, 3]), ("corner", [math.nan, 1]), ("corner", 5)],
        *[("corner", [1e300, 1]), ("upload", True), ("upload", "x"), ("progress", 5.0), ("progress", 1e20)],
        *itertools.product(["slider", "whole", "number", "free"], NO_NUMBERS),
    ],
)
def test_a_value_that_the_control_does_not_have(gui, controls, name, value):
    """An integer of more than 64 bits closed every browser, and each new one."""
    with pytest.raises(RefusedError):
        check(gui, msgspec.msgpack.encode(update(controls[name], value)))


@pytest.mark.parametrize(("name", "value"), [("slider", 0.5), ("button", True), ("text", "x"), ("choice", "two")])
def test_a_control_that_is_disabled_takes_no_value(gui, controls, name, value):
    raw = msgspec.msgpack.encode(update(controls[name], value))
    controls[name].disabled = True
    try:
        with pytest.raises(RefusedError, match="it cannot be used just now"):
            check(gui, raw)
    finally:
        controls[name].disabled = False
    assert check(gui, raw).updates.value == value


def update(control, value):
    return {"type": "GuiUpdateMessage", "uuid": control._impl.uuid, "updates": {"value": value}}


def test_a_slider_may_round_its_ends_to_the_decimals_it_shows(gui, controls):
    """The page shows 639.46 as 639.5 and sends that."""
    control = gui.add_slider("rounded", min=0.0, max=639.46, step=0.1, initial_value=1.0)
    control.precision = 1
    assert why_not(control, 639.5) is None
    assert why_not(control, 639.6) is not None


@pytest.mark.parametrize(
    "changes",
    [
        {"updates": {"min": 0}},
        {"updates": {"value": 1, "max": 99}},
        {"updates": {}},
        {"uuid": "no-such-control"},
        {"uuid": "x" * 65},
        {"uuid": 3},
        {"type": "GuiUpdate"},
        {"type": ["GuiUpdateMessage"]},
        {"excluded_self_client": 1},
    ],
)
def test_an_update_of_anything_else(gui, controls, changes):
    with pytest.raises(RefusedError):
        check(gui, msgspec.msgpack.encode(update(controls["whole"], 3) | changes))


def test_all_other_messages_of_viser_are_refused(gui, controls):
    """As a script to run in all browsers, a tunnel to the internet, or a node of the scene."""
    allowed = {
        *("ViewerCameraMessage", "GuiUpdateMessage", "GuiFormSubmitMessage", "GuiFormDirtyMessage"),
        *("CommandTriggerMessage", "FileTransferStartUpload", "FileTransferPart", "GetRenderResponseMessage"),
    }
    names = {kind.__name__ for kind in messages.Message.get_subclasses()}
    assert len(names - allowed) > 80
    for name in names - allowed:
        with pytest.raises(RefusedError):
            check(
                gui, msgspec.msgpack.encode({"type": name, "uuid": controls["text"]._impl.uuid, "source": "alert(1)"})
            )


@pytest.mark.parametrize(
    "raw",
    [
        *[b"", b"\xc1", b"\xc0", b"\x93\x01", b"\x81\xa4type\xc0", "text", b"\xdd\xff\xff\xff\xff", b"\x91" * 100_000],
        *[b"\x91" * 60_000, b"\xdb\xff\xff\xff\xff", msgspec.msgpack.encode({"type": "GuiFormDirtyMessage"})],
        msgspec.msgpack.encode({"type": "GuiFormDirtyMessage", "uuid": "x"}),
        msgspec.msgpack.encode({"type": "GuiFormSubmitMessage", "uuid": "root"}),
    ],
)
def test_what_is_no_message(gui, raw):
    with pytest.raises(RefusedError):
        check(gui, raw)


def test_forms(gui, controls):
    for kind in (messages.GuiFormSubmitMessage, messages.GuiFormDirtyMessage):
        assert check(gui, packed(kind(controls["form"]._impl.uuid))).uuid == controls["form"]._impl.uuid


def test_only_parts_of_files_and_pictures_are_large(gui):
    part = messages.FileTransferPart("a", "b", 0, bytes(LARGEST_BYTES))
    assert len(check(gui, packed(part)).content) == LARGEST_BYTES
    with pytest.raises(RefusedError, match="not one of the page"):
        check(gui, packed(messages.FileTransferPart("a", "b", 0, bytes(5 * 2**20))))
    for letters in (LARGEST_BYTES, 1001):
        with pytest.raises(RefusedError):
            check(gui, packed(messages.FileTransferStartUpload("a", "b", "n" * letters, "", 1, 1)))


def test_a_rendered_picture_is_no_bomb(gui):
    import cv2

    small = cv2.imencode(".png", np.zeros((4, 6, 4), np.uint8))[1].tobytes()
    assert check(gui, packed(messages.GetRenderResponseMessage(small, "x"))).payload == small
    check(gui, packed(messages.GetRenderResponseMessage(b"", "x")))
    bomb = small[:16] + (20_000).to_bytes(4) * 2 + small[24:]
    for payload in (bomb, b"GIF89a" + bytes(30), small[:10]):
        with pytest.raises(RefusedError):
            check(gui, packed(messages.GetRenderResponseMessage(payload, "x")))


def test_a_viewpoint_is_finite(gui):
    assert check(gui, packed(VIEWPOINT), only_views=True).fov == 1.0
    for changed in ({"fov": math.nan}, {"position": (math.inf, 0.0, 0.0)}, {"image_width": 10**9}):
        with pytest.raises(RefusedError):
            check(gui, msgspec.msgpack.encode(VIEWPOINT.as_serializable_dict() | changed))


def test_viewers_only_look(gui, controls):
    with pytest.raises(RefusedError):
        check(gui, msgspec.msgpack.encode(update(controls["whole"], 3)), only_views=True)
