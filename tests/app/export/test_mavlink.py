"""What comes out of the link, read by pymavlink in another process."""

import contextlib
import itertools
import math
import time
from dataclasses import replace

import numpy as np
import pytest
from dockpose import estimate
from dockpose.app.errors import UserError
from dockpose.app.export.mavlink import Autopilot, why_not
from dockpose.app.export.vehicle import AHEAD, vehicle_covariance
from dockpose.app.state.trust import Trust, trust_of
from dockpose.pose.circle import CirclePose
from dockpose.simulate import render
from dockpose.sources import Frame
from dockpose.tracking.tracker import Track, Tracked
from scipy.spatial.transform import Rotation

from tests.support.mavlink import receiving
from tests.support.scenes import CAMERA, DOCK, random_scene

pytestmark = pytest.mark.extra
GREEN = Trust("green", "Dock found")
NUMBERS = itertools.count()


def at(x: float, y: float, z: float, theta_x_deg: float, theta_y_deg: float) -> Tracked:
    """The estimate of a picture, with the pose that is true in place of the one that was found."""
    scene = random_scene(4)
    found = estimate(render(scene)[0], scene.camera, scene.dock)
    assert found.choice is not None
    assert found.selected is not None
    normal = Rotation.from_euler("YX", [theta_y_deg, theta_x_deg], degrees=True).apply([0, 0, -1.0])
    true = CirclePose.at(np.array([x, y, z]), normal, CAMERA, probability=0.96, errors=found.selected.errors)
    choice = replace(found.choice, candidates=(true, true), selected=0)
    return Tracked(replace(found, choice=choice, detection=0.9), Track(0.97, 5, predicted=False, lost=False), chain=0)


@pytest.fixture(scope="module")
def seen() -> Tracked:
    return at(0.2, -0.1, 1.5, 12.0, -25.0)


def frame(ago_s: float = 0.0, unix_s: float = 1_800_000_000.25) -> Frame:
    now_s = time.monotonic() - ago_s
    return Frame(np.zeros((2, 2), np.uint8), next(NUMBERS), 0.0, "rtp", time_unix_s=unix_s, monotonic_s=now_s)


@pytest.fixture
def received():
    with receiving() as received:
        yield received


@contextlib.contextmanager
def linked(received, send, **more):
    with contextlib.closing(Autopilot(received.address, send, **more)) as autopilot:
        yield autopilot


def float32(values) -> list[float]:
    return np.asarray(values, np.float32).tolist()


def test_each_field_of_an_estimate(received, seen):
    """By hand: the dock is 1.5 m ahead, 0.2 m right, 0.1 m up, its face turned by -25 and 12 degrees."""
    with linked(received, "estimate") as autopilot:
        autopilot.see(frame(), seen.estimate, seen, GREEN)
        message = received.next("VISION_POSITION_ESTIMATE")
    assert (message["system"], message["component"]) == (1, 197)
    assert message["usec"] == 1_800_000_000_250_000
    camera_dock = Rotation.from_euler("YX", [-25, 12], degrees=True)
    right, down, ahead = -camera_dock.inv().apply([0.2, -0.1, 1.5])
    assert [message["x"], message["y"], message["z"]] == pytest.approx([ahead, right, down], rel=1e-6)
    # The camera's axes in the dock's, both right, down, ahead: angles about ahead, right, down, the last one first.
    yaw, pitch, roll = camera_dock.inv().as_euler("YXZ")
    assert [message["roll"], message["pitch"], message["yaw"]] == pytest.approx([roll, pitch, yaw], abs=1e-6)
    pose = seen.estimate.selected
    assert pose is not None
    wanted = vehicle_covariance(pose, AHEAD)
    assert message["covariance"] == float32([wanted[row, column] for row in range(6) for column in range(row, 6)])
    assert message["covariance"][0] > 0
    assert message["reset_counter"] == 1


