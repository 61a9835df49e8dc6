import socket
import time
from types import SimpleNamespace
from typing import Any
from urllib.request import urlopen

import pytest
from dockpose.app.state.parameters import put
from dockpose.app.state.scene import scene_of, with_scene
from dockpose.app.web.app import App
from dockpose.app.web.notifications import REFUSED, SHOWN_S, Notifications, together
from dockpose.app.web.server import start as opening
from dockpose.app.web.server.start import PortBusyError
from dockpose.simulate.optics.psf import Psf
from dockpose.thresholds import METHODS
from msgspec.structs import replace as changed

from tests.support.visitors import Visitor

AREA = "Min. area (px)"
NO_CONTROLS = {f"{name}Message" for name in ("GuiFolder", "GuiForm", "GuiImage", "RegisterCommand")}


@pytest.fixture
def app():
    with App(port=0) as running:
        yield running


@pytest.fixture
def area(app):
    """A browser, and the control of the least area, with its id."""
    with Visitor(app.address) as visitor:
        assert visitor.until(lambda visitor: AREA in visitor.ids)
        yield visitor, visitor.ids[AREA], app.server.gui._gui_input_handle_from_uuid[visitor.ids[AREA]]
        assert visitor.until(lambda visitor: app.view.settings.min_area_px == 60)
        assert visitor.until(lambda visitor: not app.choices._open)
        assert app.server.gui._gui_input_handle_from_uuid[visitor.ids[AREA]].value == 60


@pytest.fixture
def busy_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        yield taken.getsockname()[1]


def test_serves_a_page_at_the_port_asked_for_on_the_loopback_address_alone_and_prints_nothing(capsys):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with App(port=port) as app, socket.socket() as elsewhere:
        assert app.port == port
        assert app.address.startswith(f"http://127.0.0.1:{port}/?token=")
        assert urlopen(app.address, timeout=60).status == 200
        elsewhere.bind(("127.0.0.2", port))  # free, since only 127.0.0.1 is taken
    assert capsys.readouterr().out == ""


def test_busy_port_is_named_and_no_other_one_taken_also_where_it_was_taken_after_the_check(busy_port, monkeypatch):
    for _ in range(2):
        with pytest.raises(PortBusyError, match=rf"port {busy_port} on 127\.0\.0\.1"):
            App(port=busy_port)
        monkeypatch.setattr(opening, "check_port_is_free", lambda host, port: None)


def test_unknown_host_is_named():
    with pytest.raises(OSError, match=r"no\.such\.host\.invalid"):
        App(host="no.such.host.invalid")


def test_of_what_a_browser_requests_only_what_it_may_is_done(app, caplog):
    with Visitor(app.address) as visitor:
        # What comes for this browser alone would else be queued when it has gone, which is told.
        files = {look["label"] for panel in app.panels for _, look, *_ in panel._uploads}
        assert visitor.until(lambda visitor: AREA in visitor.ids and files <= visitor.buttons.keys())
        for number, level in ((5, '"x"'), (6, "1e999"), (7, "77,"), (8, "90")):
            visitor.set("Done in the picture", f'{{"do":"level","number":{number},"level":{level}}}')
        assert visitor.until(lambda visitor: app.view.settings.level == 90)
    assert not caplog.records


def test_change_is_worked_on_and_a_refused_one_keeps_the_view(app):
    app.change(lambda view: put(view, "diameter_cm", 60))
    assert app.wait_until_idle(120)
    assert app.view.dock.diameter == pytest.approx(0.6)
    assert app.scene.drawn.labels["camera"].text.startswith("camera, 2.")
    before = app.view
    app.change(lambda view: put(view, "fx", float("nan")))
    assert app.view is before


@pytest.mark.parametrize(
    ("label", "value", "seen"),
    [
        ("Sample scene", "tilted", lambda view: view.sample == "tilted"),
        ("Diameter (cm)", 47.0, lambda view: view.dock.diameter == 0.47),
        ("Threshold by", METHODS["otsu"].title, lambda view: view.settings.method == "otsu"),
    ],
)
def test_what_is_set_while_another_act_ends_is_not_lost(app, label, value, seen):
    assert app.wait_until_idle(60)
    with Visitor(app.address) as visitor:
        assert visitor.until(lambda visitor: label in visitor.ids)
        handle = app.server.gui._gui_input_handle_from_uuid[visitor.ids[label]]
        with app._lock:  # another act has begun
            visitor.set(label, value)
            assert visitor.until(lambda visitor: handle.value == value)
            app.load(app._view)  # and ends by setting all controls
        assert visitor.until(lambda visitor: seen(app.view))
        assert visitor.until(lambda visitor: not app.choices._open)
        assert handle.value == value


