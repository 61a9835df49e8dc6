"""The choice between the two poses of a dock: by which light each point is on each, from spacing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.chance import LEAST_PX
from dockpose.pose.circle import CirclePose, angles_of
from dockpose.pose.placement import Placement, place
from dockpose.pose.refine import Fit, LightRays, angles_on_planes, light_rays, refine, squares_at, weigh
from dockpose.pose.shared import SharedErrors
from dockpose.pose.uncertainty import PoseErrors, deviations, log_odds, nearer, noise_px

DECIDED = 0.95  # the choice counts as decided from this probability on
SAME_RAD = math.radians(0.2)  # poses whose normals differ by less than this are the same
_SLID = 0.25  # if refinement shrinks the angle between two poses to this share, they have become the same
# Lights that a hand spaced by eye are off along the rim: more than noise does to a centre, and more than across it by
# what chance hardly does (Fisher's F).
_PLACED_PX, _LEAST_PX, _NO_SLIDE = 0.5, 0.05, 1e-3

_SURE, _IN_ONE_TURN = 0.95, 1e-9  # probability from which the roll counts as known; rounding of a full turn


@dataclass(frozen=True)
class Choice:
    """The two candidates, the likelier first, and what decided between them.

    Attributes
    ----------
    candidates : tuple of CirclePose
        The two poses with their probabilities, reprojection errors and uncertainties.
    selected : int
        Index of the chosen one.
    selected_by : {"spacing", "extra", "none"}
        What decided; "none" where nothing tells them apart.
    lights : (N,) int array or None
        Number of the light that each point is, counted around the ring; None where it is not known.
    coincide : bool
        Whether the dock is so nearly square on that both poses are the same within their errors.
    number : int or None
        How many lights the dock has, by their spacing, where it was not told; None where it was, or stays unknown.
    focal_px : float or None
        The focal length that the lights' spacing fits, where it is not the camera's.
    lights_by : tuple of (N,) int array
        ``lights`` by each of the candidates; empty where they are not known.
    extra_px : (E, 2) float array or None
        Where the dock's extra lights are seen by the chosen pose, in pixels, NaN of those that are not; None of a dock
        without.
    """

    candidates: tuple[CirclePose, ...]
    selected: int
    selected_by: str
    lights: np.ndarray | None
    coincide: bool = False
    number: int | None = None
    focal_px: float | None = None
    lights_by: tuple[np.ndarray, ...] = ()
    extra_px: np.ndarray | None = None

    def with_first(self, probability: float) -> "Choice":
        """The same two poses where the first has another probability, of at least a half."""
        first, second = self.candidates
        pair = replace(first, probability=probability), replace(second, probability=1 - probability)
        return replace(self, candidates=pair)

    @property
    def decided(self) -> bool:
        """Whether the chosen pose is right with a probability of at least 95 %."""
        probability = self.candidates[self.selected].probability
        return probability is not None and probability >= DECIDED


def choose_by_spacing(
    poses: Sequence[CirclePose],
    points_px: np.ndarray,
    camera: Camera,
    dock: Dock,
    covariances_px2: np.ndarray | None = None,
) -> Choice | None:
    """Refine both candidates, and choose the one on which lights at points (N, 2) are spaced as they should be.

    None where they are spaced so on neither.
    """
    rays = light_rays(points_px, camera, float(poses[0].position_m[2]))
    R, t = np.array([pose.rotation for pose in poses]), np.array([pose.position_m for pose in poses])
    placement = place(angles_on_planes(rays, R, t), dock)
    if not any(placement.fits):
        return None
    fit = refine(R, t, placement.angles_rad, dock.radius, rays)
    if dock.offsets_m:
        fit, placement = refine_with_offsets(fit.rotations, fit.positions_m, placement, dock, rays)
    least_px = 0.0
    if covariances_px2 is not None and np.isfinite(covariances_px2).all():
        best = int(np.argmin(fit.squares_px2))
        offsets = offsets_of(dock, placement.lights, placement.rolls_rad) if dock.offsets_m else None
        weighed, least_px = weigh(rays, covariances_px2, fit, best, placement.angles_rad[best], dock.radius, offsets)
        if weighed is not rays:
            rays = weighed
            fit = refine(fit.rotations, fit.positions_m, placement.angles_rad, dock.radius, rays, offsets)
    (fit, squares), fits, numbers = _apart(fit, R, t, placement, dock, rays), np.array(placement.fits), fit.numbers
    squares = np.where(fits, squares, np.maximum(squares, squares[fits].min())).tolist()
    if not dock.offsets_m and min(squares) > fit.points * _PLACED_PX**2:
        slid = _slid(fit, placement, dock, rays)
        # How far lights are off across the rim tells nothing then, nor does one number along it, the roll.
        numbers = numbers if slid is fit else fit.points + 5
        fit, _ = _apart(slid, R, t, placement, dock, rays)
    floor_px = max(least_px, LEAST_PX) if least_px else 0.0
    first = 1 / (1 + math.exp(-log_odds(squares[0], squares[1], numbers, floor_px)))
    return choice_of(fit, [first, 1 - first], placement, "spacing", camera, dock, rays, least_px)


def choose_by_side(
    poses: Sequence[CirclePose], points_px: np.ndarray, camera: Camera, dock: Dock, first: float = 0.5
) -> Choice:
    """Refine both candidates by lights (N, 2) anywhere on the circle, where the first has a known probability."""
    rays = light_rays(points_px, camera, float(poses[0].position_m[2]))
    R, t = np.array([pose.rotation for pose in poses]), np.array([pose.position_m for pose in poses])
    fit = refine(R, t, None, dock.radius, rays)
    return choice_of(fit, [first, 1 - first], None, "none" if first == 0.5 else "spacing", camera, dock, rays)


def _apart(
    fit: Fit, R: np.ndarray, t: np.ndarray, placement: Placement, dock: Dock, rays: LightRays
) -> tuple[Fit, np.ndarray]:
    """If refinement brought both to the same pose, that which moved farther is put back; squares of both to compare."""
    before, after = [_angle_rad(each[0, :, 2], each[1, :, 2]) for each in (R, fit.rotations)]
    if before < SAME_RAD or after > _SLID * before:
        return fit, fit.squares_px2
    back = np.arange(len(R)) == np.argmax([_angle_rad(R[k, :, 2], fit.rotations[k, :, 2]) for k in range(len(R))])
    moves = offsets_of(dock, placement.lights, placement.rolls_rad) if dock.offsets_m else [None] * len(R)
    starts = zip(R, t, placement.angles_rad, moves, strict=True)
    own = np.array([squares_at(turn, at, angles, dock.radius, rays, off) for turn, at, angles, off in starts])
    rotations, positions = np.where(back[:, None, None], R, fit.rotations), np.where(back[:, None], t, fit.positions_m)
    squares = np.where(back, own, fit.squares_px2)  # one that is refined is not compared with one that is not
    return Fit(rotations, positions, squares, fit.covariances, fit.numbers, fit.points), own


def _slid(fit: Fit, placement: Placement, dock: Dock, rays: LightRays) -> Fit:
    """The poses of lights that may slide along the rim, where they lie far more exactly on it than in their places."""
    count, spare, best = fit.points, fit.points - 5, int(np.argmin(fit.squares_px2))
    least = float(fit.squares_px2[best])
    if spare < 1:
        return fit
    from scipy.special import fdtrc  # takes a third of a second to import, which few pictures need

    free = refine(fit.rotations, fit.positions_m, None, dock.radius, rays)
    across = max(float(free.squares_px2[best]), count * _LEAST_PX**2) / spare
    along = (least - float(free.squares_px2[best])) / (count - 1)
    if fdtrc(count - 1, spare, max(0.0, along) / across) > _NO_SLIDE:
        return fit
    noises = noise_px(across * spare, count, 5), noise_px(least, fit.numbers, 6)
    covariances = free.covariances * (noises[0] / noises[1]) ** 2
    covariances[:, 5, 5] = fit.covariances[:, 5, 5]  # the roll is known by the places alone
    # How far lights are off their places is told by the pose that brings them nearest.
    return Fit(free.rotations, free.positions_m, fit.squares_px2, covariances, fit.numbers, count)


def choice_of(
    fit: Fit,
    probabilities: Sequence[float],
    placement: Placement | None,
    by: str,
    camera: Camera,
    dock: Dock,
    rays: LightRays,
    least_px: float = 0.0,
) -> Choice:
    """Choice among refined poses, the likelier first, with their uncertainties; a noise is the least."""
    noise = max(least_px, noise_px(float(fit.squares_px2.min()), fit.numbers, 5 if placement is None else 6))
    rings = zip(fit.positions_m, fit.covariances, fit.rotations, strict=True)
    docks = [_of_dock(*ring, dock.lamp_depth_m) for ring in rings]
    sigmas = [deviations(covariance, R, noise) for (_, covariance), R in zip(docks, fit.rotations, strict=True)]
    if placement is not None and len(probabilities) == 2:
        (x0, y0), (x1, y1) = [angles_of(-rotation[:, 2]) for rotation in fit.rotations]
        probabilities = nearer(probabilities, (x0 - x1, y0 - y1), (sigmas[0][1], sigmas[1][1]))
    order = sorted(range(len(probabilities)), key=lambda k: -probabilities[k])
    candidates = []
    for k in order:
        rotation, (position, covariance) = fit.rotations[k], docks[k]
        roll = None
        if placement is not None:
            roll = (float(placement.rolls_rad[k]) + _roll_rad(rotation)) % placement.period_rad
        candidates.append(
            CirclePose.at(
                position,
                -rotation[:, 2],
                camera,
                probability=probabilities[k],
                rms_px=math.sqrt(float(fit.squares_px2[k]) / fit.points),
                roll_rad=roll,
                sigma_position_m=sigmas[k][0],
                sigma_theta_rad=sigmas[k][1],
                errors=PoseErrors(covariance, rotation, noise, SharedErrors(camera, dock, position, rays)),
            )
        )
    lights_by = () if placement is None else tuple(placement.lights[k] for k in order)
    lights = lights_by[0] if lights_by else None
    return Choice(tuple(candidates), 0, by, lights, is_square_on(candidates[0]), lights_by=lights_by)


def _of_dock(
    ring_m: np.ndarray, covariance: np.ndarray, rotation: np.ndarray, lamp_depth_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """The dock's centre and the covariance (6, 6) of its pose, of a ring of lights so far behind it."""
    if lamp_depth_m == 0:
        return ring_m, covariance
    moved = np.eye(6)  # a turn of the ring about its own centre moves the dock's
    moved[:3, 3:] = lamp_depth_m * rotation @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return ring_m - lamp_depth_m * rotation[:, 2], moved @ covariance @ moved.T


