"""Guidance: places by hand, and standard errors against draws."""

import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, Entrance, Mount, Vehicle, estimate, guide
from dockpose.guidance import entrance_of, guided
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.simulate import Pose, Scene, render

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
AHEAD = Vehicle(T_body_camera=Mount())


def pose_at(place, theta_x_deg=0.0, theta_y_deg=0.0, roll_deg=None):
    rotation = rotation_from_angles(math.radians(theta_x_deg), math.radians(theta_y_deg))
    roll = None if roll_deg is None else math.radians(roll_deg)
    return CirclePose.at(np.array(place, float), -rotation[:, 2], CAMERA, roll_rad=roll)


def guidance(pose, vehicle=None, lights=10, **entrance):
    found = guide(pose, Dock(0.30, lights, entrance=Entrance(**entrance)), CAMERA, vehicle)
    assert found is not None
    return found


@pytest.mark.parametrize("vehicle", [None, AHEAD, AHEAD.in_frame("flu")])
def test_square_on_before_the_dock(vehicle):
    # The dock is 2 m ahead, 0.3 m right and 0.1 m below: the vehicle is left of the axis and above it.
    found = guidance(pose_at((0.3, 0.1, 2.0)), vehicle)
    assert (found.along_m, found.across_m, found.above_m) == pytest.approx((2.0, -0.3, 0.1))
    assert (found.yaw_off_deg, found.pitch_off_deg) == pytest.approx((0, 0))
    assert found.off_axis_deg == pytest.approx(math.degrees(math.atan2(math.hypot(0.3, 0.1), 2)))
    assert found.inside_cone
    assert found.target == "entrance"
    assert found.frame == ("camera" if vehicle is None else vehicle.frame)


def test_a_vehicle_that_points_to_starboard_and_up():
    # The vehicle is turned by 30 degrees to starboard: the dock, which stood ahead, is to port and turned with it.
    turn = rotation_from_angles(0, math.radians(-30))
    pose = CirclePose.at(turn @ [0, 0, 2.0], turn @ [0, 0, -1.0], CAMERA)
    found = guidance(pose)
    assert (found.along_m, found.across_m, found.above_m) == pytest.approx((2, 0, 0), abs=1e-12)
    assert (found.yaw_off_deg, found.pitch_off_deg) == pytest.approx((30, 0), abs=1e-9)
    up = rotation_from_angles(math.radians(-10), 0)  # the vehicle pitches up: the dock goes down in the picture
    found = guidance(CirclePose.at(up @ [0, 0, 2.0], up @ [0, 0, -1.0], CAMERA))
    assert (found.yaw_off_deg, found.pitch_off_deg) == pytest.approx((0, 10), abs=1e-9)


@pytest.mark.parametrize(
    ("place", "entrance", "inside"),
    [
        ((0.26, 0, 1), {"cone_deg": 15}, True),  # tan 15 = 0.268
        ((0.28, 0, 1), {"cone_deg": 15}, False),
        ((0.28, 0, 1), {"cone_deg": 15, "radius_m": 0.05}, True),
        ((0, 0.28, 1), {"cone_deg": 15}, False),
        ((0, 0, 0.1), {"position_m": (0, 0, -0.2)}, False),  # past the entrance
        ((0, 0, 0.1), {"position_m": (0, 0, -0.2), "radius_m": 0.3}, False),  # and not beyond its width
    ],
)
def test_the_cone(place, entrance, inside):
    found = guidance(pose_at(place), **entrance)
    assert found.inside_cone == inside
    assert found.target == ("entrance" if inside else "standoff")


def test_from_outside_the_cone_it_goes_to_the_stand_off():
    # The dock faces the camera at 45 degrees: 1.5 m before it on its axis.
    pose = pose_at((0, 0, 3.0), theta_y_deg=45)
    assert guidance(pose, standoff_m=1.5).target_m == pytest.approx(
        (-1.5 * math.sqrt(0.5), 0, 3 - 1.5 * math.sqrt(0.5))
    )
    assert guidance(pose, AHEAD).target_m == pytest.approx((3 - math.sqrt(0.5), -math.sqrt(0.5), 0))


def test_the_target_inside_is_the_entrance():
    assert guidance(pose_at((0.1, 0, 2)), position_m=(0, 0, 0.3)).target_m == pytest.approx((0.1, 0, 2.3))


@pytest.mark.parametrize(
    ("place", "mount", "entrance", "there"),
    [
        ((0, 0, 2), None, {"position_m": (0, 0, 0.5)}, (2.5, 0, 0)),
        # The camera sits 0.5 m ahead of the vehicle's middle, and 0.2 m below it.
        ((0, 0, 2), Mount(position_m=(0.5, 0, 0.2)), {}, (2.5, 0, 0.2)),
        ((-0.3, 0, 2), Mount(roll_deg=90), {}, (2, 0, -0.3)),  # the picture's left is up
        # The dock is 0.2 m to starboard and 0.1 m ahead of a vehicle above it.
        ((0.2, -0.1, 2), Mount(pitch_deg=-90), {}, (2, -0.2, -0.1)),
    ],
    ids=["an entrance behind the ring", "the vehicle and not its camera", "a rolled vehicle", "a dock in the floor"],
)
def test_places_in_the_corridor_by_hand(place, mount, entrance, there):
    found = guidance(pose_at(place), mount and Vehicle(T_body_camera=mount), **entrance)
    assert (found.along_m, found.across_m, found.above_m) == pytest.approx(there)


