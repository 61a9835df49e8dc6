"""Docks of several rings, simulated: which are seen, and the one pose by all of them."""

# A None where a pose is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportArgumentType=false
# pyright: reportPrivateUsage=false, reportOptionalOperand=false

import math
from dataclasses import replace
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, DockRing, Entrance, Tracker, estimate, guide
from dockpose.estimate.geometry import pose_lines
from dockpose.estimate.rings import _agreed, _Seen, rings_of
from dockpose.pose.circle import CirclePose, PoseErrors
from dockpose.simulate import Lights, Pose, Scene, render
from dockpose.simulate.parts import Lamp

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
FAR = DockRing(name="far", diameter=0.9, lights=12)
NEAR = DockRing(name="near", diameter=0.16, lights=6)
CONCENTRIC = Dock(rings=(FAR, NEAR))
BEHIND = Dock(rings=(FAR, msgspec.structs.replace(NEAR, position_m=(0.0, 0.0, 0.15))))


def scene_of(dock, z_m, *, missing=(), lamps=(), **pose):
    drawn = {"theta_x_deg": -5.0, "theta_y_deg": 12.0, "roll_deg": 2.0} | pose
    return Scene(
        camera=CAMERA,
        dock=dock,
        pose=Pose(position_m=(0.03 * z_m, 0.02 * z_m, z_m), **drawn),
        lights=Lights(level=1500.0, missing=tuple(missing)),
        lamps=lamps,
        seed=3,
    )


def found_in(dock, z_m, **about):
    image, truth = render(scene_of(dock, z_m, **about))
    return estimate(image, CAMERA, dock), truth


def off(found, truth):
    """How far the chosen pose is from the truth: as a share of the range, and in degrees."""
    pose = found.selected
    share = np.linalg.norm(pose.position_m - truth.position_m) / np.linalg.norm(truth.position_m)
    return share, math.degrees(math.acos(min(1.0, float(pose.normal @ truth.normal))))


@pytest.mark.parametrize("dock", [CONCENTRIC, BEHIND])
@pytest.mark.parametrize(
    ("z_m", "names"), [(9.0, {"far"}), (4.0, {"far", "near"}), (1.5, {"far", "near"}), (0.5, {"near"})]
)
def test_whichever_rings_are_seen_give_the_docks_pose(dock, z_m, names):
    found, truth = found_in(dock, z_m)
    assert found.status == "ok"
    assert {*found.rings} == names
    share, angle_deg = off(found, truth)
    assert share < (0.003 if z_m < 9 else 0.01)
    assert angle_deg < (1 if z_m < 9 else 3)
    line = found.to_dict()
    assert line["ring"] == list(found.rings)
    assert [ring["name"] for ring in line["dock"]["rings"]] == ["far", "near"]
    assert line["rivals"] == []


def test_a_dock_of_one_ring_names_none():
    found, _ = found_in(Dock(0.9, 12), 4.0)
    assert found.to_dict()["ring"] is None
    assert found.of_ring is None


def test_the_small_ring_is_not_seen_in_every_other_light_of_the_large():
    alone = Dock(rings=(NEAR, FAR))
    found, truth = found_in(alone, 4.0, missing=range(6))  # the small one is dark
    assert found.rings == ("far",)
    assert off(found, truth)[0] < 0.003


def test_rings_of_as_many_lights_are_told_apart_by_each_other():
    dock = Dock(rings=(msgspec.structs.replace(FAR, lights=8), msgspec.structs.replace(NEAR, diameter=0.3, lights=8)))
    found, truth = found_in(dock, 3.0)
    assert {*found.rings} == {"far", "near"}
    assert off(found, truth)[0] < 0.003


def test_a_ring_beside_the_dock_s_axis_and_turned():
    side = DockRing(name="side", diameter=0.3, lights=7, position_m=(0.6, 0.1, 0.2), normal=(0.3, 0.0, -1.0))
    dock = Dock(rings=(msgspec.structs.replace(FAR, diameter=0.5), side), entrance=Entrance(position_m=(0, 0, 0.4)))
    for missing, names in (((), {"far", "side"}), (range(12), {"side"}), (range(12, 19), {"far"})):
        found, truth = found_in(dock, 2.5, missing=missing)
        assert {*found.rings} == names
        share, angle_deg = off(found, truth)
        assert share < 0.005
        assert angle_deg < 1
        guidance = guide(found.selected, dock, CAMERA)
        assert guidance is not None
        assert guidance.along_m == pytest.approx(float(-truth.position_m @ truth.normal) + 0.4, abs=0.02)


def test_two_rings_tell_more_than_one():
    both, truth = found_in(BEHIND, 3.0)
    alone = estimate(render(scene_of(BEHIND, 3.0))[0], CAMERA, FAR.dock)
    assert both.selected.probability > 0.999
    assert max(both.selected.sigma_total_theta_rad) < max(alone.selected.sigma_total_theta_rad)
    assert both.selected.sigma_total_position_m[2] < alone.selected.sigma_total_position_m[2]
    apart = np.abs(both.selected.position_m - truth.position_m)
    assert (apart < 4 * np.array(both.selected.sigma_total_position_m)).all()