def test_what_the_program_sets_between_a_value_and_its_callback_does_not_replace_it(area):
    visitor, _, handle = area
    tell = handle._impl.sync_cb

    def tell_and_set(client_id, updates):
        tell(client_id, updates)
        handle.value = 7

    handle._impl.sync_cb = tell_and_set
    visitor.set(AREA, 60)


def test_a_choice_that_has_just_been_replaced_is_not_put_back(app, area):
    """One thread has read the first choice and is about to set it when the second comes, and is acted on."""
    visitor, key, handle = area
    app.wait_until_idle(60)

    class Interrupted:
        """A control that is set by a person whenever a thread of the program asks for its value."""

        @property
        def value(self):
            visitor.set(AREA, 60)
            # Until its act has ended; for a moment only, where it waits for this thread.
            visitor.until(lambda visitor: app.view.settings.min_area_px == 60, 0.5)
            return handle.value

        @value.setter
        def value(self, value):
            handle.value = value

    app.choices._open[key] = key, Interrupted(), 50
    app.choices.put_back()


def test_what_is_refused_is_not_put_back(app):
    with Visitor(app.address) as visitor:
        label = "Missing lights"
        assert visitor.until(lambda visitor: label in visitor.ids)
        visitor.set(label, "4 apples")
        assert visitor.until(lambda visitor: visitor.notices)
        assert visitor.until(lambda visitor: not app.choices._open)
        assert visitor.values[visitor.ids[label]] != "4 apples"


def test_there_are_no_more_controls_than_people_can_know(app):
    with Visitor(app.address) as visitor:
        uploads = {look["label"] for panel in app.panels for _, look, *_ in panel._uploads}
        assert visitor.until(lambda visitor: AREA in visitor.ids and uploads <= visitor.buttons.keys())
        kinds = [*visitor.kinds.values(), *visitor.buttons]
    controls = [kind for kind in kinds if kind not in NO_CONTROLS]
    our_own = 2  # hidden boxes, by which our elements talk
    assert 80 < len(controls) - our_own <= 95


def test_notices_in_a_rush_are_one_text():
    assert together(["a", "b"]) == "a | b"
    assert together([str(number) for number in range(40)]) == "0 | 1 | 2 | 3 | 4 | (34 more) | 39"


def test_a_notice_that_grows_is_shown_as_long_again_and_a_sentence_is_told_once():
    notices, notice = Notifications(), SimpleNamespace(auto_close_seconds=SHOWN_S, _show=lambda: None)
    client: Any = SimpleNamespace(client_id=1, add_notification=lambda *words, **props: notice)
    told_s = []
    for sentence in "abcc":
        notices.show("Refused", sentence, "red", client)
        told_s.append(notice.auto_close_seconds)
    assert notice.body == "a | b | c"
    assert told_s[:3] == sorted({*told_s[:3]})  # the browser begins anew only for another time
    assert told_s[0] == SHOWN_S < told_s[-1] < SHOWN_S + 1


def test_a_refusal_goes_once_something_else_was_done_but_not_in_the_same_rush(monkeypatch):
    notices, gone, now = Notifications(), [], [10.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    notice = SimpleNamespace(remove=lambda: gone.append(now[0]), _show=lambda: None)
    client: Any = SimpleNamespace(client_id=1, add_notification=lambda *words, **props: notice)
    notices.show(REFUSED, "cam.yaml is for 640 x 480", "red", client)
    now[0] = 11.0  # the next of forty files, of which the third was refused
    notices.withdraw()
    assert gone == []
    now[0] = 12.5
    notices.withdraw()
    notices.withdraw()
    assert gone == [12.5]
    notices.show("Saved", "Pool A", "green", client)
    now[0] = 30.0
    notices.withdraw()
    assert gone == [12.5]


def test_scene_that_cannot_be_rendered_is_told_and_leaves_what_was_shown(app, monkeypatch):
    told = []
    monkeypatch.setattr(app, "report", lambda error, client: told.append(str(error)))
    assert app.wait_until_idle(120)
    before = app.view
    far = put(before, "z_cm", 2000)
    murky = put(far, "turbidity", 1)
    app.change(lambda _: with_scene(murky, changed(scene_of(murky), psf=Psf(model="hou"))))
    assert app.wait_until_idle(120)
    assert "Hou" in told[0]
    assert app.view is before


def test_error_in_a_panel_is_told_and_the_next_view_is_worked_on(app, monkeypatch, caplog):
    def fail(analysis):
        raise RuntimeError("the panel broke")

    assert app.wait_until_idle(120)
    monkeypatch.setattr(app.panels[-1], "show", fail)
    app.change(lambda view: put(view, "diameter_cm", 40))
    assert app.wait_until_idle(120)
    assert "the panel broke" in caplog.text
    monkeypatch.undo()
    app.change(lambda view: put(view, "diameter_cm", 60))
    assert app.wait_until_idle(120)
    assert app.scene.drawn.labels["camera"].text.startswith("camera, 2.")