@pytest.mark.parametrize(
    ("roll_deg", "x_m", "y_m"),
    [
        (None, 0.2, 0.0),
        (3.0, 0.2 * math.cos(math.radians(3)), 0.2 * math.sin(math.radians(3))),
        (33.0, 0.2 * math.cos(math.radians(-3)), 0.2 * math.sin(math.radians(-3))),  # ten lights: modulo 36 degrees
    ],
)
def test_an_entrance_off_the_axis_turns_with_the_dock(roll_deg, x_m, y_m):
    dock = Dock(0.30, 10, entrance=Entrance(position_m=(0.2, 0, 0)))
    found = entrance_of(pose_at((0, 0, 2), roll_deg=roll_deg), dock, CAMERA)
    assert found is not None
    np.testing.assert_allclose(found.position_m, [x_m, y_m, 2], atol=1e-12)


def test_an_entrance_of_another_direction():
    # Its normal points up in the dock's frame (y is down), so that one goes in downwards.
    dock = Dock(0.30, 10, entrance=Entrance(position_m=(0, 0, 0.4), normal=(0, -2, 0)))
    found = entrance_of(pose_at((0, 0, 2)), dock, CAMERA)
    assert found is not None
    np.testing.assert_allclose(found.normal, [0, -1, 0], atol=1e-12)
    assert math.degrees(found.theta_x_rad) == pytest.approx(-90)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0.1, 1), (1, 0, 0)])
def test_any_direction_may_be_the_entrances(normal):
    dock = Dock(0.30, 10, entrance=Entrance(normal=normal))
    found = entrance_of(pose_at((0, 0, 2), roll_deg=0.0), dock, CAMERA)
    assert found is not None
    np.testing.assert_allclose(found.normal, np.array(normal) / np.linalg.norm(normal), atol=1e-9)


def test_errors_of_the_entrance_and_of_guidance_are_those_of_draws():
    angles = (0, 40, 75, 120, 170, 200, 260, 300)  # unlike gaps, so that the roll is known
    dock = Dock(0.30, angles_deg=angles, diameter_sigma_m=0.0, entrance=Entrance(position_m=(0.2, -0.1, 0.4)))
    exact = {name: 0.0 for name in ("fx_px", "fy_px", "cx_px", "cy_px")}
    camera = msgspec.structs.replace(CAMERA, sigma=exact)
    rng, truth = np.random.default_rng(3), rotation_from_angles(0.3, -0.5)
    points = camera.project([0.2, 0.1, 2.0] + dock.light_points() @ truth.T)
    draws, sigmas = [], []
    for _ in range(200):
        noisy = points + 0.1 * rng.standard_normal(points.shape)
        (pose, *_) = find_poses(noisy, camera, dock)[1].candidates
        entrance, found = entrance_of(pose, dock, camera), guide(pose, dock, camera, AHEAD)
        assert entrance is not None
        assert found is not None
        draws.append([*entrance.position_m, found.along_m, found.across_m, found.above_m])
        sigmas.append([*(entrance.sigma_position_m or ()), *(found.sigma_total_m or ())])
    # Each picture's own noise is told by its few residuals, in 95 % intervals: wider than the scatter by some tenths.
    ratio = np.median(sigmas, axis=0) / np.std(draws, axis=0)
    assert (ratio > 0.9).all()
    assert (ratio < 1.4).all()


def test_what_a_json_object_says():
    dock = Dock(0.30, 10, entrance=Entrance(position_m=(0, 0, 0.2)))
    scene = Scene(camera=CAMERA, dock=dock, pose=Pose(position_m=(0.1, 0.0, 1.5), theta_y_deg=30))
    found = estimate(render(scene)[0], CAMERA, dock)
    line = found.to_dict(vehicle=AHEAD)
    assert line["vehicle"]["position_m"] == pytest.approx([1.5, 0.1, 0.0], abs=0.02)
    assert line["entrance"]["position_m"] == pytest.approx([0.2, 0, 1.673], abs=0.02)
    assert line["guidance"]["target"] == "standoff"
    assert line["guidance"]["yaw_off_deg"] == pytest.approx(-30, abs=0.5)
    assert found.to_dict()["vehicle"] is None
    assert estimate(render(scene)[0], CAMERA, Dock(0.30, 10)).to_dict(vehicle=AHEAD)["guidance"] is None


def test_without_a_pose_there_is_none():
    dock = Dock(0.30, 10, entrance=Entrance())
    assert guided(None, dock, CAMERA, AHEAD) == {"entrance": None, "vehicle": None, "guidance": None}
    assert guide(pose_at((0, 0, 1)), Dock(0.30), CAMERA) is None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"normal": (0, 0, 0)}, "normal is"),
        ({"position_m": (0, math.inf, 0)}, "position_m y is inf"),
        ({"position_m": (0, 0)}, "position_m has 2 values"),
        ({"cone_deg": 90}, "cone_deg is 90; it must be below 90"),
        ({"radius_m": -1}, "radius_m is -1"),
        ({"standoff_m": -1}, "standoff_m is -1"),
    ],
)
def test_impossible_entrances_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        Entrance(**values)


def test_an_entrance_off_the_axis_needs_the_lights():
    assert Dock(0.30, entrance=Entrance(position_m=(0, 0, 1))).entrance is not None
    with pytest.raises(ValueError, match="lights is None; an entrance off the dock's axis"):
        Dock(0.30, entrance=Entrance(position_m=(0.1, 0, 1)))