def test_the_pose_that_a_second_ring_rules_out_stays_where_it_was():
    both, truth = found_in(BEHIND, 3.0)
    right, wrong = both.candidates
    assert right.probability > 0.999
    twin = both.of_ring.candidates[1]
    np.testing.assert_allclose(wrong.normal, twin.normal)
    assert np.linalg.norm(wrong.normal - truth.normal) > 5 * np.linalg.norm(right.normal - truth.normal)


def test_lamps_beside_the_dock_are_no_ring_of_it():
    lamps = tuple(Lamp(position_m=(0.2 * x, 0.35, 3.0), level=1500.0, radius_m=0.004) for x in range(-2, 3))
    found, truth = found_in(Dock(rings=(FAR, NEAR)), 3.0, missing=range(12, 18), lamps=lamps)
    assert found.rings == ("far",)
    assert off(found, truth)[0] < 0.003


def test_nothing_is_found_where_nothing_is():
    found = estimate(np.full((480, 640), 20, np.uint8), CAMERA, CONCENTRIC)
    assert found.status != "ok"
    assert (found.rings, found.dock) == ((), CONCENTRIC)
    assert found.to_dict()["ring"] == []


def test_what_is_drawn_is_the_circle_that_was_seen():
    found, truth = found_in(BEHIND, 0.6)
    outline = found.draw()
    assert outline.shape == (480, 640, 3)
    circle, _, _ = pose_lines(found.selected, found)
    lights = truth.lights_px[12:]
    nearest = np.linalg.norm(circle[:, None] - lights, axis=2).min(axis=0)
    assert nearest.max() < 5  # points on the circle are that far apart


def test_equal_errors_meet_half_way_and_are_half_as_large():
    errors = PoseErrors(np.diag([4e-4] * 3 + [1e-2] * 3), np.eye(3))
    one = CirclePose.at(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, -1.0]), CAMERA, errors=errors)
    other = replace(one, position_m=np.array([0.02, 0.0, 2.0]))
    mean, square = _agreed(one, other, CAMERA)
    np.testing.assert_allclose(mean.position_m, [0.01, 0, 2], atol=1e-9)
    assert mean.sigma_position_m == pytest.approx([0.02 / math.sqrt(2)] * 3)
    least = (1e-3 * 2) ** 2
    assert square == pytest.approx(0.02**2 / (2 * (4e-4 + least)))


def seen_at(z_m, first, last, *, missed=0, groups=20):
    """A ring at a distance, whose lights are those of the groups from one number up to another."""
    on_ring = (np.arange(groups) >= first) & (np.arange(groups) < last)
    pose = SimpleNamespace(position_m=np.array([0.0, 0.0, z_m]))
    one = SimpleNamespace(
        lights_on_ring=last - first, detection=0.9, ring=SimpleNamespace(on_ring=on_ring), candidates=(pose,)
    )
    return _Seen(CONCENTRIC, ((FAR, one),), missed)


@pytest.mark.parametrize(
    ("one", "other", "is_better"),
    [
        (seen_at(1.0, 0, 6), seen_at(3.0, 6, 18), True),
        (seen_at(3.0, 6, 18), seen_at(1.0, 0, 6), False),
        (seen_at(1.0, 0, 5), seen_at(3.0, 6, 18), False),
        (seen_at(1.0, 0, 7, missed=2), seen_at(3.0, 7, 19), False),
        (seen_at(1.0, 0, 6), seen_at(3.0, 5, 17), False),
        (seen_at(3.0, 5, 17), seen_at(1.0, 0, 6), True),
        (seen_at(1.0, 0, 6), seen_at(3.0, 6, 18, groups=30), False),
    ],
    ids=[
        *("the nearer of two", "the farther", "the nearer with less than half the lights", "or with what is missed"),
        *("fewer of the same lights", "more of the same lights", "fewer at another level"),
    ],
)
def test_of_two_docks_the_nearer_is_taken_and_of_two_readings_of_one_the_fuller(one, other, is_better):
    assert one.betters(other) is is_better


def test_the_other_docks_ring_is_another_dock():
    found, _ = found_in(CONCENTRIC, 3.0)
    assert [one.rings for one in rings_of(found)] == [("far", "near")]


def test_the_tracker_goes_on_from_ring_to_ring():
    tracker, named = Tracker(CAMERA, BEHIND), []
    for number, z_m in enumerate(np.linspace(1.6, 0.6, 12)):
        image, truth = render(scene_of(BEHIND, float(z_m)))
        tracked = tracker.see(image, 0.2 * number)
        named.append(tracked.estimate.rings)
        assert tracked.track.age == number + 1
        assert tracked.filtered is not None
        assert np.linalg.norm(tracked.filtered.position_m - truth.position_m) < 0.01
    assert "far" in named[0]
    assert named[-1] == ("near",)
