"""How many rings chance alone would make, by which a ring is accepted (Desolneux, Moisan and Morel 2000)."""

import math
from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled

# Expected number of chance rings below which a ring is one: where it is all that there is, and where it is picked out
# from among others, at two thresholds and from the brightest points first.
ACCEPTED, ACCEPTED_AMONG_OTHERS, _THRESHOLDS = 1e-2, 1e-3, 2
# Of inexact lights clutter, which is not strewn evenly, makes more rings than chance.
# What is farther off than hands place lamps, as a share of the radius, root mean square, is a dock's only where nothing
# else is in view.
_ACCEPTED_INEXACT, BUILT_WITHIN = 1e-4, 0.065
_SIZES = 6.0  # octaves of radius that are searched
_BRIGHTNESSES = 8.0  # octaves of brightness down to the dimmest light, each another set of points
LEAST_CROWD, _MORE_OF_CROWDS = 5, 10.0  # a crowd may make ten times as many rings: not every picture shows one
# Lamps on a cable are not strewn: the second is within so many steps of the first, and each further one within so many
# of where the last two point; one of twenty is out. A ring with such a share of its lights, or along such a share of
# it, is no cable, and ten thousand docks are seen for each cable that would pass for a part of one.
_NEAR_STEPS, _NEXT_STEPS, _LARGEST_GAP, _OUT, CLOSED, _FEWER_CABLES = 3.0, 0.25, 2, 0.05, 0.75, 1e4
_KINDS_OF_ERRORS = 2.0  # alike both ways, or not
LEAST_PX = 0.05  # no centre is known better, root mean square per coordinate
_NUMBERS_OF_WHOLE = 2  # ways in which a number may be unknown: that of the lights in view, or another
FIRST_POINTS = 40  # the brightest, which are looked at first
MOST_LIGHTS = 64  # that a dock is expected to have
NUMBERS = range(4, 25)  # of lights that are tried by their corners where it is not known


class Near(NamedTuple):
    """How many points near a ring are not on it, and how many of these are as bright as its dimmest light."""

    around: int  # within twice its larger radius
    beside: int  # within an ellipse of twice its size and its shape, as letters beside a narrow one are
    bright_around: int
    bright_beside: int


class Cables(NamedTuple):
    """A ring's lights as lamps on cables."""

    steps: np.ndarray  # (K,): within how many steps each but the first is of where it would be
    out: int  # how many are out


class Scene(NamedTuple):
    """What rings are sought among."""

    points_px: np.ndarray  # (M, 2): the groups' centres, from the principal point
    brightness: np.ndarray  # (M,): of each
    area_px2: float  # of the picture
    focal_px: float  # of the picture
    even: bool  # whether the dock's lights are evenly spaced
    numbers: int  # how many numbers of lights are tried


class Fit(NamedTuple):
    """A ring's image, and how well points fit it."""

    corners: np.ndarray  # (N,): the point that is each of the dock's lights, -1 where none is
    squares_px2: float  # sum of the squares of how far the points are off their places
    apart_px2: tuple[float, float]  # the same along the rim and across it; below 0 where alike, as of exact lights
    semi_axes_px: tuple[float, float]
    centre_px: tuple[float, float]


NONE_NEAR, NO_CABLES, ALIKE = Near(0, 0, 0, 0), Cables(np.empty(0), 0), (-1.0, -1.0)


