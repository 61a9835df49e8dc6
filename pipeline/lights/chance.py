"""How many rings chance alone would make, by which a ring is accepted (Desolneux, Moisan and Morel 2000)."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from dockpose.lights.polygon import FIRST_POINTS, Polygon

# Expected number of chance rings below which a ring is one: where it is all that there is, and where it is picked out
# from among others, at two thresholds and from the brightest points first.
ACCEPTED, ACCEPTED_AMONG_OTHERS = 1e-2, 1e-3
# Of inexact lights clutter, which is not strewn evenly, makes more rings than chance.
# What is farther off than hands place lamps, as a share of the radius, root mean square, is a dock's only where nothing
# else is in view.
_ACCEPTED_INEXACT, _BUILT_WITHIN = 1e-4, 0.065
_SIZES = 6.0  # octaves of radius that are searched
_BRIGHTNESSES = 8.0  # octaves of brightness down to the dimmest light, each another set of points
LEAST_CROWD, _MORE_OF_CROWDS = 5, 10.0  # a crowd may make ten times as many rings: not every picture shows one
# Lamps on a cable are not strewn: the second is within so many steps of the first, and each further one within so many
# of where the last two point; one of twenty is out. A ring with such a share of its lights, or along such a share of
# it, is no cable, and ten thousand docks are seen for each cable that would pass for a part of one.
_NEAR_STEPS, _NEXT_STEPS, _LARGEST_GAP, _OUT, CLOSED, _FEWER_CABLES = 3.0, 0.25, 2, 0.05, 0.75, 1e4
_KINDS_OF_ERRORS = 2.0  # alike both ways, or not
_THRESHOLDS = 2  # that a picture is searched with
LEAST_PX = 0.05  # no centre is known better, root mean square per coordinate
_NUMBERS_OF_WHOLE = 2  # ways in which a number may be unknown: that of the lights in view, or another
MOST_LIGHTS = 64  # that a dock is expected to have
NUMBERS = range(4, 25)  # of lights that are tried by their corners where it is not known


@dataclass(frozen=True)
class Neighbours:
    """Points near a ring that are not on it."""

    around: int  # how many are within twice its larger radius
    beside: int  # how many are within an ellipse of twice its size and its shape, as letters beside a narrow one are


NONE_NEAR = Neighbours(0, 0)


@dataclass(frozen=True)
class Candidate:
    """A polygon that is more than chance, and how much more."""

    polygon: Polygon
    sides: int
    log_chance: float

    @property
    def members(self) -> frozenset[int]:
        """Numbers of the points on it."""
        return frozenset(self.polygon.members.tolist())


@dataclass(frozen=True)
class Scene:
    """What rings are sought among."""

    points_px: np.ndarray  # (N, 2): the groups' centres, from the principal point
    brightness: np.ndarray  # (N,): of each
    area_px2: float  # of the picture
    focal_px: float  # of the picture
    even: bool  # whether the dock's lights are evenly spaced
    numbers: int  # how many numbers of lights are tried


def neighbours(
    points_px: np.ndarray,
    brightness: np.ndarray,
    members: np.ndarray,
    centre_px: tuple[float, float],
    radius_px: float,
) -> tuple[Neighbours, Neighbours]:
    """Count the points (M, 2) near a ring that are not on it: all, and those as bright as its dimmest member."""
    if len(members) == len(points_px):
        return NONE_NEAR, NONE_NEAR
    off = points_px - centre_px
    around = (off * off).sum(axis=1) < (2 * radius_px) ** 2
    # The covariance of points around an ellipse has half its squared semi-axes.
    spread = np.cov(points_px[members].T, bias=True) + 1e-9 * np.eye(2)
    moved = points_px - points_px[members].mean(axis=0)
    beside = (moved @ np.linalg.inv(spread) * moved).sum(axis=1) < 8
    around[members] = beside[members] = False
    bright = brightness >= brightness[members].min()
    return (
        Neighbours(int(around.sum()), int(beside.sum())),
        Neighbours(int((around & bright).sum()), int((beside & bright).sum())),
    )


def accepted(
    polygon: Polygon, sides: int, scene: Scene, *, may_hang: bool = True, is_exact: bool = True
) -> Candidate | None:
    """Return a polygon as a candidate; None where chance, or lamps on a cable if they may, have made it.

    One that is not exact may have lights off their places along the rim more than across it. Of an unknown number it
    must be nearly closed, for inexact lights fit many numbers; and picked out from others it must be surer.
    """
    members = polygon.members
    chance_among = partial(
        log_chance_rings,
        len(members),
        sides,
        even=scene.even,
        squares_px2=polygon.squares_px2,
        semi_axes_px=polygon.semi_axes_px,
        area_px2=scene.area_px2,
        apart_px2=None if is_exact else _squares_of_px2(polygon, scene.points_px),
    )
    # Where a ring of which no light is missing is all that there is, its number is not one of many.
    is_all = LEAST_CROWD <= len(members) == sides == len(scene.points_px)
    numbers = min(scene.numbers, _NUMBERS_OF_WHOLE) if is_all else scene.numbers
    # Four lights are picked out from among others, unless there is but one other: that makes so few fours.
    at_once = len(scene.points_px) <= (FIRST_POINTS if len(members) >= LEAST_CROWD else LEAST_CROWD)
    most = math.log((ACCEPTED / _THRESHOLDS if at_once else ACCEPTED_AMONG_OTHERS) / numbers)
    if not is_exact and len(members) < len(scene.points_px):
        most = math.log(_ACCEPTED_INEXACT / numbers)
        if polygon.squares_px2 > len(members) * _BUILT_WITHIN**2 * math.prod(polygon.semi_axes_px):
            return None
    if not is_exact and scene.numbers > 1 and len(members) < CLOSED * sides:
        return None
    if chance_among(near=(NONE_NEAR, NONE_NEAR)) > most:
        return None  # others near it, and cables, would only make it likelier
    chance = chance_among(
        near=neighbours(scene.points_px, scene.brightness, members, polygon.centre_px, polygon.semi_axes_px[0]),
        cables=cables_of(polygon.corners >= 0) if may_hang else (),
    )
    return Candidate(polygon, sides, chance + math.log(numbers)) if chance < most else None


def _squares_of_px2(polygon: Polygon, points_px: np.ndarray) -> tuple[float, float]:
    """Sums of squares of how far a polygon's points (M, 2) are off their corners, along the circle and across it."""
    places = np.column_stack([points_px[polygon.members], np.ones(len(polygon.members))])
    flat = places @ np.linalg.inv(polygon.mapping).T
    angles_rad = 2 * math.pi / len(polygon.corners) * np.flatnonzero(polygon.corners >= 0)
    return squares_apart_px2(flat[:, :2] / flat[:, 2:], angles_rad, polygon.semi_axes_px)


