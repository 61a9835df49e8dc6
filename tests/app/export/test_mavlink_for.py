"""Messages made for one autopilot's filter: what pymavlink's decoder finds in them, and a filter that uses them."""

import contextlib
import itertools
import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose import Mount, Vehicle
from dockpose.app.export.mavlink import Autopilot
from dockpose.app.export.vehicle import AHEAD, level_in_dock
from dockpose.pose.circle import CirclePose, PoseErrors
from scipy.spatial.transform import Rotation

from tests.support.ekf import GRAVITY, Ekf, angle_error

pytestmark = pytest.mark.extra
ARDUPILOT, PX4, GROUND_STATION = 3, 12, 8
TO_FRD = AHEAD.rotation
TILTED = Vehicle(
    T_body_camera=Mount(
        position_m=(0.2, -0.05, 0.1),
        roll_deg=5,
        pitch_deg=-20,
        yaw_deg=10,
        position_sigma_m=0.01,
        angle_sigma_deg=0.4,
    )
)
SIGMA_RAD = 0.003  # of a yaw that is well known


def seen_from(position_m, roll_pitch_yaw_deg, vehicle=AHEAD, dock_pitch_deg=0.0, off_m=(0, 0, 0), off_rad=(0, 0, 0)):
    """The pose that a camera has of a dock at the origin of level axes, whose x goes into it, from a vehicle there."""
    body = Rotation.from_euler("ZYX", roll_pitch_yaw_deg[::-1], degrees=True)
    camera = body.as_matrix() @ vehicle.rotation
    camera_at = np.array(position_m) + body.apply(vehicle.T_body_camera.position_m)
    normal = Rotation.from_euler("Y", dock_pitch_deg, degrees=True).apply([-1.0, 0, 0])
    there = camera.T @ -camera_at + off_m
    facing = Rotation.from_rotvec(off_rad).apply(camera.T @ normal)
    pose = CirclePose(there, facing, np.zeros(2))
    # About the dock's own axes.
    spread = np.diag([0.004**2, 0.004**2, 0.01**2, SIGMA_RAD**2, SIGMA_RAD**2, math.pi**2 / 3])
    return CirclePose(there, facing, np.zeros(2), errors=PoseErrors(spread, pose.rotation))


@pytest.mark.parametrize("vehicle", [AHEAD, TILTED, TILTED.in_frame("flu")], ids=["ahead", "tilted", "tilted flu"])
@pytest.mark.parametrize("seed", range(4))
def test_level_axes_are_those_of_gravity_however_the_vehicle_is_turned(vehicle, seed):
    rng = np.random.default_rng(seed)
    place, turned = rng.uniform([-4, -1, -1], [-1, 1, 1]), rng.uniform([-25, -15, -20], [25, 15, 20])
    pose = seen_from(place, turned, vehicle.in_frame("frd"), dock_pitch_deg=rng.uniform(-10, 10))
    found = level_in_dock(pose, vehicle, *np.radians(turned[:2]))
    assert found is not None
    np.testing.assert_allclose(found[0].position_m, place, atol=1e-9)
    assert np.degrees(found[0].roll_pitch_yaw_rad) == pytest.approx(turned)


