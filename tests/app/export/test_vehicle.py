"""Signs by hand, and all of it against a vehicle that is put together from rotations by another library."""

import math

import msgspec
import numpy as np
import pytest
from dockpose import Mount, Vehicle
from dockpose.app.export.vehicle import (
    AHEAD,
    dock_in_body,
    moved,
    quaternion_wxyz,
    vehicle_covariance,
    vehicle_in_dock,
)
from dockpose.pose.circle import CirclePose, PoseErrors
from scipy.spatial.transform import Rotation

TO_FRD = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # by axes right, down, ahead
TILTED = Vehicle(T_body_camera=Mount(position_m=(0.2, -0.05, 0.1), roll_deg=5, pitch_deg=-20, yaw_deg=10))
TILTED_CAMERA = (Rotation.from_euler("ZYX", [10, -20, 5], degrees=True) * TO_FRD).as_matrix(), [0.2, -0.05, 0.1]


def pose_of(x: float, y: float, z: float, theta_x_deg: float = 0.0, theta_y_deg: float = 0.0) -> CirclePose:
    turned = Rotation.from_euler("YX", [theta_y_deg, theta_x_deg], degrees=True)
    return CirclePose(np.array([x, y, z]), turned.apply([0, 0, -1.0]), np.zeros(2))


def ahead_by(x_m: float) -> Vehicle:
    return Vehicle(T_body_camera=Mount(position_m=(x_m, 0, 0)))


SIN, COS = math.sin(math.radians(10)), math.cos(math.radians(10))


@pytest.mark.parametrize(
    ("pose", "vehicle", "position_m", "turned_deg"),
    [
        (pose_of(0, 0, 2), AHEAD, [-2, 0, 0], (0, 0, 0)),
        (pose_of(0.3, 0.1, 2), AHEAD, [-2, -0.3, -0.1], (0, 0, 0)),
        # Turned right, the dock is seen to the left, its face turned the other way; with the nose up it is seen lower.
        (pose_of(-2 * SIN, 0, 2 * COS, theta_y_deg=-10), AHEAD, [-2, 0, 0], (0, 0, 10)),
        (pose_of(0, 2 * SIN, 2 * COS, theta_x_deg=-10), AHEAD, [-2, 0, 0], (0, 10, 0)),
        (pose_of(0, 0, 2), ahead_by(0.2), [-2.2, 0, 0], (0, 0, 0)),
    ],
    ids=["square before it", "dock right and below", "turned right", "nose up", "camera ahead of the vehicle"],
)
def test_where_the_vehicle_is_by_hand(pose, vehicle, position_m, turned_deg):
    here = vehicle_in_dock(pose, vehicle)
    np.testing.assert_allclose(here.position_m, position_m, atol=1e-12)
    assert np.degrees(here.roll_pitch_yaw_rad) == pytest.approx(turned_deg)


def test_where_the_dock_is_by_hand():
    np.testing.assert_allclose(dock_in_body(pose_of(0.3, 0.1, 2)).position_m, [2, 0.3, 0.1], atol=1e-12)
    np.testing.assert_allclose(dock_in_body(pose_of(0, 0, 2), ahead_by(0.2)).position_m, [2.2, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("vehicle", "camera"),
    [(AHEAD, (TO_FRD.as_matrix(), [0, 0, 0])), (TILTED, TILTED_CAMERA), (TILTED.in_frame("flu"), TILTED_CAMERA)],
    ids=["ahead", "tilted", "tilted flu"],
)
@pytest.mark.parametrize("seed", range(5))
def test_poses_are_those_of_a_chain_of_transforms(vehicle, camera, seed):
    rng = np.random.default_rng(seed)
    pose = pose_of(*rng.uniform([-1, -1, 0.5], [1, 1, 4]), *rng.uniform(-50, 50, 2))
    body_camera, camera_dock, dock_frd = np.eye(4), np.eye(4), np.eye(4)
    body_camera[:3, :3], body_camera[:3, 3] = camera
    camera_dock[:3, :3], camera_dock[:3, 3] = pose.rotation, pose.position_m
    dock_frd[:3, :3] = TO_FRD.inv().as_matrix()
    wanted = body_camera @ camera_dock @ dock_frd
    there, here = dock_in_body(pose, vehicle), vehicle_in_dock(pose, vehicle)
    np.testing.assert_allclose(there.rotation, wanted[:3, :3], atol=1e-12)
    np.testing.assert_allclose(there.position_m, wanted[:3, 3], atol=1e-12)
    back = np.linalg.inv(wanted)
    np.testing.assert_allclose(here.position_m, back[:3, 3], atol=1e-12)
    yaw, pitch, roll = Rotation.from_matrix(back[:3, :3]).as_euler("ZYX")
    assert here.roll_pitch_yaw_rad == pytest.approx((roll, pitch, yaw))
    w, x, y, z = quaternion_wxyz(there.rotation)
    assert w >= 0
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), wanted[:3, :3], atol=1e-12)