def squares_apart_px2(
    flat: np.ndarray, angles_rad: np.ndarray, semi_axes_px: tuple[float, float]
) -> tuple[float, float]:
    """The same of points (N, 2) on the circle's plane, in radii, and their lights' angles (N,), whatever the roll."""
    off = np.exp(1j * (np.arctan2(flat[:, 1], flat[:, 0]) - angles_rad))
    along, across = np.angle(off * off.mean().conj()), np.hypot(flat[:, 0], flat[:, 1]) - 1
    scale_px2 = math.prod(semi_axes_px)
    return scale_px2 * float(along @ along), scale_px2 * float(across @ across)


def log_chance_rings(
    count: int,
    sides: int,
    *,
    even: bool,
    squares_px2: float,
    semi_axes_px: tuple[float, float],
    near: tuple[Neighbours, Neighbours],
    area_px2: float,
    cables: Sequence[Sequence[int]] = (),
    apart_px2: tuple[float, float] | None = None,
) -> float:
    """Logarithm of the expected number of rings as good among points strewn at random, see docs/method.md.

    ``apart_px2`` are the squares along and across the rim, where both are known: hands place lamps better across it.
    """
    major, minor = semi_axes_px
    if minor <= 0:
        return math.inf
    ways = math.lgamma(sides + 1) - math.lgamma(count + 1) - math.lgamma(sides - count + 1)
    if even:
        ways -= math.log(sides)
    tube = _log_ball(2 * count - 6, squares_px2)
    if apart_px2 is not None and count >= LEAST_CROWD:
        both = _log_ball(count - 1, apart_px2[0]) + _log_ball(count - 5, apart_px2[1])
        tube = min(tube, both + math.log(_KINDS_OF_ERRORS))
    common = math.log(2 * math.pi**2 / 3 * count**3 / 4) + tube + ways + math.log(_SIZES * max(1, sides - 3))
    around = min(4 * math.pi * major**2, area_px2)
    crowd = min(4 * math.pi * major * minor, area_px2)

    def strewn(others: Neighbours) -> float:
        return count * math.log((1 + others.around) / around) + math.log(area_px2) + 4 * math.log(major)

    def crowded(others: Neighbours) -> float:
        return count * math.log((count + others.beside) / crowd) + math.log(crowd) + 2 * math.log(major * minor)

    def least(background: Callable[[Neighbours], float]) -> float:
        return min(background(near[0]), math.log(_BRIGHTNESSES) + background(near[1]))

    def on_cables(others: Neighbours) -> float:
        step_px2 = 4 * math.pi * major * minor / sides**2
        within = [steps for cable in cables for steps in [_NEAR_STEPS, *(_NEXT_STEPS * gap for gap in cable[1:])]]
        begun = (count - len(within)) * math.log((1 + others.around) / around)
        on = -sum(math.log(math.pi * steps**2 * step_px2) for steps in within)
        on += math.log(_OUT) * sum(gap - 1 for cable in cables for gap in cable)
        return begun + on + math.log(area_px2) + 4 * math.log(major)

    if count < LEAST_CROWD:
        return common + least(strewn)
    chances = [least(strewn), least(crowded) - math.log(_MORE_OF_CROWDS)]
    return common + max(chances + ([least(on_cables) - math.log(_FEWER_CABLES)] if cables else []))


