"""Sequences: a scene in which the vehicle moves: an approach, a sweep, hovering, or steered by an estimator."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_whole
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles
from dockpose.simulate.parts import Part, Pose
from dockpose.simulate.render import render
from dockpose.simulate.scene import Scene, Truth, dock_rotation, random_stream


class Motion(Part, frozen=True, kw_only=True, tag_field="kind"):
    """What all motions share.

    Parameters
    ----------
    frames, rate_hz : int and float, hertz
        Number of frames, and frames per second.
    drift_m, drift_deg : float, metres and degrees
        Standard deviations, over many sequences, of the drift and rotation by currents along and about each axis.
    drift_time_s : float, seconds
        Shortest period of the drift.

    Raises
    ------
    ValueError
        If a number is not finite or out of range.
    """

    frames: int = 100
    rate_hz: float = 10.0
    drift_m: float = 0.0
    drift_deg: float = 0.0
    drift_time_s: float = 4.0

    _above_0 = ("rate_hz", "drift_time_s")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole("frames", self.frames, least=1)


class Approach(Motion, frozen=True, kw_only=True, tag="approach"):
    """The distance ahead (z) falls evenly from ``start_m`` to ``end_m``; the dock keeps its place in the picture.

    Parameters
    ----------
    start_m, end_m : float, metres
        Distance in the first and the last frame, above 0.
    """

    start_m: float = 20.0
    end_m: float = 1.0

    _above_0 = (*Motion._above_0, "start_m", "end_m")


class Sweep(Motion, frozen=True, kw_only=True, tag="sweep"):
    """The dock passes at constant speed, from one side of its position in the scene to the other."""

    reach_m: float = 1.0  # how far it goes to either side
    angle_deg: float = 0.0  # direction in the picture, from the x axis towards y


class Hover(Motion, frozen=True, kw_only=True, tag="hover"):
    """The vehicle holds its position, apart from the currents."""

    drift_m: float = 0.03
    drift_deg: float = 2.0


class ClosedLoop(Motion, frozen=True, kw_only=True, tag="closed_loop"):
    """The vehicle moves onto the dock's axis as an estimator sees it, turns towards the dock, and closes in."""

    end_m: float = 1.0  # distance at which it stops
    speed_m_per_s: float = 0.3  # at most
    turn_deg_per_s: float = 20.0  # at most

    _above_0 = (*Motion._above_0, "end_m")


Observe = Callable[[np.ndarray, Camera], CirclePose | None]

_SEED_STEP = 1_000_003  # between the seeds of two frames, so that sequences of neighbouring seeds share no noise
_SWINGS = 6  # oscillations that add up to a smooth random drift
_RESPONSE_S = 1.0  # time in which the steered vehicle would correct an error if its speed allowed


class FilmPlan(msgspec.Struct, frozen=True, kw_only=True):
    """A scene and how the vehicle moves in it; without a motion it is a single picture.

    Parameters
    ----------
    scene : Scene
        What is there.
    motion : Approach, Sweep, Hover, ClosedLoop or None
        How the vehicle moves.
    """

    scene: Scene
    motion: Approach | Sweep | Hover | ClosedLoop | None = None

    @property
    def frames(self) -> int:
        """Number of frames."""
        return 1 if self.motion is None else self.motion.frames

    def with_frames(self, frames: int) -> "FilmPlan":
        """Return the same course in this many frames; a scene without a motion is repeated with different noise."""
        motion = self.motion or Hover(drift_m=0.0, drift_deg=0.0)
        return FilmPlan(scene=self.scene, motion=msgspec.structs.replace(motion, frames=frames))

    def with_seed(self, seed: int) -> "FilmPlan":
        """Return the same sequence with other random numbers."""
        return FilmPlan(scene=msgspec.structs.replace(self.scene, seed=seed), motion=self.motion)


@dataclass(frozen=True)
class RenderedFrame:
    """One frame of a sequence."""

    number: int  # from 1
    time_s: float  # since the first frame
    scene: Scene  # what it shows, with its own pose and seed
    image: np.ndarray  # (H, W) or (H, W, 3) BGR, uint8 or uint16
    truth: Truth
    observed: CirclePose | None = None  # what the estimator of a closed loop reported, if it found anything


def film(sequence: FilmPlan, observe: Observe | None = None) -> Iterator[RenderedFrame]:
    """Render a sequence, frame by frame.

    Parameters
    ----------
    sequence : FilmPlan
        What to render.
    observe : callable, optional
        Estimates the dock's pose from a picture and its camera, None where it finds none. It steers a closed loop, and
        is not needed otherwise.

    Yields
    ------
    RenderedFrame
        One frame after another: ``number``, from 1, ``time_s``, ``scene``, ``image`` and ``truth``, and what the
        estimator of a closed loop ``observed``.

    Raises
    ------
    ValueError
        If a closed loop has no estimator, or a pose on the way cannot be rendered (the dock behind the camera, a lamp
        farther away than the point spread function is valid).
    """
    if isinstance(sequence.motion, ClosedLoop):
        if observe is None:
            raise ValueError("observe is None; a closed loop needs an estimator to steer it")
        yield from _steered(sequence.scene, sequence.motion, observe)
        return
    for number, (time_s, scene) in enumerate(scenes(sequence), start=1):
        image, truth = render(scene)
        yield RenderedFrame(number, time_s, scene, image, truth)