def is_square_on(pose: CirclePose) -> bool:
    """Whether a pose and its twin, mirrored about the line of sight, are the same within the pose's errors."""
    towards = pose.position_m / -math.hypot(*pose.position_m.tolist())
    off = _angle_rad(pose.normal, towards)
    return 2 * off < max((SAME_RAD, *(1.96 * sigma for sigma in pose.sigma_theta_rad or ())))


def _angle_rad(one: np.ndarray, other: np.ndarray) -> float:
    return 2 * math.asin(min(1.0, math.dist(one.tolist(), other.tolist()) / 2))


def _roll_rad(rotation: np.ndarray) -> float:
    """Angle by which a dock with this rotation is turned in its own plane."""
    # Compare the dock's x and y axes with the x axis of a dock without roll, which is level: (z, 0, -x) of its third.
    x, z = float(rotation[0, 2]), float(rotation[2, 2])
    along = float(rotation[0, 0]) * z - float(rotation[2, 0]) * x
    across = float(rotation[0, 1]) * z - float(rotation[2, 1]) * x
    return math.atan2(-across, along)


def offsets_of(dock: Dock, lights: np.ndarray, rolls_rad: np.ndarray) -> np.ndarray:
    """Offsets (..., N, 3) in metres of lights (..., N) of a dock, in the frame in which it has these rolls (...)."""
    x, y, z = np.moveaxis(np.array(dock.offsets_m)[lights], -1, 0)
    c, s = np.cos(rolls_rad)[..., None], np.sin(rolls_rad)[..., None]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def refine_with_offsets(
    rotations: np.ndarray, positions_m: np.ndarray, placement: Placement, dock: Dock, rays: LightRays
) -> tuple[Fit, Placement]:
    """Refine K poses by the lights' offsets, and find the roll by them; on an even ring the best of all turns."""
    count = dock.lights or placement.lights.shape[1]
    turns = np.arange(count if placement.period_rad < 2 * math.pi - _IN_ONE_TURN else 1)
    lights = (placement.lights[:, None] + turns[:, None]) % count
    rolls = placement.rolls_rad[:, None] - turns * 2 * math.pi / count
    # All turns of all candidates at once: (candidates, turns, ...), flattened.
    tried = refine(
        np.repeat(rotations, len(turns), axis=0),
        np.repeat(positions_m, len(turns), axis=0),
        np.repeat(placement.angles_rad, len(turns), axis=0),
        dock.radius,
        rays,
        offsets_of(dock, lights, rolls).reshape(-1, lights.shape[-1], 3),
    )
    squares = tried.squares_px2.reshape(rolls.shape)
    candidates = np.arange(len(rolls))
    best = np.argmin(squares, axis=1)
    fit = tried.taken(candidates * len(turns) + best)
    least, *others = np.sort(squares[int(np.argmin(squares.min(axis=1)))]).tolist()
    is_sure = 1 / (1 + sum(math.exp(-log_odds(least, other, fit.numbers)) for other in others)) >= _SURE
    period = 2 * math.pi if is_sure else placement.period_rad
    known = Placement(lights[candidates, best], rolls[candidates, best], placement.angles_rad, placement.fits, period)
    return fit, known