def test_each_field_of_a_delta(received, seen):
    """Half a metre nearer within a tenth of a second, square on both times."""
    first, second = at(0, 0, 2, 0, 0), at(0, 0, 1.5, 0, 0)
    with linked(received, "delta") as autopilot:
        autopilot.see(frame(unix_s=100.0), first.estimate, first, GREEN)
        later = replace(second, track=replace(second.track, age=6))
        autopilot.see(frame(unix_s=100.1), later.estimate, later, GREEN)
        message = received.next("VISION_POSITION_DELTA")
    assert (message["time_usec"], message["time_delta_usec"]) == (100_100_000, 100_000)
    assert message["angle_delta"] == pytest.approx([0, 0, 0], abs=1e-7)
    assert message["position_delta"] == pytest.approx([0.5, 0, 0], abs=1e-7)
    assert message["confidence"] == np.float32(100 * 0.9 * 0.97)


def test_each_field_of_a_target(received, seen):
    with linked(received, "target") as autopilot:
        autopilot.see(frame(), seen.estimate, seen, GREEN)
        message = received.next("LANDING_TARGET")
    range_m = math.hypot(0.2, 0.1, 1.5)
    assert message["time_usec"] == 1_800_000_000_250_000
    assert (message["target_num"], message["frame"], message["type"], message["position_valid"]) == (0, 12, 0, 1)
    assert [message["x"], message["y"], message["z"]] == float32([1.5, 0.2, -0.1])
    assert message["angle_x"] == np.float32(math.atan2(0.2, 1.5))
    assert message["angle_y"] == np.float32(math.atan2(-0.1, 1.5))
    assert message["distance"] == np.float32(range_m)
    assert message["size_x"] == message["size_y"] == np.float32(2 * math.atan2(DOCK.diameter / 2, range_m))
    x, y, z, w = Rotation.from_euler("YX", [-25, 12], degrees=True).as_quat()  # about right, down, ahead
    assert message["q"] == pytest.approx([w, z, x, y], abs=1e-7)


def test_a_heartbeat_comes_each_second_and_the_time_is_told(received):
    before_ns = time.time_ns()
    with linked(received, "estimate", ids="7:191"):
        first = received.next("HEARTBEAT")
        told = received.next("TIMESYNC")
        second = received.next("HEARTBEAT")
    assert (first["system"], first["component"]) == (second["system"], second["component"]) == (7, 191)
    assert (first["type"], first["autopilot"], first["system_status"], first["base_mode"]) == (18, 8, 4, 0)
    assert told["ts1"] == 1234567890
    assert before_ns <= told["tc1"] <= time.time_ns()


LOST, PREDICTED = Track(), Track(0.9, 5, predicted=True, lost=False)


@pytest.mark.parametrize(
    ("ago_s", "track", "trust", "refusal"),
    [
        (0.6, None, GREEN, None),
        (math.nan, None, GREEN, None),
        (0.0, LOST, GREEN, None),
        (0.0, PREDICTED, GREEN, None),
        (0.0, None, Trust("red", "Dock seen, but do not rely on it"), None),
        (0.0, None, GREEN, "the camera is assumed"),
    ],
    ids=["old", "of no time", "lost", "predicted", "red", "refused"],
)
def test_nothing_is_sent_that_is_not_to_be_relied_on(received, seen, ago_s, track, trust, refusal):
    with linked(received, "estimate,delta,target") as autopilot:
        tracked = seen if track is None else replace(seen, track=track)
        for _ in range(3):
            autopilot.see(frame(ago_s), seen.estimate, tracked, trust, refusal)
        assert (autopilot.sent, autopilot.refused) == (0, 3)
        assert autopilot.words.startswith("nothing: ")
        autopilot.see(frame(unix_s=7.0), seen.estimate, seen, GREEN)
        first = received.next("VISION_POSITION_ESTIMATE", "VISION_POSITION_DELTA", "LANDING_TARGET")
        assert first["usec"] == 7_000_000


def test_amber_is_sent_and_switched_off_nothing_is(received, seen):
    with linked(received, "estimate") as autopilot:
        autopilot.is_on = False
        autopilot.see(frame(unix_s=5.0), seen.estimate, seen, GREEN)
        autopilot.is_on = True
        straight = at(0.2, -0.1, 1.5, 0, 0)
        autopilot.see(frame(unix_s=6.0), straight.estimate, straight, Trust("amber", "Dock found, but check it"))
        assert received.next("VISION_POSITION_ESTIMATE")["usec"] == 6_000_000
        assert autopilot.words.endswith(": 1.50 m before the dock, 0.20 m left, 0.10 m below")