@compiled
def log_chance_of(fit: Fit, scene: Scene, may_hang: bool) -> float:
    """Logarithm of the expected number of rings as good; inf where chance, or lamps on a cable if they may, made it.

    Where errors are told apart, lights may be off their places along the rim more than across it. Of an unknown number
    such a ring must be nearly closed, for inexact lights fit many numbers; and among others it must be surer.
    """
    members = fit.corners[fit.corners >= 0]
    count, sides, total, numbers = len(members), len(fit.corners), len(scene.points_px), scene.numbers
    # Where a ring of which no light is missing is all that there is, its number is not one of many.
    if LEAST_CROWD <= count == sides == total:
        numbers = min(numbers, _NUMBERS_OF_WHOLE)
    # Four lights are picked out from among others, unless there is but one other: that makes so few fours.
    at_once = total <= (FIRST_POINTS if count >= LEAST_CROWD else LEAST_CROWD)
    most = np.log((ACCEPTED / _THRESHOLDS if at_once else ACCEPTED_AMONG_OTHERS) / numbers)
    if fit.apart_px2[0] >= 0 and count < total:
        most = np.log(_ACCEPTED_INEXACT / scene.numbers)
        if fit.squares_px2 > count * BUILT_WITHIN**2 * fit.semi_axes_px[0] * fit.semi_axes_px[1]:
            return np.inf
    if fit.apart_px2[0] >= 0 and scene.numbers > 1 and count < CLOSED * sides:
        return np.inf
    tube = log_tube(count, sides, scene.even, fit.squares_px2, fit.apart_px2)
    none = Near(0, 0, 0, 0), Cables(np.empty(0), 0)
    if tube + log_background(count, sides, fit.semi_axes_px, scene.area_px2, *none) > most:
        return np.inf  # others near it, and cables, would only make it likelier
    near = near_of(scene.points_px, scene.brightness, members, fit.centre_px, fit.semi_axes_px[0])
    cables = cables_of(fit.corners >= 0) if may_hang else none[1]
    chance = tube + log_background(count, sides, fit.semi_axes_px, scene.area_px2, near, cables)
    return chance + np.log(numbers) if chance < most else np.inf


@compiled
def log_tube(count: int, sides: int, even: bool, squares_px2: float, apart_px2: tuple[float, float]) -> float:
    """Logarithm of the volume in which so many of a ring's lights are as near to their places, in all ways.

    ``apart_px2`` are the squares along the rim and across it, below 0 where alike: hands place lamps better across it.
    """
    ways = math.lgamma(sides + 1.0) - math.lgamma(count + 1.0) - math.lgamma(sides - count + 1.0)
    if even:
        ways -= np.log(sides)
    tube = _log_ball(2 * count - 6, squares_px2)
    if apart_px2[0] >= 0 and count >= LEAST_CROWD:
        both = _log_ball(count - 1, apart_px2[0]) + _log_ball(count - 5, apart_px2[1])
        tube = min(tube, both + np.log(_KINDS_OF_ERRORS))
    return np.log(2 * np.pi**2 / 3 * float(count) ** 3 / 4) + tube + ways + np.log(_SIZES * max(1, sides - 3))


@compiled
def log_background(
    count: int, sides: int, semi_axes_px: tuple[float, float], area_px2: float, near: Near, cables: Cables
) -> float:
    """Logarithm of how densely so many of a ring's lights would lie by chance: strewn, in a crowd, or on cables."""
    major, minor = semi_axes_px
    if minor <= 0:
        return np.inf
    disc, crowd = min(4 * np.pi * major**2, area_px2), min(4 * np.pi * major * minor, area_px2)
    step_px2 = 4 * np.pi * major * minor / sides**2
    strewn, crowded, hung = np.inf, np.inf, np.inf
    for around, beside, tests in (
        (near.around, near.beside, 1.0),
        (near.bright_around, near.bright_beside, _BRIGHTNESSES),
    ):
        one, sizes = np.log((1 + around) / disc), np.log(tests * area_px2) + 4 * np.log(major)
        strewn = min(strewn, count * one + sizes)
        in_crowd = count * np.log((count + beside) / crowd) + np.log(tests * crowd) + 2 * np.log(major * minor)
        crowded = min(crowded, in_crowd - np.log(_MORE_OF_CROWDS))
        on = (count - len(cables.steps)) * one + cables.out * np.log(_OUT)
        for steps in cables.steps:
            on -= np.log(np.pi * steps**2 * step_px2)
        hung = min(hung, on + sizes - np.log(_FEWER_CABLES))
    if count < LEAST_CROWD:
        return strewn
    return max(strewn, crowded, hung) if len(cables.steps) else max(strewn, crowded)


@compiled
def _log_ball(dimensions: int, squares: float) -> float:
    """Logarithm of the volume of a ball whose squared radius is ``squares``, or what centres are known to."""
    if dimensions == 0:
        return 0.0
    half, least = dimensions / 2, dimensions * LEAST_PX**2
    return half * np.log(np.pi) - math.lgamma(half + 1) + half * np.log(max(squares, least))