def cables_of(lit: np.ndarray) -> list[list[int]]:
    """Steps from light to light along each arc of a ring (N,) that is open, as lamps hang on cables."""
    if not 0 < lit.sum() < CLOSED * len(lit):
        return []
    corners = np.flatnonzero(lit)
    steps = np.diff(corners, append=corners[0] + len(lit))
    if steps.max() <= (1 - CLOSED) * len(lit):
        return []
    steps = np.roll(steps, -1 - int(np.argmax(steps)))
    cables = np.split(steps, np.flatnonzero(steps > _LARGEST_GAP) + 1)
    return [cable[cable <= _LARGEST_GAP].tolist() for cable in cables if (cable <= _LARGEST_GAP).any()]


def log_chance_ellipses(count: int, rms_px: float, radius_px: float, density: float, total: int) -> float:
    """Natural logarithm of the expected number of ellipses that run as close to as many points strewn at random."""
    width_px = 2 * 2.0 * max(rms_px, LEAST_PX) * math.sqrt(count / (count - 5))
    beside = min(1.0, density * 2 * math.pi * radius_px * width_px)
    choose_five = math.log(math.comb(total, 5))
    others = math.log(math.comb(max(total - 5, count - 5), count - 5))
    return choose_five + others + (count - 5) * math.log(beside) + math.log(_SIZES)


def _log_ball(dimensions: int, squares: float) -> float:
    """Logarithm of the volume of a ball whose squared radius is ``squares``, or what centres are known to."""
    half, least = dimensions / 2, dimensions * LEAST_PX**2
    return (
        half * math.log(math.pi) - math.lgamma(half + 1) + half * math.log(max(squares, least)) if dimensions else 0.0
    )