def test_a_picture_without_a_dock_is_not_sent():
    found = estimate(np.zeros((480, 640), np.uint8), CAMERA, DOCK)
    tracked = Tracked(found, Track(0.9, 3, predicted=False, lost=False))
    assert why_not(found, tracked, trust_of(found), 0.0, 0.5) == "no dock is seen"


def test_a_frame_is_sent_once_and_one_of_a_recording_never(received, seen):
    with linked(received, "estimate") as autopilot:
        once = frame()
        autopilot.see(once, seen.estimate, seen, GREEN)
        autopilot.see(once, seen.estimate, seen, GREEN)
        autopilot.see(replace(frame(), monotonic_s=None), seen.estimate, seen, GREEN)
        autopilot.see(replace(frame(), time_unix_s=None), seen.estimate, seen, GREEN)
        assert (autopilot.sent, autopilot.refused) == (1, 0)


def test_after_a_gap_no_way_is_sent_and_another_track_is_a_reset(received, seen):
    def of_age(age: int, chain: int = 0) -> Tracked:
        return replace(seen, track=replace(seen.track, age=age), chain=chain)

    with linked(received, "estimate,delta") as autopilot:
        for number, tracked in enumerate(
            [of_age(1), of_age(2), of_age(3, 1), of_age(4, 1), of_age(1, 1), of_age(2, 1)]
        ):
            autopilot.see(frame(unix_s=float(number)), seen.estimate, tracked, GREEN)
        autopilot.see(frame(ago_s=5, unix_s=6.0), seen.estimate, of_age(3, 1), GREEN)
        autopilot.see(frame(unix_s=7.0), seen.estimate, of_age(4, 1), GREEN)
        autopilot.see(frame(unix_s=8.0), seen.estimate, of_age(5, 1), GREEN)
        found = []
        while len(found) < 12:
            message = received.next("VISION_POSITION_ESTIMATE", "VISION_POSITION_DELTA")
            found.append((message.get("usec", message.get("time_usec")) / 1e6, message.get("reset_counter")))
    estimates = [(at_s, resets) for at_s, resets in found if resets is not None]
    assert estimates == [(0, 1), (1, 1), (2, 2), (3, 2), (4, 3), (5, 3), (7, 3), (8, 3)]
    assert [at_s for at_s, resets in found if resets is None] == [1, 3, 5, 8]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"address": "127.0.0.1:14550"}, "write it as udpout:"),
        ({"address": "udpout:127.0.0.1"}, "write it as udpout:"),
        ({"address": "udpout:127.0.0.1:99999"}, "write it as udpout:"),
        ({"send": "pose"}, "may be estimate, delta, target"),
        ({"ids": "0:197"}, "must be system and component"),
        ({"ids": "1"}, "must be system and component"),
        ({"most_age_s": 0.0}, "must be above 0 seconds"),
        ({"most_age_s": math.nan}, "must be above 0 seconds"),
    ],
)
def test_what_cannot_be_is_told(options, why):
    with pytest.raises(UserError, match=why):
        Autopilot(**({"address": "udpout:127.0.0.1:14550"} | options))


@pytest.mark.filterwarnings(
    "ignore:Exception ignored in. <socket"
)  # pymavlink leaves a socket open that it cannot bind
def test_an_address_that_is_not_ours_is_told():
    with pytest.raises(UserError, match=r"udpin:192\.0\.2\.1:14550: cannot be opened"):
        Autopilot("udpin:192.0.2.1:14550")


def test_garbage_from_elsewhere_is_passed_over(received, seen):
    autopilot = Autopilot(received.address)
    autopilot._answer(b"\xfd garbage" * 40)
    autopilot._answer(bytes(range(256)))
    autopilot.see(frame(), seen.estimate, seen, GREEN)
    assert received.next("VISION_POSITION_ESTIMATE")
    autopilot.close()
