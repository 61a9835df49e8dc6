"""The way to the dock by poses for which it is known by hand, and the age of the newest picture."""

import re
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose import Camera, Dock, Entrance, Mount, Vehicle
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_method
from dockpose.app.web.panels import guidance
from dockpose.app.web.panels.guidance import guidance_html
from dockpose.app.web.panels.picture import StripPanel, place_html
from dockpose.pose.circle import CirclePose


def pose(position_m, normal):
    return CirclePose(np.array(position_m), np.array(normal, dtype=float), np.zeros(2))


CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
NOSE = Vehicle(T_body_camera=Mount(position_m=(0.2, 0.0, 0.0)), frame="flu")  # its camera is 20 cm before its middle


def seen(dock, place=(0.3, 0.1, 2.0)) -> Any:
    """A dock square on, 2 m ahead, 30 cm to the right and 10 cm below: the camera is left of its axis, and above."""
    found = SimpleNamespace(selected=pose(place, (0, 0, -1)), dock=dock, camera=CAMERA)
    trust = SimpleNamespace(colour="green", verdict="Dock found", reasons=())
    return SimpleNamespace(estimate=found, trust=trust, view=SimpleNamespace(assumed=frozenset(), source="tank"))


def cells(html):
    return re.findall(r"<t[dh][^>]*>([^<]*)</t[dh]>", html)


def test_vehicle_and_way_stand_in_tables_and_nothing_where_neither_is_known():
    entrance, plain = Dock(0.3, 10, entrance=Entrance()), Dock(0.3, 10)
    assert guidance_html(None, seen(plain)) == ""
    body = ["", "x ahead (cm)", "y left (cm)", "z up (cm)", "Dock", "220.0", "-30.0", "-10.0"]
    normal = ["Its normal", "-1.00", "0.00", "0.00"]
    assert cells(guidance_html(NOSE, seen(plain))) == [*body, *normal]
    html = guidance_html(NOSE, seen(entrance))
    assert cells(html)[-6:] == ["Vehicle", "220.0", "-30.0", "10.0", "0.0", "0.0"]
    assert "Inside the cone, 8° off its axis: go to the entrance, 2.20 m ahead, 30 cm right, 10 cm down." in html
    assert cells(guidance_html(None, seen(entrance)))[-6:] == ["Camera", "200.0", "-30.0", "10.0", "0.0", "0.0"]
    far_off = guidance_html(None, seen(Dock(0.3, 10, entrance=Entrance(cone_deg=5.0, standoff_m=0.8))))
    # 0.32 m, and 2 tan(5 degrees) = 0.17 m are allowed.
    assert "Outside the cone, 9° off its axis: go to the stand-off, 1.20 m ahead, 30 cm right, 10 cm down." in far_off


def test_vehicle_has_standard_errors_unless_something_is_assumed(analysis):
    assert "one sigma" in guidance_html(NOSE, analysis)
    assert "one sigma" not in guidance_html(NOSE, analyse(replace(analysis.view, dock_of="guess")))
    assert guidance_html(NOSE, analyse(with_method(analysis.view, "fixed", 255))) == ""


@pytest.fixture
def panel(analysis, monkeypatch):
    now = SimpleNamespace(s=100.0)
    monkeypatch.setattr(guidance, "time", SimpleNamespace(monotonic=lambda: now.s))
    player = SimpleNamespace(frames=SimpleNamespace(is_live=True))
    made = object.__new__(guidance.GuidancePanel)
    app: Any = SimpleNamespace(player=player)
    made.analysis, made.app = None, app
    made.show(analysis)
    return SimpleNamespace(panel=made, now=now, player=player)


def test_a_picture_ages_until_the_next_and_not_with_another_look_at_it(panel, analysis):
    begun_s = analysis.estimate.elapsed_ms / 1000
    panel.now.s = 106.5
    panel.panel.show(replace(analysis))
    assert panel.panel._age_s == pytest.approx(6.5 + begun_s)
    panel.panel.show(analyse(replace(analysis.view, image=analysis.view.image.copy())))
    assert panel.panel._age_s < 1


def test_only_a_live_source_is_told_to_be_silent(panel):
    panel.now.s = 106.5
    told, looks = [], iter([False, False, False, True])
    ended: Any = SimpleNamespace(wait=lambda seconds: next(looks))
    panel.panel.app.live = SimpleNamespace(held=nullcontext())

    def say(seconds: int) -> None:
        told.append(seconds)
        panel.player.frames.is_live = False

    age_s = panel.panel._age_s
    panel.panel._watch(say, ended)
    assert told == [int(age_s), 0]


def test_the_strip_says_its_age_in_place_of_green(analysis):
    html = place_html(analysis, 6)
    assert "No new picture for 6 s" in html
    assert "Dock found" not in html
    assert "Dock found" in place_html(analysis)


def test_the_strip_stays_grey_with_the_same_picture_and_is_green_with_the_next(analysis):
    sent = []
    live = SimpleNamespace(held=nullcontext(), put_html=lambda name, html: sent.append(html), send=lambda: None)
    strip = object.__new__(StripPanel)
    strip.app = SimpleNamespace(live=live, tanks=SimpleNamespace(is_saved=lambda tank: True))  # pyright: ignore
    strip._browsers, strip._newest, strip._stale_s = 1, None, 0
    assert "data-stale" not in strip._html(analysis)
    strip.say_stale(3)
    assert "No new picture for 3 s" in sent[-1]
    assert "No new picture for 3 s" in strip._html(replace(analysis))  # as when a slider moves
    strip.say_stale(0)  # the source was closed
    assert "Dock found" in sent[-1]
    strip.say_stale(4)
    assert "Dock found" in strip._html(analyse(replace(analysis.view, image=analysis.view.image.copy())))
