"""Which of the groups are the dock's lights: those that lie, spaced as its lights are, on one ellipse."""

import math
import statistics
from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.chance import ACCEPTED, FIRST_POINTS, LEAST_CROWD, LEAST_PX, MOST_LIGHTS, NUMBERS, Scene
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.lights.exact import Kind, candidates_from, exact_rings, is_even, places_of
from dockpose.lights.growing import TOLERANCE_OF_RADIUS, TOLERANCE_PX, distances
from dockpose.lights.handmade import handmade_rings
from dockpose.lights.lattice import goes_on, repeating
from dockpose.lights.markers import Markers
from dockpose.lights.polygon import MAX_POINTS, Candidate, Polygon, least_likely_part
from dockpose.lights.reprojection import Sought
from dockpose.lights.whole import TOLERANCE_OF_AXIS, ellipse_through, log_chance_of_all, spaced_as

# A large light's centre may lie this share of its diameter off the ellipse, see also TOLERANCE_OF_AXIS.
TOLERANCE_OF_LIGHT = 0.15
# Another ring through some of the same points leaves it open which is right where its evidence comes so near.
_AS_CONVINCING = 0.6
_AS_COMPLETE, _AS_BRIGHT = 0.7, 0.8  # of several rings: shares of the most lights, and of the most light
# A lamp is seen so many times as bright in a mirror as straight, at the most, where it shines that way; and so many
# rings are the most that a tank shows.
_TIMES_AS_BRIGHT, _MOST_RINGS = 16, 40
# What is said of groups that show no one ring.
_SEVERAL = "Several rings can be laid through the same groups; which of them is the dock is unknown."
# Other lights on a ring, per light, from which on it is a part of another: of one with at least twice as many, so that
# as many others lie on it, of which two thirds may be missed. Two lamps may be on any rim.
_UNEXPLAINED, _FEWEST_OTHERS = 0.35, 3
_SPECK = 0.05  # of the ring's median light: lamps of one kind are not that unequal, beams and distance included
_LEAST_EXPECTED = 0.1  # other points on a ring: one may always be
_SAME_ELLIPSE = 0.08  # of the radius: what two rings on one ellipse differ by at the most


@dataclass(frozen=True)
class Ring:
    """The markers that are lights of the dock."""

    on_ring: np.ndarray  # (N,): for each marker
    reason: str  # one sentence: what was kept or thrown out, or why nothing is a ring
    ellipse: Ellipse | None = None  # through the lights, where it was fitted on the way
    lights: int | None = None  # how many lights the ring has, missing ones included
    rivals: tuple[np.ndarray, ...] = ()  # other rings in view that are as certain to be one, apart from this
    alike: int = 0  # how many of these could as well be the dock: as near, and as bright
    focal_px: float | None = None  # with which the lights are evenly spaced, where it is not the camera's

    @property
    def found(self) -> bool:
        """Whether any lights were found."""
        return bool(self.on_ring.any())


def find_ring(
    points_px: np.ndarray, markers: Markers, camera: Camera, dock: Dock, area_px2: float, kind: Kind = "exact"
) -> Ring:
    """Find the markers, at undistorted places (N, 2), that are the dock's lights, in a ring of a kind."""
    count = len(points_px)
    density = count / area_px2
    brightness = markers.areas_px * markers.peaks.astype(float)
    order = np.argsort(-brightness, kind="stable")
    # Specks, however many, say nothing on the size of lights: those are among the brightest groups.
    area_of_light_px2 = statistics.median(markers.areas_px[order[: dock.lights or MIN_POINTS]].tolist())
    tolerance = tolerance_px(0.0, 2 * math.sqrt(area_of_light_px2 / math.pi))
    is_more = dock.lights is not None and count > dock.lights
    ellipse = None if is_more else ellipse_through(points_px, tolerance)
    whole = None
    if ellipse is not None and (lights := spaced_as(points_px, ellipse, dock, density)) is not None:
        whole = Ring(np.ones(count, dtype=bool), f"All {count} groups lie on one ellipse.", ellipse, lights or None)
        if lights in (0, count) or log_chance_of_all(ellipse, count, density) < math.log(ACCEPTED):
            return whole
    numbers = MOST_LIGHTS if dock.lights is None else 1
    focal_px = math.sqrt(camera.fx * camera.fy)
    scene = Scene(points_px - [camera.cx, camera.cy], brightness, area_px2, focal_px, is_even(dock), numbers)
    in_lattice = repeating(points_px) if count > FIRST_POINTS else np.zeros(count, dtype=bool)
    order = order[~in_lattice[order]]
    if kind == "handmade":
        numbers = range(MIN_POINTS, NUMBERS.stop) if dock.lights is None else (dock.lights,)
        found = handmade_rings(scene, order[:FIRST_POINTS], numbers) if scene.even else []
    else:
        found = exact_rings(scene, order, dock, tolerance, kind)
    nothing = np.zeros(count, dtype=bool)
    if not found:
        if in_lattice.any():
            of_all = f"{count} largest of {markers.seen}" if markers.left_out else str(count)
            return Ring(nothing, f"{in_lattice.sum()} of the {of_all} groups repeat as in a lattice. {_SEVERAL}")
        return whole or Ring(nothing, f"None of the {markers.seen} groups of bright pixels form {_wanted(dock)}.")
    found += _more_of_size(scene, order, found, dock, tolerance)
    best, alike = _best([one for one in found if not _is_every_nth(one)] or found, scene)
    exact = _without_outliers(best, dock, scene)
    trouble = _trouble(best, exact, found, dock, scene, tolerance)
    if trouble:
        return whole or Ring(nothing, trouble, rivals=(_mask(count, best),))
    rivals = tuple(_mask(count, other) for other in _apart_from(best, found))
    on_ring = _mask(count, exact)
    told_px = exact.polygon.focal_px
    other_px = None if told_px == focal_px else told_px
    return Ring(on_ring, _reason(on_ring, len(rivals)), None, exact.sides, rivals, alike, other_px)