def scenes(sequence: FilmPlan) -> Iterator[tuple[float, Scene]]:
    """Yield the time in seconds and the scene of each frame without rendering it; ValueError for a closed loop."""
    scene, motion = sequence.scene, sequence.motion
    if isinstance(motion, ClosedLoop):
        raise ValueError("motion is a closed loop: where it goes depends on its pictures")
    if motion is None:
        yield 0.0, scene
        return
    drift, rotation = _drift(scene, motion), dock_rotation(scene)
    for index in range(motion.frames):
        time_s = index / motion.rate_hz
        place = _place(motion, np.array(scene.pose.position_m), index / max(1, motion.frames - 1))
        position, turned = _carried(place, rotation, drift(time_s))
        yield time_s, _with_pose(scene, position, turned, index)


def _place(motion: Motion, position_m: np.ndarray, share: float) -> np.ndarray:
    """Position of the dock after this share (0 to 1) of a motion, given its position in the scene."""
    if isinstance(motion, Approach):
        return position_m * (motion.start_m + share * (motion.end_m - motion.start_m)) / position_m[2]
    if isinstance(motion, Sweep):
        angle = math.radians(motion.angle_deg)
        return position_m + (2 * share - 1) * motion.reach_m * np.array([math.cos(angle), math.sin(angle), 0])
    return position_m


def _steered(scene: Scene, motion: ClosedLoop, observe: Observe) -> Iterator[RenderedFrame]:
    drift = _drift(scene, motion)
    position, rotation = np.array(scene.pose.position_m), dock_rotation(scene)
    for index in range(motion.frames):
        time_s = index / motion.rate_hz
        now = _with_pose(scene, position, rotation, index)
        image, truth = render(now)
        observed = observe(image, now.camera)
        yield RenderedFrame(index + 1, time_s, now, image, truth, observed)
        if observed is not None:
            travel, turn = steer(observed, motion)
            position, rotation = turn.T @ (position - travel), turn.T @ rotation
        added = drift(time_s + 1 / motion.rate_hz) - drift(time_s)
        position, rotation = _carried(position, rotation, added)


def steer(observed: CirclePose, motion: ClosedLoop) -> tuple[np.ndarray, np.ndarray]:
    """The vehicle's travel (3,) in metres and turn (3, 3) until the next frame: onto the dock's axis, and closer."""
    period_s = 1 / motion.rate_hz
    share = min(1.0, period_s / _RESPONSE_S)
    distance = float(np.linalg.norm(observed.position_m))
    ahead = observed.position_m / distance
    onto_axis = observed.position_m + distance * observed.normal
    longest = motion.speed_m_per_s * period_s
    travel = share * onto_axis + np.clip(distance - motion.end_m, -longest, longest) * ahead
    travel *= min(1.0, longest / max(float(np.linalg.norm(travel)), 1e-12))
    axis = np.array([-ahead[1], ahead[0], 0.0])  # optical axis x direction to the dock
    sine = float(np.linalg.norm(axis))
    angle = min(share * math.atan2(sine, ahead[2]), math.radians(motion.turn_deg_per_s) * period_s)
    return travel, cv2.Rodrigues(axis * angle / max(sine, 1e-12))[0]


def _drift(scene: Scene, motion: Motion) -> Callable[[float], np.ndarray]:
    """Smooth random motion (6,) by currents, at any time: the dock's shift in metres and rotation vector in radians."""
    rng = random_stream(scene, "drift")
    size = np.array([motion.drift_m] * 3 + [math.radians(motion.drift_deg)] * 3) * math.sqrt(2 / _SWINGS)
    frequency_hz = rng.uniform(0.2, 1.0, (_SWINGS, 6)) / motion.drift_time_s
    phase = rng.uniform(0, 2 * math.pi, (_SWINGS, 6))
    return lambda time_s: size * np.cos(2 * math.pi * frequency_hz * time_s + phase).sum(axis=0)


def _carried(position_m: np.ndarray, rotation: np.ndarray, drift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and rotation of the dock in the camera frame after the currents moved the vehicle."""
    turn = cv2.Rodrigues(drift[3:])[0]
    return turn @ position_m + drift[:3], turn @ rotation


def _with_pose(scene: Scene, position_m: np.ndarray, rotation: np.ndarray, index: int) -> Scene:
    """The scene with another pose and another frame's noise; the first frame keeps the scene's own seed."""
    theta_x, theta_y = angles_of(-rotation[:, 2])
    roll = rotation_from_angles(theta_x, theta_y).T @ rotation
    pose = Pose(
        position_m=(float(position_m[0]), float(position_m[1]), float(position_m[2])),
        theta_x_deg=_degrees(theta_x),
        theta_y_deg=_degrees(theta_y),
        roll_deg=_degrees(math.atan2(roll[1, 0], roll[0, 0])),
    )
    return msgspec.structs.replace(scene, pose=pose, seed=scene.seed + index * _SEED_STEP)


def _degrees(angle_rad: float) -> float:
    """Degrees, rounded so that an angle that does not change is written as it was given."""
    return round(math.degrees(angle_rad), 9)