@compiled
def near_of(
    points_px: np.ndarray, brightness: np.ndarray, members: np.ndarray, centre_px: tuple[float, float], radius_px: float
) -> Near:
    """Count the points (M, 2) near a ring that are not on it."""
    counts, count = np.zeros(4, np.int64), len(members)
    x0, y0, dimmest = 0.0, 0.0, np.inf
    for k in members:
        x0, y0, dimmest = x0 + points_px[k, 0] / count, y0 + points_px[k, 1] / count, min(dimmest, brightness[k])
    xx, xy, yy, is_on = 1e-9, 0.0, 1e-9, np.zeros(len(points_px), np.bool_)
    for k in members:
        x, y = points_px[k, 0] - x0, points_px[k, 1] - y0
        xx, xy, yy = xx + x * x / count, xy + x * y / count, yy + y * y / count
        is_on[k] = True
    for k in range(len(points_px)):
        if is_on[k]:
            continue
        x, y = points_px[k, 0] - x0, points_px[k, 1] - y0
        is_around = np.hypot(points_px[k, 0] - centre_px[0], points_px[k, 1] - centre_px[1]) < 2 * radius_px
        # The covariance of points around an ellipse has half its squared semi-axes.
        is_beside = yy * x * x - 2 * xy * x * y + xx * y * y < 8 * (xx * yy - xy * xy)
        for place, is_near in enumerate((is_around, is_beside)):
            counts[place] += is_near
            counts[2 + place] += is_near and brightness[k] >= dimmest
    return Near(counts[0], counts[1], counts[2], counts[3])


@compiled
def cables_of(lit: np.ndarray) -> Cables:
    """What a ring's lights (N,), lit or not, would be along its arcs that are open, as lamps hang on cables."""
    corners, sides = np.flatnonzero(lit), len(lit)
    steps, count = np.empty(len(corners)), len(corners)
    for k in range(count):
        steps[k] = (corners[(k + 1) % count] - corners[k]) % sides
    if not 0 < count < CLOSED * sides or steps.max() <= (1 - CLOSED) * sides:
        return Cables(np.empty(0), 0)
    kept, out, is_first, largest = 0, 0, True, np.argmax(steps)
    within = np.empty(count)
    for k in range(count):
        step = steps[(largest + 1 + k) % count]
        if step <= _LARGEST_GAP:
            within[kept] = _NEAR_STEPS if is_first else _NEXT_STEPS * step
            kept, out = kept + 1, out + int(step) - 1
        is_first = step > _LARGEST_GAP
    return Cables(within[:kept].copy(), out)


@compiled
def squares_apart_px2(
    flat: np.ndarray, angles_rad: np.ndarray, semi_axes_px: tuple[float, float]
) -> tuple[float, float]:
    """Sums of squares of how far lights at angles (N,) are off along the circle and across it, whatever the roll.

    ``flat`` (N, 2) is how far each is off the circle, in radii, and its angle.
    """
    off, sine, cosine = flat[:, 1] - angles_rad, 0.0, 0.0
    for k in range(len(off)):
        sine, cosine = sine + np.sin(off[k]), cosine + np.cos(off[k])
    roll, along, across = np.arctan2(sine, cosine), 0.0, 0.0
    for k in range(len(off)):
        along += (np.mod(off[k] - roll + np.pi, 2 * np.pi) - np.pi) ** 2
        across += flat[k, 0] ** 2
    scale_px2 = semi_axes_px[0] * semi_axes_px[1]
    return scale_px2 * along, scale_px2 * across


def log_chance_ellipses(count: int, rms_px: float, radius_px: float, density: float, total: int) -> float:
    """Natural logarithm of the expected number of ellipses that run as close to as many points strewn at random."""
    width_px = 2 * 2.0 * max(rms_px, LEAST_PX) * math.sqrt(count / (count - 5))
    beside = min(1.0, density * 2 * math.pi * radius_px * width_px)
    choose_five = math.log(math.comb(total, 5))
    others = math.log(math.comb(max(total - 5, count - 5), count - 5))
    return choose_five + others + (count - 5) * math.log(beside) + math.log(_SIZES)
