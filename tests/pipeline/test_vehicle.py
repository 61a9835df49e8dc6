"""Where the camera sits on the vehicle: turns by hand, by scipy, and errors against draws."""

import math

import numpy as np
import pytest
from dockpose import Camera, Dock, Mount, Vehicle, load_vehicle
from dockpose.files import FileError
from dockpose.pose.circle import CirclePose
from dockpose.pose.solve import find_poses
from scipy.spatial.transform import Rotation

CAMERA, DOCK = Camera(700, 700, 319.5, 239.5, 640, 480), Dock(0.30, 10)
SQUARE_ON = np.array([0.0, 0.0, -1.0])


def pose_at(place, normal=SQUARE_ON):
    return CirclePose.at(np.array(place, float), np.array(normal, float), CAMERA)


def seen(place=(0.1, -0.2, 1.5), tilt_deg=20.0):
    """A pose with its errors, as of lights in a picture."""
    turn = Rotation.from_euler("y", tilt_deg, degrees=True).as_matrix()
    points = CAMERA.project(np.array(place) + DOCK.light_points() @ turn.T)
    return find_poses(points, CAMERA, DOCK)[1].candidates[0]


@pytest.mark.parametrize(
    ("frame", "mount", "there"),
    [
        # A camera that looks ahead: the dock 2 m ahead, 0.1 right, 0.3 down of it.
        ("frd", {}, (2, 0.1, 0.3)),
        ("flu", {}, (2, -0.1, -0.3)),
        ("frd", {"position_m": (0.2, 0, -0.1)}, (2.2, 0.1, 0.2)),
        # Straight down: what is ahead of the camera is below, and the picture's lower edge towards the stern.
        ("frd", {"pitch_deg": -90}, (-0.3, 0.1, 2)),
        ("flu", {"pitch_deg": 90}, (-0.3, -0.1, -2)),
        # To the right, and upside down.
        ("frd", {"yaw_deg": 90}, (-0.1, 2, 0.3)),
        ("flu", {"yaw_deg": -90}, (-0.1, -2, -0.3)),
        ("frd", {"roll_deg": 180}, (2, -0.1, -0.3)),
        # As tf prints an optical frame: x right, y down, z ahead in x ahead, y left, z up.
        ("flu", {"quaternion_xyzw": (-0.5, 0.5, -0.5, 0.5)}, (2, -0.1, -0.3)),
    ],
)
def test_the_place_in_the_vehicles_frame_by_hand(frame, mount, there):
    vehicle = Vehicle(T_body_camera=Mount(**mount), frame=frame)
    np.testing.assert_allclose(vehicle.pose(pose_at((0.1, 0.3, 2))).position_m, there, atol=1e-12)


def test_yaw_comes_before_pitch_and_roll():
    # Yawed to starboard, then pitched down about the new y axis: ahead of the camera is starboard and down.
    vehicle = Vehicle(T_body_camera=Mount(yaw_deg=90, pitch_deg=-30))
    ahead = vehicle.rotation @ [0, 0, 1]
    np.testing.assert_allclose(ahead, [0, math.cos(math.radians(30)), 0.5], atol=1e-12)


