"""How many rings chance alone would make, by which a ring is accepted (Desolneux, Moisan and Morel 2000)."""

import math
from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.ellipse import MIN_POINTS, Ellipse
from dockpose.lights.reprojection import RingTemplate, as_pose, farthest_off, flatten, stretch
from dockpose.lights.spacing import phase_of

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
# Lamps on a string are not strewn: the second is within so many steps of the first, and each further one within so many
# of where the last two point; one of twenty is out. A ring with such a share of its lights, or along such a share of
# it, is no string, and ten thousand docks are seen for each string that would pass for a part of one.
_NEAR_STEPS, _NEXT_STEPS, _LARGEST_GAP, _OUT, CLOSED, _FEWER_STRINGS = 3.0, 0.25, 2, 0.05, 0.75, 1e4
_BAND = 2.0  # root mean squares to each side of an ellipse, within which its points lie
_KINDS_OF_ERRORS = 2.0  # alike both ways, or not
LEAST_PX = 0.05  # no centre is known better, root mean square per coordinate
_NUMBERS_OF_WHOLE = 2  # ways in which a number may be unknown: that of the lights in view, or another
FIRST_POINTS = 40  # the brightest, which are looked at first
MOST_LIGHTS = 64  # that a dock is expected to have
NUMBERS = range(4, 25)  # of lights that are found sooner by their corners than by their ellipse


class Near(NamedTuple):
    """How many points near a ring are not on it, and how many of these are as bright as its dimmest light."""

    around: int  # within twice its larger radius
    beside: int  # within an ellipse of twice its size and its shape, as letters beside a narrow one are
    bright_around: int
    bright_beside: int


class Strings(NamedTuple):
    """A ring's lights as lamps on strings."""

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
    least: np.ndarray  # (1,): log of the least chance of all rings that were judged, kept or not; written to


NONE_NEAR, NO_STRINGS, ALIKE = Near(0, 0, 0, 0), Strings(np.empty(0), 0), (-1.0, -1.0)


@compiled
def log_chance_of(
    corners: np.ndarray,
    squares_px2: float,
    apart_px2: tuple[float, float],
    mapping: np.ndarray,
    scene: Scene,
    may_hang: bool,
) -> float:
    """Logarithm of the expected number of rings as good; inf where chance, or lamps on a string if they may, made it.

    Of lights at corners (N,), -1 for none, by a homography (3, 3). Their squared errors may be told apart along the rim
    and across it, or are below 0 where alike; these may be larger along it. Of an unknown number such a ring must be
    nearly closed, for inexact lights fit many numbers; and among others it must be surer. The scene keeps the least.
    """
    members, semi_axes_px = corners[corners >= 0], stretch(mapping)
    count, sides, total, numbers = len(members), len(corners), len(scene.points_px), scene.numbers
    # Where a ring of which no light is missing is all that there is, its number is not one of many.
    if LEAST_CROWD <= count == sides == total:
        numbers = min(numbers, _NUMBERS_OF_WHOLE)
    # Four lights are picked out from among others, unless there is but one other: that makes so few fours.
    at_once = total <= (FIRST_POINTS if count >= LEAST_CROWD else LEAST_CROWD)
    most = np.log((ACCEPTED / _THRESHOLDS if at_once else ACCEPTED_AMONG_OTHERS) / numbers)
    if apart_px2[0] >= 0 and count < total:
        most = np.log(_ACCEPTED_INEXACT / scene.numbers)
        if squares_px2 > count * BUILT_WITHIN**2 * semi_axes_px[0] * semi_axes_px[1]:
            return np.inf
    if apart_px2[0] >= 0 and scene.numbers > 1 and count < CLOSED * sides:
        return np.inf
    tube = log_tube(count, sides, scene.even, squares_px2, apart_px2)
    near = near_of(scene.points_px, scene.brightness, members, (mapping[0, 2], mapping[1, 2]), semi_axes_px[0])
    strings = strings_of(corners >= 0) if may_hang else Strings(np.empty(0), 0)
    chance = tube + log_background(count, sides, semi_axes_px, scene.area_px2, near, strings)
    scene.least[0] = min(scene.least[0], chance + np.log(numbers))
    return chance + np.log(numbers) if chance < most else np.inf


@compiled
def score_ring(
    template: RingTemplate,
    corners: np.ndarray,
    squares: float,
    mapping: np.ndarray,
    scene: Scene,
    may_hang: bool,
    are_apart: bool,
    at_once: bool,
) -> tuple[float, np.ndarray, float, np.ndarray]:
    """Chance, corners, squares and mapping without points that make a ring likelier to be chance; inf of none.

    The points farthest off their places are left out, one after another; ``at_once`` ends with a ring that is no
    chance, or with the first of them. Errors along the rim and across it are taken apart where ``are_apart``.
    """
    count, best = np.count_nonzero(corners >= 0), (np.inf, corners, squares, mapping)
    while True:
        lit, apart_px2 = np.flatnonzero(corners >= 0), (-1.0, -1.0)
        if are_apart:
            flat = np.empty((len(lit), 2))
            flatten(mapping, template.points[corners[lit]], flat)
            apart_px2 = squares_apart_px2(flat, 2 * np.pi / len(corners) * lit, stretch(mapping))
        chance = log_chance_of(corners, squares, apart_px2, mapping, scene, may_hang)
        if chance < best[0]:
            best = chance, corners, squares, mapping
        if len(lit) <= LEAST_CROWD or (at_once and (chance < np.inf or len(lit) < count)):
            return best
        corners = corners.copy()
        corners[farthest_off(template, corners, mapping)] = -1
        squares, mapping = as_pose(template, corners, mapping)