def tolerance_px(major_px: float, light_px: float = 0.0) -> float:
    """How far off its ellipse a light may lie, in pixels; for the ellipse's major semi-axis and a light's diameter."""
    return max(TOLERANCE_PX, TOLERANCE_OF_AXIS * major_px, TOLERANCE_OF_LIGHT * light_px)


def _wanted(dock: Dock) -> str:
    if dock.lights is None:
        return "a ring of evenly spaced lights; among other groups it is found sooner when the number is given"
    spaced = "evenly spaced lights" if is_even(dock) else "lights spaced as the dock's"
    return f"a ring of {dock.lights} {spaced}"


def _reason(on_ring: np.ndarray, rivals: int) -> str:
    kept, count = int(on_ring.sum()), len(on_ring)
    if kept == count:
        return f"All {count} groups lie on one ring."
    second = {0: "", 1: " A second ring is in view."}.get(rivals, f" {rivals} more rings are in view.")
    return f"{kept} of {count} groups lie on one ring; the other {count - kept} do not.{second}"


def _mask(count: int, candidate: Candidate) -> np.ndarray:
    mask = np.zeros(count, dtype=bool)
    mask[candidate.polygon.members] = True
    return mask


def _more_of_size(
    scene: Scene, order: np.ndarray, found: list[Candidate], dock: Dock, tolerance: float
) -> list[Candidate]:
    """Rings of as many lights as the surest among the rest of the points, as the dock whose image is brighter."""
    more: list[Candidate] = []
    lights, used = len(found[0].members), frozenset().union(*(one.members for one in found))
    alike = msgspec.structs.replace(dock, lights=found[0].sides)
    bright = scene.brightness[list(found[0].members)].min() / _TIMES_AS_BRIGHT
    order = order[scene.brightness[order] > bright]
    while len(found) + len(more) < _MOST_RINGS:
        rest = order[~np.isin(order, list(used))]
        if len(rest) < max(MIN_POINTS, _AS_COMPLETE * lights):
            break
        # What grows from the rest may end among points that are used.
        grown = candidates_from(scene, np.sort(rest[:MAX_POINTS]), alike, tolerance)
        others = [one for one in grown if not one.members & used]
        if not others:
            break
        used = used.union(*(one.members for one in others))
        more += [one for one in others if not _is_part_of_more(one, one, scene, _within_px(one, tolerance))]
    return more


def _without_outliers(best: Candidate, dock: Dock, scene: Scene) -> Candidate:
    """The ring without points that make it likelier to be chance, as where a bubble runs together with a light."""
    polygon = best.polygon
    sought = Sought(scene.points_px, places_of(best.sides, dock), polygon.focal_px, 0.0)
    return least_likely_part(sought, polygon.corners, polygon.mapping, scene, is_exact=True) or best


def _best(found: list[Candidate], scene: Scene) -> tuple[Candidate, int]:
    """The nearest of the surest ring and others apart from it, and how many could as well be the dock."""
    surest = found[0]
    least, most = _AS_COMPLETE * len(surest.members), _AS_CONVINCING * surest.log_chance
    others = _apart_from(surest, found)
    alike = [surest, *(other for other in others if len(other.members) >= least and other.log_chance < most)]
    # What a flat mirror shows is always farther away than the dock. Where ranges do not tell, the brighter is it.
    places = [_range_radii(one.polygon) for one in alike]
    reach, sigma = min(places)
    light = [float(np.median(scene.brightness[one.polygon.members])) for one in alike]
    # Lamps a little out of their places move ranges, too: then it is open whether the nearer or the brighter is it.
    built = TOLERANCE_OF_AXIS * math.sqrt(2 / len(surest.members)) * reach
    within, open_within = (
        [k for k, (away, error) in enumerate(places) if away - reach <= 3 * math.hypot(sigma, error) + off]
        for off in (0.0, built)
    )
    best, brightest = (max(those, key=light.__getitem__) for those in (within, open_within))
    # Of four lights brighter lamps make other rings by chance.
    if light[best] < _AS_BRIGHT * light[brightest] and len(surest.members) >= LEAST_CROWD:
        best = brightest
    return alike[best], sum(light[k] > _AS_BRIGHT * light[best] for k in open_within if k != best)


