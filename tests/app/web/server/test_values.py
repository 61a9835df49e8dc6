"""What controls may be set to: what the page sends, and nothing that viser would choke on or pass on."""

import itertools
import math

import pytest
from dockpose.app.web.server.values import why_not


@pytest.fixture(scope="module")
def gui(served):
    return served[0].gui


@pytest.fixture(scope="module")
def controls(gui):
    return {
        "text": gui.add_text("text", ""),
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


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("slider", 0.5), ("slider", 10), ("whole", 255), ("number", 0), ("number", 64.0), ("free", -12.5)],
        *[("text", "x" * 10_000), ("text", ""), ("text", "<b>ä</b>"), ("choice", "two"), ("buttons", "left")],
        *[("button", True), ("box", False), ("corner", [3, 4.5])],
    ],
)
def test_what_the_page_sends_passes(controls, name, value):
    assert why_not(controls[name], value) is None


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
def test_a_value_that_the_control_does_not_have(controls, name, value):
    """An integer of more than 64 bits closed every browser, and each new one."""
    assert why_not(controls[name], value)


@pytest.mark.parametrize(("name", "value"), [("slider", 0.5), ("button", True), ("text", "x"), ("choice", "two")])
def test_a_control_that_is_disabled_takes_no_value(controls, name, value):
    controls[name].disabled = True
    try:
        assert why_not(controls[name], value) == "it cannot be used just now"
    finally:
        controls[name].disabled = False
    assert why_not(controls[name], value) is None


def test_a_slider_may_round_its_ends_to_the_decimals_it_shows(gui):
    """The page shows 639.46 as 639.5 and sends that."""
    control = gui.add_slider("rounded", min=0.0, max=639.46, step=0.1, initial_value=1.0)
    control.precision = 1
    assert why_not(control, 639.5) is None
    assert why_not(control, 639.6) is not None