@pytest.mark.parametrize("vehicle", [AHEAD, TILTED], ids=["ahead", "tilted"])
def test_its_covariance_is_that_of_many_draws(vehicle):
    """By drawing what pose and mount are off by, a roll of any size among it."""
    place, turned = (-2.0, 0.4, -0.3), (12.0, -6.0, 15.0)
    pose, rng = seen_from(place, turned, vehicle, 4.0), np.random.default_rng(5)
    found, rows = level_in_dock(pose, vehicle, *np.radians(turned[:2])), []
    mount = vehicle.T_body_camera
    for _ in range(4000):
        off_m = rng.normal(0, [0.004, 0.004, 0.01])
        off_rad = rng.normal(0, SIGMA_RAD, 3)
        drawn = seen_from(place, turned, vehicle, 4.0, off_m, off_rad)
        moved = np.array(mount.position_m) + rng.normal(0, mount.position_sigma_m, 3)
        turn = Rotation.from_rotvec(np.radians(rng.normal(0, mount.angle_sigma_deg, 3)))
        seen = (turn * Rotation.from_matrix(vehicle.rotation)).as_quat()
        other = Vehicle(T_body_camera=Mount(position_m=tuple(moved.tolist()), quaternion_xyzw=tuple(seen.tolist())))
        one = level_in_dock(drawn, other, *np.radians(turned[:2]))
        assert one is not None
        rows.append([*one[0].position_m, one[0].roll_pitch_yaw_rad[2]])
    assert found is not None
    kept = np.ix_([0, 1, 2, 5], [0, 1, 2, 5])
    wanted = np.cov(np.array(rows).T)
    sigma = np.sqrt(np.diag(wanted))
    np.testing.assert_allclose((found[1][kept] - wanted) / np.outer(sigma, sigma), 0, atol=0.1)
    assert not found[1][3:5].any()
    assert not found[1][:, 3:5].any()


def test_a_dock_that_faces_up_shows_no_heading():
    pose = seen_from((-2, 0, 0), (0, 0, 0), dock_pitch_deg=85)
    assert level_in_dock(pose, AHEAD, 0.0, 0.0) is None


@contextlib.contextmanager
def link(**more: Any):
    told: list[str] = []
    with contextlib.closing(Autopilot("udpout:127.0.0.1:9", tell=told.append, **more)) as autopilot:
        yield autopilot, told


def says(autopilot: Autopilot, name: str, *fields: Any, sender=(1, 1)) -> None:
    """Let an autopilot say something to us."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect  # pyright: ignore[reportMissingImports]

    speaker: Any = dialect.MAVLink(None, *sender)
    autopilot._answer(getattr(speaker, f"{name}_encode")(*fields).pack(speaker))


def heartbeat(autopilot: Autopilot, kind: int, sender=(1, 1)) -> None:
    says(autopilot, "heartbeat", 12, kind, 0, 0, 4, sender=sender)


def attitude(autopilot: Autopilot, roll: float, pitch: float, sender=(1, 1)) -> None:
    says(autopilot, "attitude", 0, roll, pitch, 2.5, 0.0, 0.0, 0.0, sender=sender)


def sent(autopilot: Autopilot, pose: CirclePose, seen_s: float | None = None, time_s: float = 100.0) -> Any:
    """The message about a pose as pymavlink decodes it."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect  # pyright: ignore[reportMissingImports]

    found: Any = SimpleNamespace(selected=pose, detection=0.9, dock=None)
    level = autopilot._level(pose, time.monotonic() if seen_s is None else seen_s)
    (message,) = autopilot._messages(found, 0.97, time_s, level)
    hearer: Any = dialect.MAVLink(None)
    (decoded,) = hearer.parse_buffer(message.pack(dialect.MAVLink(None, 1, 197)))
    return decoded


ROLL, PITCH, YAW = 9.0, -4.0, 14.0
PLACE = (-2.0, 0.3, 0.2)


def test_for_ardupilot_the_yaw_has_its_own_error_alone():
    pose = seen_from(PLACE, (ROLL, PITCH, YAW), dock_pitch_deg=3)
    with link(made_for="ardupilot") as (autopilot, _):
        attitude(autopilot, math.radians(ROLL), math.radians(PITCH))
        message = sent(autopilot, pose)
    assert message.get_type() == "VISION_POSITION_ESTIMATE"
    assert np.degrees([message.roll, message.pitch, message.yaw]) == pytest.approx([ROLL, PITCH, YAW], abs=1e-4)
    assert [message.x, message.y, message.z] == pytest.approx(PLACE, abs=1e-6)
    # At 16 degrees of tilt an error of the normal is hardly more in the heading.
    assert math.degrees(angle_error(message)) == pytest.approx(math.degrees(SIGMA_RAD), rel=0.1)
    assert math.degrees(angle_error(message)) < 0.3
    level = level_in_dock(pose, AHEAD, math.radians(ROLL), math.radians(PITCH))
    assert level is not None
    assert message.covariance[:3] == pytest.approx(level[1][0, :3].tolist(), rel=1e-5)


