"""What the pilot view is told, by poses whose way to the dock is known by hand, and the age of the newest picture."""

import json
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_method
from dockpose.app.web.panels import pilot
from dockpose.app.web.panels.picture import StripPanel, place_html
from dockpose.app.web.panels.pilot import corridor, pilot_numbers
from dockpose.pose.circle import CirclePose

SIDEWAYS = np.sqrt(0.5)


def pose(position_m, normal):
    return CirclePose(np.array(position_m), np.array(normal, dtype=float), np.zeros(2))


def test_square_on_the_way_is_the_offset_itself():
    way = corridor(pose((0.06, -0.04, 1.1), (0, 0, -1)), 0.15)
    # A dock that is seen to the right and above: the vehicle is to the left of its axis, and below.
    assert (way["ahead"], way["right"], way["down"]) == pytest.approx((1.1, -0.06, 0.04))
    assert (way["headingRightDeg"], way["headingDownDeg"]) == pytest.approx((0, 0))
    assert way["isInside"]


def test_a_turned_dock_straight_ahead_is_approached_from_the_side():
    # The face points half to the right, as seen: the camera is to the left of the axis, and heads to the right.
    way = corridor(pose((0, 0, 1), (SIDEWAYS, 0, -SIDEWAYS)), 0.15)
    assert (way["ahead"], way["right"], way["down"]) == pytest.approx((SIDEWAYS, -SIDEWAYS, 0))
    assert (way["headingRightDeg"], way["headingDownDeg"]) == pytest.approx((45, 0))
    assert not way["isInside"]


@pytest.mark.parametrize(("offset_m", "is_inside"), [(0.25, True), (0.252, False)])
def test_the_corridor_opens_by_ten_degrees_from_half_the_ring(offset_m, is_inside):
    # 0.075 m at the face, and 1 m before it tan(10 degrees) = 0.1763 m more: 0.2513 m.
    assert corridor(pose((0, offset_m, 1), (0, 0, -1)), 0.15)["isInside"] is is_inside


def test_the_pilot_reads_what_the_strip_says(analysis):
    told = pilot_numbers(analysis)
    assert (told["trust"], told["verdict"], told["source"]) == ("green", "Dock found", "plain")
    figures = told["figures"]
    assert [figures[name] for name in ("ahead", "across", "along")] == ["1.10 m ahead", "6 cm right", "4 cm up"]
    assert [figures[name] for name in ("pitch", "yaw")] == ["6°", "-12°"]
    assert figures["exact"].startswith("± ")
    assert told["directionDeg"] == pytest.approx([3.12, -2.08], abs=0.05)
    assert pilot_numbers(analyse(replace(analysis.view, dock_of="guess")))["figures"]["exact"] == "assumed"
    nothing = pilot_numbers(analyse(with_method(analysis.view, "fixed", 255)))
    assert (nothing["trust"], nothing["verdict"]) == ("red", "No pose")
    assert "figures" not in nothing


@pytest.fixture
def panel(analysis, monkeypatch):
    now = SimpleNamespace(s=100.0)
    monkeypatch.setattr(pilot, "time", SimpleNamespace(monotonic=lambda: now.s))
    player = SimpleNamespace(frames=SimpleNamespace(is_live=True))
    made = object.__new__(pilot.PilotPanel)
    made.analysis, made.app = None, SimpleNamespace(sequence=SimpleNamespace(player=player))  # pyright: ignore
    made._told = None, {}
    made.show(analysis)
    return SimpleNamespace(panel=made, now=now, player=player)


def test_a_picture_ages_until_the_next_and_not_with_another_look_at_it(panel, analysis):
    begun_s = analysis.estimate.elapsed_ms / 1000
    panel.now.s = 106.5
    panel.panel.show(replace(analysis))
    told = json.loads(panel.panel.answer())
    assert (told["ageS"], told["isLive"]) == (pytest.approx(6.5 + begun_s), True)
    panel.panel.show(analyse(replace(analysis.view, image=analysis.view.image.copy())))
    panel.player.frames.is_live = False
    told = json.loads(panel.panel.answer())
    assert told["ageS"] < 1
    assert not told["isLive"]


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
