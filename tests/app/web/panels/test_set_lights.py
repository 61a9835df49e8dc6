import json
import re
import time
from html import unescape

import numpy as np
import pytest
from dockpose.app.state.parameters import put
from dockpose.app.state.preferences import Memory
from dockpose.app.state.view import open_source, with_sample
from dockpose.app.web.app import App
from dockpose.app.web.panels.view import PicturePanel
from dockpose.app.web.server.options import Options
from dockpose.sidecar import sample_path
from dockpose.simulate import load_scene, truth_of

NOBODY = None
SPOT = re.compile(r">(.*)<")


@pytest.fixture
def app(tmp_path):
    with App(port=0, options=Options(remember_in=tmp_path)) as running:
        running.change(lambda _: open_source(None, None, None))
        assert running.wait_until_idle(60)
        yield running


@pytest.fixture
def hand(app):
    return app._layout.of(PicturePanel)._hand


def truth_px():
    return truth_of(load_scene(sample_path("plain").with_suffix(".yaml"))).lights_px


def ask(app, hand, do, number=1, **fields):
    """Fulfil a request as if a browser had sent it, and wait for what comes of it."""
    kind = next(kind for kind in hand.acts if kind.__struct_config__.tag == do)
    fields.setdefault("picture", hand._serial)
    hand.acts[kind](
        kind(number=number, **{name: fields[name] for name in kind.__struct_fields__ if name in fields}), NOBODY
    )
    assert app.wait_until_idle(60)


def set_lights(app, hand, at, number=1, **more):
    at = None if at is None else [tuple(point) for point in at]
    ask(app, hand, "lights", number, **{"at": at, "snap": [True] * len(at or ()), "goesOn": False} | more)


def numbers(app):
    return app.live._data


def test_each_light_that_is_set_is_undone_by_itself_and_the_search_can_be_had_again(app, hand):
    lights = truth_px().tolist()
    for count in (0, 4, 5, 6):
        set_lights(app, hand, lights[:count], number=count)
        assert app._current.estimate.found_by == "hand"
        assert (app._current.estimate.status == "ok") == (count >= 3)
        assert len(numbers(app)["overlay"]["byHand"]["lights_px"]) == count
        assert numbers(app)["lightsHeard"][-1] == count
    for count in (5, 4, 0):
        app.change(app.history.undo)
        assert len(app.view.set_lights.lights_px) == count
    app.change(app.history.redo)
    assert len(app.view.set_lights.lights_px) == 4
    set_lights(app, hand, None, number=9)
    assert app.view.set_lights is None
    assert app.wait_until_idle(60)
    assert (app._current.estimate.found_by, numbers(app)["overlay"]["byHand"]) == ("search", None)


def test_arrow_keys_that_follow_each_other_are_one_step_back(app, hand):
    lights = truth_px()[:5]
    set_lights(app, hand, lights)
    for step in range(1, 6):
        set_lights(app, hand, lights + [0.1 * step, 0], number=1 + step, goesOn=True, snap=[False] * 5)
    app.change(app.history.undo)
    np.testing.assert_allclose(app.view.set_lights.lights_px, lights)


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ([(-3.0, 5.0)], "light 1 is at -3, 5, outside the picture, which has 640 x 480 pixels"),
        ([(100.0, 100.0), (100.2, 100.0)], "light 2 is at 100.2, 100, where light 1 is already"),
        ([(float(x), 30.0) for x in range(20, 130, 10)], "11 lights are set, and the dock has 10"),
    ],
)
def test_what_cannot_be_set_is_refused_and_what_was_set_stays(app, hand, at, words, monkeypatch):
    told = []
    monkeypatch.setattr(app, "notify", lambda title, sentence, colour, client: told.append(sentence))
    set_lights(app, hand, truth_px()[:5])
    before = app.view.set_lights
    set_lights(app, hand, at, number=2)
    assert app.view.set_lights is before
    assert words in numbers(app)["lightsRefused"]  # at the picture, once, however many are clicked
    assert told == []
    assert numbers(app)["lightsHeard"][-1] == 2  # from which a browser knows that it was heard


def test_lights_of_a_picture_that_is_no_longer_shown_are_not_taken(app, hand):
    set_lights(app, hand, truth_px()[:5], picture=hand._serial - 1)
    assert app.view.set_lights is None
    assert numbers(app)["lightsHeard"][-1] == 1


def test_lights_come_back_with_their_picture_and_after_a_start_anew(app, hand, tmp_path):
    set_lights(app, hand, truth_px()[:7])
    lights = app.view.set_lights
    app.change(lambda view: with_sample(view, "tilted"))
    assert app.view.set_lights is None
    app.change(lambda view: with_sample(view, "plain"))
    assert app.view.set_lights == lights
    assert app.wait_until_idle(60)
    last = Memory(tmp_path)  # as it is on the disk now, whether or not the page comes to an end
    assert last.with_lights(with_sample(app.view, "plain")).set_lights == lights
    assert last.with_lights(with_sample(app.view, "tilted")).set_lights is None


def show_frame(app, index):
    app.player.go_to(index)
    for _ in range(6000):
        newest = app.sequence._newest
        if newest is not None and newest.frame.index == index and app.wait_until_idle(60):
            return app._current
        time.sleep(0.01)
    pytest.fail(f"frame {index} is not shown")


def test_lights_are_set_in_the_frame_that_is_seen_and_the_track_begins_there(app, hand):
    app.sequence.choose("simulated approach", NOBODY)
    before = show_frame(app, 3)
    lights = before.estimate.markers.points_px[before.estimate.ring.on_ring]
    set_lights(app, hand, lights)
    assert (app._current.estimate.found_by, app._current.tracked_frame.tracked.track.age) == ("hand", 1)
    after = show_frame(app, 4)
    assert (after.estimate.found_by, after.tracked_frame.tracked.track.age) == ("following", 2)
    assert (after.view.set_lights, numbers(app)["overlay"]["byHand"]) == (None, None)
    app.change(app.history.undo)  # which is of another frame
    assert app.view.set_lights is None
    assert show_frame(app, 3).estimate.found_by == "hand"  # and the lights are still there
    set_lights(app, hand, None, number=2)
    assert app._current.estimate.found_by == "search"
    assert show_frame(app, 2).estimate.found_by == "search"
    assert show_frame(app, 3).estimate.found_by in ("search", "following")


def test_setting_lights_pauses_what_plays(app, hand):
    app.sequence.choose("simulated approach", NOBODY)
    show_frame(app, 1)
    app.sequence.play(True)
    ask(app, hand, "hold")
    assert not app.is_playing


def test_spot_is_where_a_click_would_set_the_light(app, hand):
    lights = truth_px()
    set_lights(app, hand, lights[:5])
    for point in lights[5:]:
        ask(app, hand, "spot", 7, at=tuple(point + [1.5, -1.0]))
        spot = json.loads(unescape(SPOT.findall(hand._spot.content)[0]))
        assert np.hypot(*(np.array(spot["at"]) - point)) < 0.1
    before = hand._spot.content
    ask(app, hand, "spot", 8, at=(-5.0, 20.0))
    assert hand._spot.content is before


def test_another_picture_of_the_scene_has_none_of_the_lights(app, hand):
    set_lights(app, hand, truth_px()[:6])
    app.change(lambda view: put(view, "z_cm", 150))
    assert app.wait_until_idle(60)
    assert app.view.set_lights is None
    assert (app._current.estimate.found_by, app._current.estimate.lights_on_ring) == ("search", 10)
