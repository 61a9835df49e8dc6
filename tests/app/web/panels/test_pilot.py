"""What the pilot view is told, by poses whose way to the dock is known by hand, and the age of the newest picture."""

import json
import math
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
from dockpose.app.web.panels import pilot
from dockpose.app.web.panels.picture import StripPanel, place_html
from dockpose.app.web.panels.pilot import corridor, guidance_html, pilot_numbers
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


CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
NOSE = Vehicle(T_body_camera=Mount(position_m=(0.2, 0.0, 0.0)), frame="flu")  # its camera is 20 cm before its middle


def seen(dock, place=(0.3, 0.1, 2.0)) -> Any:
    """A dock square on, 2 m ahead, 30 cm to the right and 10 cm below: the camera is left of its axis, and above."""
    found = SimpleNamespace(selected=pose(place, (0, 0, -1)), dock=dock, camera=CAMERA)
    trust = SimpleNamespace(colour="green", verdict="Dock found", reasons=())
    return SimpleNamespace(estimate=found, trust=trust, view=SimpleNamespace(assumed=frozenset(), source="tank"))


def test_the_way_leads_to_the_entrance_by_the_docks_own_cone():
    dock = Dock(0.3, 10, entrance=Entrance(radius_m=0.1))
    told = pilot_numbers(seen(dock), NOSE)
    figures = [told["figures"][name] for name in ("ahead", "across", "along")]
    assert figures == ["2.20 m ahead", "30 cm right", "10 cm down"]
    assert [told["figures"][name] for name in ("pitch", "yaw")] == ["0°", "0°"]
    assert told["target"] == "to the entrance"
    way = told["corridor"]
    assert (way["ahead"], way["right"], way["down"], way["entrance"]) == pytest.approx((2.2, -0.3, -0.1, 0.1))
    assert way["opening"] == pytest.approx(math.tan(math.radians(15)))
    assert way["isInside"]  # 0.32 m off the axis, where 0.1 + 2.2 tan(15 degrees) = 0.69 m are allowed


def test_from_outside_the_cone_it_leads_to_the_stand_off():
    told = pilot_numbers(seen(Dock(0.3, 10, entrance=Entrance(cone_deg=5.0, standoff_m=0.8))))
    assert told["figures"]["ahead"] == "1.20 m ahead"
    assert told["target"] == "to the stand-off"
    assert not told["corridor"]["isInside"]  # 0.32 m, and 2 tan(5 degrees) = 0.17 m are allowed


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


def test_vehicle_has_standard_errors_unless_something_is_assumed(analysis):
    assert "one sigma" in guidance_html(NOSE, analysis)
    assert "one sigma" not in guidance_html(NOSE, analyse(replace(analysis.view, dock_of="guess")))
    assert guidance_html(NOSE, analyse(with_method(analysis.view, "fixed", 255))) == ""


@pytest.fixture
def panel(analysis, monkeypatch):
    now = SimpleNamespace(s=100.0)
    monkeypatch.setattr(pilot, "time", SimpleNamespace(monotonic=lambda: now.s))
    player = SimpleNamespace(frames=SimpleNamespace(is_live=True))
    made = object.__new__(pilot.PilotPanel)
    options = SimpleNamespace(vehicle=None)
    app: Any = SimpleNamespace(sequence=SimpleNamespace(player=player), options=options)
    made.analysis, made.app = None, app
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