def with_errors(pose: CirclePose, covariance: np.ndarray) -> CirclePose:
    errors = PoseErrors(covariance, pose.rotation)
    return CirclePose(pose.position_m, pose.normal, pose.centre_px, errors=errors)


@pytest.mark.parametrize("vehicle", [AHEAD, TILTED], ids=["ahead", "tilted"])
def test_the_covariance_is_that_of_many_poses(vehicle):
    """Poses drawn about one by its position's and its face's errors, each turned into what is sent."""
    rng = np.random.default_rng(0)
    pose = pose_of(*rng.uniform([-1, -1, 1], [1, 1, 4]), *rng.uniform(-40, 40, 2))
    root = rng.normal(size=(5, 5)) * 1e-4
    covariance = np.zeros((6, 6))
    covariance[:5, :5] = root @ root.T  # x, y, z, and about the dock's own x and y
    sent = []
    for step in rng.multivariate_normal(np.zeros(6), covariance, size=2000):
        turned = Rotation.from_matrix(pose.rotation) * Rotation.from_rotvec([step[3], step[4], 0])
        other = CirclePose(pose.position_m + step[:3], turned.apply([0, 0, -1.0]), pose.centre_px)
        here = vehicle_in_dock(other, vehicle)
        sent.append([*here.position_m, *here.roll_pitch_yaw_rad])
    wanted = np.cov(np.array(sent).T)
    found = vehicle_covariance(with_errors(pose, covariance), vehicle)
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    known = [0, 1, 2, 4, 5]
    # 2000 draws: standard errors of a covariance are up to 3.2 % of the scale.
    assert (np.abs(found - wanted) / scale)[np.ix_(known, known)].max() < 0.1
    assert found[3, 3] == pytest.approx(math.pi**2 / 3, rel=0.35)  # of a full turn about the dock's axis


def test_what_a_tilted_mount_may_be_off_is_that_of_draws():
    rng, pose, sigma_m, sigma_deg = np.random.default_rng(5), pose_of(0.4, -0.2, 3, 15, -30), 0.01, 0.5
    sent = []
    for step in rng.normal(size=(2000, 6)):
        off = Rotation.from_rotvec(math.radians(sigma_deg) * step[3:])
        mount = Mount(
            position_m=tuple((np.array(TILTED.T_body_camera.position_m) + sigma_m * step[:3]).tolist()),
            quaternion_xyzw=tuple((off * Rotation.from_matrix(TILTED.rotation)).as_quat().tolist()),
        )
        here = vehicle_in_dock(pose, Vehicle(T_body_camera=mount))
        sent.append([*here.position_m, *here.roll_pitch_yaw_rad])
    wanted, exact = np.cov(np.array(sent).T), with_errors(pose, np.zeros((6, 6)))
    mount = msgspec.structs.replace(TILTED.T_body_camera, position_sigma_m=sigma_m, angle_sigma_deg=sigma_deg)
    found = vehicle_covariance(exact, Vehicle(T_body_camera=mount)) - vehicle_covariance(exact, TILTED)
    assert (np.abs(found - wanted) / np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))).max() < 0.1


def test_errors_that_are_not_known_are_those_of_knowing_nothing():
    found = vehicle_covariance(pose_of(0, 0, 2))
    np.testing.assert_allclose(np.diag(found)[[0, 4, 5]], [1e6, math.pi**2 / 3, math.pi**2 / 3])


def test_a_step_ahead_and_a_turn_by_hand():
    """From 2 m to 1.5 m before the dock, and then turned right by 90 degrees: what was ahead is to the left."""
    before = vehicle_in_dock(pose_of(0, 0, 2))
    now = vehicle_in_dock(pose_of(0, 0, 1.5))
    turned, way = moved(before, now)
    np.testing.assert_allclose([*turned, *way], [0, 0, 0, 0.5, 0, 0], atol=1e-12)
    right = now._replace(rotation=Rotation.from_euler("Z", 90, degrees=True).as_matrix())
    turned, way = moved(before, right)
    np.testing.assert_allclose([*turned, *way], [0, 0, math.pi / 2, 0, -0.5, 0], atol=1e-12)
