"""Table 1 of the paper in closed loop: which of two poses a vehicle ends on that squares up to what it chooses."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.paper.scenes import CAMERA, DIAMETER_M
from dockpose.pose.circle import CirclePose
from dockpose.simulate import ClosedLoop, FilmPlan, Lights, RenderedFrame, Scene, Sensor, film
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background
from dockpose.simulate.sequence import steer
from dockpose.study.draw import tilted_pose, unit
from dockpose.study.judge import is_right
from dockpose.tracking import Tracker

DOCK = Dock(DIAMETER_M, 10)
RULES = ("literal", "eccentricity", "tracker", "frame")
RANGE_M, TILT_DEG = (1.5, 6.0), (5.0, 35.0)
# A step is at most a tenth of the first range, so that ten of them lead onto the axis from anywhere.
FRAMES, RATE_HZ, SPEED_PER_S = 10, 2.0, 0.2
DRIFT_M, DRIFT_DEG = 0.01, 0.5
SQUARE_ON_DEG = 5.0


class Course(NamedTuple):
    """One approach, steered by one rule."""

    range_m: float  # of the dock in the first frame
    right: np.ndarray  # (frames,): whether the chosen pose is the true one
    off_axis_deg: np.ndarray  # (frames,): angle between the dock's normal and the line of sight, 0 if square on


def draw_approach(seed: int, number: int) -> tuple[Scene, ClosedLoop]:
    """The start of one approach: a dock up to 5 degrees off the camera's axis, in clear to coastal water."""
    rng = np.random.default_rng([seed, 1, number])
    range_m = rng.uniform(*RANGE_M)
    sight = unit(np.array([*np.tan(np.radians(rng.uniform(-5, 5, 2))), 1.0]))
    around, tilt = rng.uniform(0, 2 * math.pi), math.radians(rng.uniform(*TILT_DEG))
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=tilted_pose(range_m * sight, tilt, around + math.pi, rng.uniform(0, 360)),
        lights=Lights(level=1000.0, brightness=tuple(rng.uniform(0.6, 1.0, 10).tolist())),
        water=water_of_turbidity(rng.uniform(0, 0.6)),
        background=Background(level=rng.uniform(0, 30)),
        sensor=Sensor(read_noise_levels=rng.uniform(0.5, 2)),
        seed=int(rng.integers(1 << 30)),
    )
    speed = SPEED_PER_S * range_m
    drift: dict[str, float] = {"drift_m": DRIFT_M, "drift_deg": DRIFT_DEG}
    return scene, ClosedLoop(frames=FRAMES, rate_hz=RATE_HZ, speed_m_per_s=speed, **drift)


def run_approach(seed: int, number: int, rule: str) -> Course:
    """Steer one approach by one of ``RULES``: Table 1 by the letter or as we read it, the tracker, each picture."""
    scene, motion = draw_approach(seed, number)
    # Table 1 begins with either candidate, by a coin that both readings share.
    first = int(np.random.default_rng([seed, 2, number]).integers(2))
    tracker, state, command = Tracker(CAMERA, DOCK), None, None
    estimates: list[Estimate] = []

    def observe(image: np.ndarray, camera: Camera) -> CirclePose | None:
        """The pose that the vehicle steers by."""
        nonlocal state, command
        found = estimate(image, camera, DOCK)
        estimates.append(found)
        if rule == "frame":
            return found.selected
        if rule == "tracker":  # which knows how the vehicle was to move since the previous frame
            tracked = tracker.follow(found, (len(estimates) - 1) / RATE_HZ, command)
            command = None if tracked.pose is None else steer(tracked.pose, motion)
            return tracked.pose
        if found.ellipse is None or len(found.candidates) < 2:
            return None
        seen = found.candidates, found.ellipse.eccentricity
        state = choose_by_table(*seen, state, first, literal=rule == "literal")
        return found.candidates[state.selected]

    frames: list[RenderedFrame] = []
    try:
        for frame in film(FilmPlan(scene=scene, motion=motion), observe):
            frames.append(frame)
    except ValueError:
        if not frames:
            raise
        # A vehicle that went astray has passed the dock, which is now behind the camera: it has no more frames.
    rest = FRAMES - len(frames)
    right = [is_right(frame.observed, frame.truth) for frame in frames]
    truths = [frame.truth for frame in frames]
    cosines = [-float(truth.normal @ unit(truth.position_m)) for truth in truths]
    off_deg = [math.degrees(math.acos(max(-1.0, min(1.0, one)))) for one in cosines + cosines[-1:] * rest]
    range_m = float(np.linalg.norm(truths[0].position_m))
    return Course(range_m, np.array(right + [False] * rest), np.array(off_deg))


class Orientation(NamedTuple):
    """What Table 1 remembers of a frame: its choice, with the normals (3,) of both candidates."""

    selected: int  # index of the chosen candidate
    normal: np.ndarray
    other_normal: np.ndarray
    eccentricity: float  # of the ring's image
    frame: int  # counted from 1


def choose_by_table(
    candidates: Sequence[CirclePose],
    eccentricity: float,
    before: Orientation | None = None,
    first: int = 0,
    *,
    literal: bool = False,
) -> Orientation:
    """Choose one of two candidates as Table 1 of the paper does, or, unless by the letter, by whole normals."""
    # By the letter theta_x alone counts, against the frame before: if e1 < e2, in the second frame, against that of the
    # other solution of the first, else against that of the one which was squared up to.
    selected, last = first, len(candidates) - 1
    if before is not None and literal:
        normal = before.other_normal if before.frame == 1 and before.eccentricity < eccentricity else before.normal
        theta_x = math.asin(max(-1.0, min(1.0, float(normal[1]))))
        selected = min(range(last + 1), key=lambda k: abs(candidates[k].theta_x_rad - theta_x))
    elif before is not None:
        selected = max(range(last + 1), key=lambda k: float(candidates[k].normal @ before.normal))
        if before.frame == 1 and not before.eccentricity - eccentricity > 0:
            selected = last - selected
    frame = 1 if before is None else before.frame + 1
    return Orientation(selected, candidates[selected].normal, candidates[last - selected].normal, eccentricity, frame)