def test_for_any_the_angles_are_as_unknown_as_the_roll():
    """What there is against it: the sum of all three is above all that ArduPilot takes, 86 degrees."""
    with link(made_for="any") as (autopilot, _):
        attitude(autopilot, math.radians(ROLL), math.radians(PITCH))
        message = sent(autopilot, seen_from(PLACE, (ROLL, PITCH, YAW)))
    assert message.get_type() == "VISION_POSITION_ESTIMATE"
    assert angle_error(message) > 1.5


@pytest.mark.parametrize("made_for", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    ("roll", "sender", "late_s"),
    [(None, (1, 1), 0.0), (0.1, (2, 1), 0.0), (0.1, (1, 191), 0.0), (0.1, (1, 1), 2.0), (math.nan, (1, 1), 0.0)],
    ids=["none", "another vehicle's", "no autopilot's", "an old one", "no number"],
)
def test_without_the_attitude_nothing_is_sent_as_an_angle(made_for, roll, sender, late_s):
    with link(made_for=made_for) as (autopilot, _):
        if roll is not None:
            attitude(autopilot, roll, 0.0, sender)
        message = sent(autopilot, seen_from(PLACE, (0, 0, YAW)), time.monotonic() + late_s)
    angles = message.q if made_for == "px4" else [message.roll, message.pitch, message.yaw]
    assert all(math.isnan(one) for one in angles)
    assert [message.x, message.y, message.z] == pytest.approx(PLACE, abs=1e-6)


def test_for_px4_an_odometry_with_what_is_not_known_left_out():
    with link(made_for="px4") as (autopilot, _):
        attitude(autopilot, math.radians(ROLL), math.radians(PITCH))
        message = sent(autopilot, seen_from(PLACE, (ROLL, PITCH, YAW)), time_s=1_800_000_000.25)
    assert message.get_type() == "ODOMETRY"
    assert (message.time_usec, message.frame_id, message.child_frame_id) == (1_800_000_000_250_000, 20, 12)
    assert (message.estimator_type, message.reset_counter, message.quality) == (2, 0, 87)
    assert [message.x, message.y, message.z] == pytest.approx(PLACE, abs=1e-6)
    w, x, y, z = message.q
    turned = Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)
    assert turned == pytest.approx([YAW, PITCH, ROLL], abs=1e-4)
    speeds = [message.vx, message.vy, message.vz, message.rollspeed, message.pitchspeed, message.yawspeed]
    assert all(math.isnan(one) for one in [*speeds, *message.velocity_covariance])
    # EKF2.cpp takes the three variances only where all are numbers, and of them the yaw's (ev_yaw_control.cpp).
    assert [message.pose_covariance[place] for place in (15, 18)] == [0, 0]
    assert math.degrees(math.sqrt(message.pose_covariance[20])) == pytest.approx(math.degrees(SIGMA_RAD), rel=0.1)


@pytest.mark.parametrize(
    ("kind", "sender", "made_for", "heard"),
    [
        (ARDUPILOT, (1, 1), "auto", "ardupilot"),
        (PX4, (1, 1), "auto", "px4"),
        (GROUND_STATION, (1, 1), "auto", "auto"),
        (ARDUPILOT, (2, 1), "auto", "auto"),
        (ARDUPILOT, (1, 190), "auto", "auto"),
        (ARDUPILOT, (1, 1), "any", "any"),
        (ARDUPILOT, (1, 1), "px4", "px4"),
    ],
)
def test_a_heartbeat_of_our_vehicles_autopilot_says_for_whom(kind, sender, made_for, heard):
    with link(made_for=made_for) as (autopilot, told):
        heartbeat(autopilot, kind, sender)
        heartbeat(autopilot, kind, sender)
        assert autopilot.made_for == heard
        assert len(told) == (heard != made_for)
        if told:
            assert "a heartbeat says " in told[0]