def test_the_attitude_goes_along():
    vehicle = Vehicle(T_body_camera=Mount(), frame="flu")
    body = vehicle.pose(pose_at((0, 0, 2)))
    # Square on: the dock's z, into it, is the vehicle's x; its x, right, is minus y.
    turn = Rotation.from_quat(body.quaternion_xyzw).as_matrix()
    np.testing.assert_allclose(turn, [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-12)
    assert body.to_dict()["normal"] == pytest.approx([-1, 0, 0])


def test_both_frames_say_the_same():
    frd = Vehicle(T_body_camera=Mount(position_m=(0.3, 0.1, 0.2), roll_deg=5, pitch_deg=-20, yaw_deg=30))
    flu = frd.in_frame("flu")
    assert flu.in_frame("flu") is flu
    one, other = frd.pose(seen()), flu.pose(seen())
    np.testing.assert_allclose(one.position_m * [1, -1, -1], other.position_m, atol=1e-12)
    np.testing.assert_allclose(np.diag([1, -1, -1]) @ one.rotation, other.rotation, atol=1e-12)


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_a_turned_picture_gives_the_same_place(degrees):
    vehicle = Vehicle(T_body_camera=Mount(position_m=(0.3, 0.1, 0.2), pitch_deg=-20))
    x, y, z = 0.1, 0.3, 2.0
    for _ in range(degrees // 90):
        x, y = -y, x
    turned = vehicle.rotated(degrees).pose(pose_at((x, y, z)))
    np.testing.assert_allclose(turned.position_m, vehicle.pose(pose_at((0.1, 0.3, 2))).position_m, atol=1e-12)


def test_the_covariance_goes_along_with_the_axes():
    vehicle, pose = Vehicle(T_body_camera=Mount(pitch_deg=-90)), seen()
    body, alone = vehicle.pose(pose), pose.covariance
    assert body.covariance is not None
    assert alone is not None
    # The camera looks down: its range is the vehicle's depth, its downwards the vehicle's backwards.
    np.testing.assert_allclose(np.diag(body.covariance)[:3], np.diag(alone)[[1, 0, 2]], rtol=1e-9)
    assert body.covariance[0, 2] == pytest.approx(-alone[1, 2])
    assert body.covariance_total == pytest.approx(vehicle.rotation_of(pose.covariance_total))


def test_errors_of_the_mount_are_those_of_draws():
    rng, sigma_m, sigma_deg = np.random.default_rng(7), 0.01, 1.0
    mount = Mount(position_m=(0.3, 0.0, 0.1), pitch_deg=-20, position_sigma_m=sigma_m, angle_sigma_deg=sigma_deg)
    vehicle, pose = Vehicle(T_body_camera=mount), seen((0.4, -0.3, 3.0))
    there = vehicle.rotation @ pose.position_m
    turns = Rotation.from_rotvec(math.radians(sigma_deg) * rng.standard_normal((20_000, 3)))
    drawn = turns.apply(there) + sigma_m * rng.standard_normal((20_000, 3))
    off = np.hstack([drawn - there, turns.as_rotvec()])
    body = vehicle.pose(pose)
    assert body.covariance_total is not None
    own = body.covariance_total - vehicle.rotation_of(pose.covariance_total)
    np.testing.assert_allclose(own, np.cov(off.T), atol=0.03 * own.max())


def test_without_errors_there_are_none():
    body = Vehicle(T_body_camera=Mount()).pose(pose_at((0, 0, 1)))
    assert (body.covariance, body.covariance_total) == (None, None)
    assert body.to_dict()["sigma_position_m"] is None


def test_a_file_is_read(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        "T_body_camera:\n  position_m: [0.2, 0, 0.1]\n  pitch_deg: -15\n  angle_sigma_deg: 0.5\nframe: frd\n"
    )
    mount = Mount(position_m=(0.2, 0.0, 0.1), pitch_deg=-15, angle_sigma_deg=0.5)
    assert load_vehicle(path) == Vehicle(T_body_camera=mount, frame="frd")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frame: frd", "missing required field `T_body_camera`"),
        ("T_body_camera: {}", "frame is missing; say frd"),
        ("T_body_camera: {}\nframe: ned", "frame is 'ned'; it must be one of frd, flu"),
        ("T_body_camera: {posittion_m: [0, 0, 0]}\nframe: frd", "unknown field `posittion_m`"),
        ("T_body_camera: {quaternion_xyzw: [0, 0, 0, 1], yaw_deg: 3}\nframe: frd", "yaw_deg does not go with"),
        ("T_body_camera: {quaternion_xyzw: [0, 0, 0, 0]}\nframe: frd", "quaternion_xyzw has no length"),
        ("T_body_camera: {angle_sigma_deg: -1}\nframe: frd", "angle_sigma_deg is -1"),
        ("T_body_camera: {position_m: [.nan, 0, 0]}\nframe: frd", "position_m x is nan"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path, text, message):
    path = tmp_path / "vehicle.yaml"
    path.write_text(text)
    with pytest.raises(FileError, match=message) as caught:
        load_vehicle(path)
    assert str(path) in str(caught.value)