@compiled_bare
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


@compiled_bare
def log_background(
    count: int, sides: int, semi_axes_px: tuple[float, float], area_px2: float, near: Near, strings: Strings
) -> float:
    """Logarithm of how densely so many of a ring's lights would lie by chance: strewn, in a crowd, or on strings."""
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
        on = (count - len(strings.steps)) * one + strings.out * np.log(_OUT)
        for steps in strings.steps:
            on -= np.log(np.pi * steps**2 * step_px2)
        hung = min(hung, on + sizes - np.log(_FEWER_STRINGS))
    if count < LEAST_CROWD:
        return strewn
    return max(strewn, crowded, hung) if len(strings.steps) else max(strewn, crowded)


@compiled_bare
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
def strings_of(lit: np.ndarray) -> Strings:
    """What a ring's lights (N,), lit or not, would be along its arcs that are open, as lamps hang on strings."""
    sides, count, largest = len(lit), 0, 0
    corners, steps, within = np.empty(sides, np.int64), np.empty(sides), np.empty(sides)
    for corner in range(sides):
        if lit[corner]:
            corners[count] = corner
            count += 1
    for k in range(count):
        steps[k] = (corners[(k + 1) % count] - corners[k]) % sides
        if steps[k] > steps[largest]:
            largest = k
    if not 0 < count < CLOSED * sides or steps[largest] <= (1 - CLOSED) * sides:
        return Strings(np.empty(0), 0)
    kept, out, is_first = 0, 0, True
    for k in range(count):
        step = steps[(largest + 1 + k) % count]
        if step <= _LARGEST_GAP:
            within[kept] = _NEAR_STEPS if is_first else _NEXT_STEPS * step
            kept, out = kept + 1, out + int(step) - 1
        is_first = step > _LARGEST_GAP
    return Strings(within[:kept].copy(), out)


@compiled
def squares_apart_px2(
    flat: np.ndarray, angles_rad: np.ndarray, semi_axes_px: tuple[float, float]
) -> tuple[float, float]:
    """Sums of squares of how far lights at angles (N,) are off along the circle and across it, whatever the roll.

    ``flat`` (N, 2) is how far each is off the circle, in radii, and its angle.
    """
    off, scale_px2 = flat[:, 1] - angles_rad, semi_axes_px[0] * semi_axes_px[1]
    along = np.mod(off - phase_of(off, 1) + np.pi, 2 * np.pi) - np.pi
    return scale_px2 * (along**2).sum(), scale_px2 * (flat[:, 0] ** 2).sum()


@compiled
def log_chances_of_spacings(angles: np.ndarray, numbers: np.ndarray, least_filled: float) -> np.ndarray:
    """Logarithms (K,) of how often chance would space points at angles (N,) as well as each number of lights."""
    chances = np.empty(len(numbers))
    for k in range(len(numbers)):
        chances[k] = log_chance_of_spacing(angles, numbers[k], least_filled)[0]
    return chances


@compiled
def log_chance_of_spacing(angles: np.ndarray, sides: int, least_filled: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Log of how often chance would fit a number of lights as well, the corner (N,) of each point, and which fit so."""
    slot = (angles - phase_of(angles, sides)) * (sides / (2 * np.pi))
    nearest = np.rint(slot)
    off, corner_of = np.abs(slot - nearest), nearest.astype(np.int64) % sides
    order = np.argsort(off)
    # Some points on the ring may be no lights: of the most exact so many as are least likely by chance.
    count, best, chance, ways = len(off), 0, np.inf, 0.0
    is_filled = np.zeros(sides, np.bool_)
    for k in range(1, count + 1):
        ways += np.log((count - k + 1) / k)  # of choosing k of them
        log = k * np.log(min(1.0, 2 * max(off[order[k - 1]], 1e-3))) + ways
        if log < chance:
            best, chance = k, log
        is_filled[corner_of[k - 1]] = True
    fit = np.zeros(count, np.bool_)
    fit[order[:best]] = True
    return (chance if np.count_nonzero(is_filled) > least_filled * sides else np.inf), corner_of, fit


def log_chance_of_all(ellipse: Ellipse, count: int, density: float) -> float:
    """Logarithm of the expected number of ellipses through all of so many points; any five lie on a conic."""
    if count <= MIN_POINTS:
        return math.inf
    beyond = count - MIN_POINTS
    width_px = 2 * _BAND * max(ellipse.rms_px, LEAST_PX) * math.sqrt(count / beyond)
    beside = min(1.0, density * 2 * math.pi * ellipse.semi_axes_px[0] * width_px)
    return math.log(math.comb(count, MIN_POINTS)) + beyond * math.log(beside) + math.log(_SIZES)