def test_other_axes_are_a_reset_and_no_way_is_sent_across():
    pose = seen_from(PLACE, (ROLL, PITCH, YAW))
    with link() as (autopilot, _):
        counts = [sent(autopilot, pose).reset_counter]
        heartbeat(autopilot, ARDUPILOT)
        counts.append(sent(autopilot, pose).reset_counter)
        attitude(autopilot, math.radians(ROLL), math.radians(PITCH))
        counts += [sent(autopilot, pose).reset_counter for _ in range(2)]
        counts.append(sent(autopilot, pose, time.monotonic() + 5).reset_counter)
    assert counts == [0, 1, 2, 2, 3]


def sway(at_s: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, Rotation]:
    """A vehicle that waits before a dock in waves: position (N, 3) and attitude by time."""
    phase = rng.uniform(0, math.tau, 6)
    waves = np.sin(np.outer(at_s, [0.5, 0.4, 0.7, 1.1, 0.9, 0.3]) + phase)
    place = np.array([-2.0, 0.0, 0.1]) + waves[:, :3] * [0.2, 0.2, 0.1]
    return place, Rotation.from_euler("ZYX", waves[:, [5, 4, 3]] * [8, 5, 8] + [0, -6, 6], degrees=True)


def yaw_errors_deg(made_for: str, seed: int) -> np.ndarray:
    """What a filter's yaw is off by in each tenth of a second of a minute; its own attitude goes into the messages."""
    rng, step_s = np.random.default_rng(seed), 0.01
    place, body = sway(np.arange(6002) * step_s, rng)
    gyro = (body[:-1].inv() * body[1:]).as_rotvec() / step_s
    force = body[1:-1].inv().apply(np.diff(place, 2, axis=0) / step_s**2 - GRAVITY)
    gyro_off, errors = np.radians(rng.uniform(0.2, 0.4, 3) * rng.choice([-1, 1], 3)), []
    yaw, pitch, roll = body[0].as_euler("ZYX")
    ekf = Ekf(place[0], (roll, pitch, yaw + math.radians(20) * rng.choice([-1, 1])), math.radians(20))
    with link(made_for=made_for) as (autopilot, _):
        for number in range(1, 6000):
            noise = rng.normal(0, [math.radians(0.1)] * 3 + [0.02] * 3)
            ekf.predict(gyro[number - 1] + gyro_off + noise[:3], force[number - 1] + noise[3:], step_s)
            if number % 10 == 0:
                turned = body[number].as_euler("ZYX", degrees=True)[::-1]
                noise = rng.normal(0, [0.004, 0.004, 0.01] + 3 * [SIGMA_RAD])
                pose = seen_from(place[number], turned, AHEAD, 5.0, noise[:3], noise[3:])
                autopilot._attitudes.append((number * step_s, *ekf.yaw_pitch_roll[:0:-1]))
                ekf.take(sent(autopilot, pose, number * step_s, number * step_s))
                errors.append(math.degrees(math.remainder(ekf.yaw_pitch_roll[0] - math.radians(turned[2]), math.tau)))
    return np.array(errors)


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_a_filter_finds_the_yaw_by_these_messages_and_never_by_those_of_any(seed):
    """Found is within half a degree for all of the last half minute."""
    assert np.abs(yaw_errors_deg("ardupilot", seed)[300:]).max() < 0.5
    by_any = np.abs(yaw_errors_deg("any", seed))
    assert not any((by_any[start:] < 0.5).all() for start in itertools.islice(range(len(by_any)), 0, 500))