def _is_every_nth(one: Candidate) -> bool:
    """Whether six lights or more are every second of the dock's, or every third, which those left of it hardly are."""
    lit = np.flatnonzero(one.polygon.corners >= 0)
    steps = np.diff(lit, append=lit[0] + one.sides)
    return bool(steps[0] > 1 and (steps == steps[0]).all() and len(lit) > MIN_POINTS)


def _range_radii(polygon: Polygon) -> tuple[float, float]:
    """Distance of a ring in radii of it, by the homography of its pose, and the standard error."""
    columns = polygon.mapping / np.array([[polygon.focal_px], [polygon.focal_px], [1.0]])
    away = float(np.linalg.norm(columns[:, 2]) / math.sqrt(np.prod(np.linalg.norm(columns[:, :2], axis=0))))
    count = len(polygon.members)
    noise_px = math.sqrt(polygon.squares_px2 / max(1, 2 * count - 6))
    return away, away * max(noise_px, LEAST_PX) / polygon.semi_axes_px[0] * math.sqrt(2 / count)


def _apart_from(best: Candidate, found: list[Candidate]) -> list[Candidate]:
    """Rings that have no point in common with this, nor with each other."""
    used, apart = set(best.members), []
    for other in found:
        if not used & other.members:
            used |= other.members
            apart.append(other)
    return apart


def _trouble(
    best: Candidate, exact: Candidate, found: list[Candidate], dock: Dock, scene: Scene, tolerance: float
) -> str | None:
    """Why it is open whether the best ring, ``exact`` without outliers, is the dock; None where it is not."""
    unit = places_of(best.sides, dock)
    within = _within_px(best, tolerance)
    if goes_on(best.polygon, unit, scene.points_px, within):
        return f"The groups repeat as in a lattice. {_SEVERAL}"
    if _is_part_of_more(best, exact, scene, within):
        return f"More lights lie on one ring than a part of {best.sides}, so it is not the dock's."
    if _is_every_nth(best):
        return f"{len(best.members)} lights are evenly spaced, and the dock has {best.sides}: another ring."
    for other in found:
        if other is best or other.log_chance > _AS_CONVINCING * best.log_chance:
            continue
        if not other.members & best.members:
            if _on_same_ellipse(best.polygon, other.polygon):
                more = len(best.members) + len(other.members)
                return f"{more} lights lie on one ring, but the dock has {best.sides}."
        elif not _is_same(other, best):
            return _SEVERAL
    return None


def _within_px(one: Candidate, tolerance: float) -> float:
    """How far from its place on a ring a light may lie."""
    return max(tolerance, TOLERANCE_OF_RADIUS * one.polygon.semi_axes_px[1])


def _is_part_of_more(best: Candidate, exact: Candidate, scene: Scene, within_px: float) -> bool:
    """Whether more lights lie on a ring's ellipse than the dock has, and than chance would put there."""
    members, points_px = exact.polygon.members, scene.points_px
    # Specks are no lights, and what is near a light is a part of it.
    is_light = scene.brightness > _SPECK * np.median(scene.brightness[members])
    is_light[best.polygon.members] = False
    is_light &= distances(points_px, points_px[best.polygon.members]).min(axis=1) > 2 * within_px
    is_light[np.setdiff1d(best.polygon.members, members)] = True
    radius = exact.polygon.semi_axes_px[0]
    others = np.flatnonzero(is_light & (np.hypot(*(points_px - exact.polygon.centre_px).T) < 2 * radius))
    try:
        ellipse = fit_ellipse(points_px[members])
    except NoEllipseError:
        return False
    is_on = ellipse.distances(points_px[others]) < within_px
    count, on = len(members), int(is_on.sum())
    # No more than the dock has are its own: where some run together, groups stand between their places.
    if count + on <= best.sides or on < max(_FEWEST_OTHERS, _UNEXPLAINED * count):
        return False
    from scipy.special import pdtrc  # takes a third of a second to import, which few pictures need

    # The band along the ellipse, of the disc in which the others are counted.
    expected = float((~is_on).sum()) * min(1.0, within_px / radius)
    return float(pdtrc(on - 1, max(expected, _LEAST_EXPECTED))) < ACCEPTED


def _is_same(one: Candidate, other: Candidate) -> bool:
    """Whether two rings are one, but for lights that one of them misses."""
    size = max(one.polygon.semi_axes_px[0], other.polygon.semi_axes_px[0])
    return _on_same_ellipse(one.polygon, other.polygon, 0.25) and (
        one.members <= other.members or other.members <= one.members or size < 2 * TOLERANCE_PX
    )


def _on_same_ellipse(one: Polygon, other: Polygon, within: float = _SAME_ELLIPSE) -> bool:
    """Whether the centres and axes of two rings' images are the same, within this share of the radius."""
    radius = max(one.semi_axes_px[0], other.semi_axes_px[0])
    differ = math.dist(one.centre_px, other.centre_px), *np.subtract(one.semi_axes_px, other.semi_axes_px)
    return all(abs(value) < within * radius for value in differ)
