"""Which of the groups are the dock's lights: those that lie, spaced as its lights are, on one ellipse."""

import math
import statistics
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Literal

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.chance import (
    ACCEPTED,
    FIRST_POINTS,
    LEAST_CROWD,
    LEAST_PX,
    MOST_LIGHTS,
    NUMBERS,
    Scene,
    log_chance_of_all,
)
from dockpose.lights.conics import LEAST_LIGHTS, polygons_on_ellipses
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.lights.false_rings import (
    AS_CONVINCING,
    SEVERAL,
    is_every_nth,
    is_part_of_more,
    reach_px,
    repeating,
    trouble_with,
)
from dockpose.lights.growing import NARROWEST, TOLERANCE_OF_AXIS, TOLERANCE_PX
from dockpose.lights.handmade import handmade_rings
from dockpose.lights.markers import Markers
from dockpose.lights.polygon import (
    MAX_POINTS,
    Candidate,
    Polygon,
    accepted,
    candidates_from,
    is_even,
    least_likely_part,
    places_of,
)
from dockpose.lights.reprojection import RingTemplate
from dockpose.lights.spacing import angles_on, are_even
from dockpose.lights.triples import FEW_POINTS

# A large light's centre may lie this share of its diameter off the ellipse, see also TOLERANCE_OF_AXIS.
TOLERANCE_OF_LIGHT = 0.15
_SURELY = 3.0  # standard errors by which a ring must be farther away to be so
# Rings of lights in their places, these alone with many lights, or with none missing, and rings whose lights are off
# their places.
Kind = Literal["exact", "of many", "whole", "handmade"]
_STAND_OUT = 0.5  # of the light of a few, that of the next: lamps of one kind differ by as much
_WIDEST_GAP = 3.2  # of the mean spacing, where the number of lights is not known: two missing side by side
_AS_COMPLETE, _AS_BRIGHT = 0.7, 0.8  # of several rings: shares of the most lights, and of the most light
# A lamp is seen so many times as bright in a mirror as straight, at the most, where it shines that way; and so many
# rings are the most that a tank shows.
_TIMES_AS_BRIGHT, _MOST_RINGS = 16, 40


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
    least_log_chance: float = math.inf  # where there is none, of what was judged on the way

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
    points_px, least = points_px - [camera.cx, camera.cy], np.array([math.inf])
    scene = Scene(points_px, brightness, area_px2, focal_px, is_even(dock), numbers, least)
    in_lattice = repeating(points_px) if count > FIRST_POINTS else np.zeros(count, dtype=bool)
    order = order[~in_lattice[order]]
    if kind == "handmade":
        numbers = range(MIN_POINTS, NUMBERS.stop) if dock.lights is None else (dock.lights,)
        found = handmade_rings(scene, order[:FIRST_POINTS], numbers) if scene.even else []
    else:
        found = exact_rings(scene, order, dock, tolerance, kind)
    none = Ring(np.zeros(count, dtype=bool), "", least_log_chance=float(least[0]))
    if not found:
        if in_lattice.any():
            of_all = f"{count} largest of {markers.seen}" if markers.left_out else str(count)
            return replace(none, reason=f"{in_lattice.sum()} of the {of_all} groups repeat as in a lattice. {SEVERAL}")
        reason = f"None of the {markers.seen} groups of bright pixels form {_wanted(dock)}."
        return whole or replace(none, reason=reason)
    found += _more_of_size(scene, order, found, dock, tolerance)
    best, alike = _best([one for one in found if not is_every_nth(one)] or found, scene)
    exact = _without_outliers(best, dock, scene)
    trouble = trouble_with(best, exact, found, dock, scene, tolerance)
    if trouble:
        return whole or replace(none, reason=trouble, rivals=(_mask(count, best),))
    rivals = tuple(_mask(count, other) for other in _apart_from(best, found))
    on_ring = _mask(count, exact)
    inferred_focal_px = exact.polygon.focal_px
    other_px = None if inferred_focal_px == focal_px else inferred_focal_px
    return Ring(on_ring, _reason(on_ring, len(rivals)), None, exact.sides, rivals, alike, other_px)


def exact_rings(scene: Scene, order: np.ndarray, dock: Dock, tolerance: float, kind: Kind) -> list[Candidate]:
    """Rings of a kind, of lights in their places, among points in order; the surest first."""
    # Of a known number corners are found sooner, of an unknown one the ellipse.
    corners_first = dock.lights in NUMBERS
    found = [] if corners_first else _of_many(scene, order, dock, tolerance)
    # Bright lights far apart have the specks between them for neighbours, unless they are looked at by themselves; but
    # not where the next are as bright, so that no few stand out.
    next_light = scene.brightness[order[FEW_POINTS : 2 * FEW_POINTS]]
    stand_out = len(next_light) < FEW_POINTS or next_light[-1] < _STAND_OUT * scene.brightness[order[FEW_POINTS // 2]]
    looks = ((FIRST_POINTS, 0), (FEW_POINTS if stand_out else 0, FEW_POINTS), (MAX_POINTS, FIRST_POINTS))
    for most, of_more in looks:
        if kind != "of many" and not found and most and len(order) > of_more:
            chosen = np.sort(order[:most])
            found = candidates_from(scene, chosen, dock, tolerance, whole=kind == "whole")
    if corners_first and not found:
        found = _of_many(scene, order, dock, tolerance)
    return found


def _of_many(scene: Scene, order: np.ndarray, dock: Dock, tolerance: float) -> list[Candidate]:
    """Rings of many evenly spaced lights, by ellipses through most of the first points in order; the surest first."""
    chosen = np.sort(order[:MAX_POINTS])
    if not scene.even or (dock.lights or LEAST_LIGHTS) < LEAST_LIGHTS:
        return []
    rings = polygons_on_ellipses(scene.points_px, chosen, dock.lights, scene.focal_px, tolerance)
    return sorted(filter(None, [accepted(polygon, scene) for polygon in rings]), key=attrgetter("log_chance"))


def ellipse_through(points: np.ndarray, tolerance: float) -> Ellipse | None:
    """The ellipse that all points lie on; None where there is none, or it is too narrow to be a dock."""
    if len(points) < MIN_POINTS:
        return None
    try:
        ellipse = fit_ellipse(points)
    except NoEllipseError:
        return None
    major, minor = ellipse.semi_axes_px
    within = max(tolerance, TOLERANCE_OF_AXIS * major)
    if minor < NARROWEST * major or ellipse.distances(points).max() > within:
        return None
    return ellipse


def spaced_as(points: np.ndarray, ellipse: Ellipse, dock: Dock, density: float) -> int | None:
    """Number of lights of the dock that points on an ellipse are spaced as; 0 where it stays open, None for no dock."""
    count = len(points)
    if dock.angles_deg:
        return dock.lights if count == dock.lights else None
    angles = angles_on(points, ellipse)
    if dock.lights is not None:
        is_every_nth = MIN_POINTS < count < dock.lights and dock.lights % count == 0 and are_even(angles, count)
        return dock.lights if are_even(angles, dock.lights) and not is_every_nth else None
    if are_even(angles, count):
        return count
    ordered = np.sort(angles)
    gaps = np.diff(ordered, append=ordered[0] + 2 * np.pi)
    if count == MIN_POINTS or gaps.max() > _WIDEST_GAP * 2 * np.pi / count:
        return None
    return 0 if log_chance_of_all(ellipse, count, density) < math.log(ACCEPTED) else None


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
    alike = dock.with_lights(found[0].sides)
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
        more += [one for one in others if not is_part_of_more(one, one, scene, reach_px(one, tolerance))]
    return more


def _without_outliers(best: Candidate, dock: Dock, scene: Scene) -> Candidate:
    """The ring without points that make it likelier to be chance, as where a bubble runs together with a light."""
    polygon = best.polygon
    template = RingTemplate(scene.points_px, places_of(best.sides, dock), polygon.focal_px, 0.0)
    return least_likely_part(template, polygon.corners, polygon.mapping, scene, is_exact=True) or best


def _best(found: list[Candidate], scene: Scene) -> tuple[Candidate, int]:
    """The nearest of the surest ring and others apart from it, and how many could as well be the dock."""
    surest = found[0]
    least, most = _AS_COMPLETE * len(surest.members), AS_CONVINCING * surest.log_chance
    others = _apart_from(surest, found)
    alike = [surest, *(other for other in others if len(other.members) >= least and other.log_chance < most)]
    # What a flat mirror shows is always farther away than the dock. Where ranges do not tell, the brighter is it.
    places = [_range_radii(one.polygon) for one in alike]
    reach, sigma = min(places)
    light = [float(np.median(scene.brightness[one.polygon.members])) for one in alike]
    # Lamps a little out of their places move ranges, too: then it is open whether the nearer or the brighter is it.
    built = TOLERANCE_OF_AXIS * math.sqrt(2 / len(surest.members)) * reach
    within, open_within = (
        [k for k, (away, error) in enumerate(places) if away - reach <= _SURELY * math.hypot(sigma, error) + off]
        for off in (0.0, built)
    )
    best, brightest = (max(those, key=light.__getitem__) for those in (within, open_within))
    # Of four lights brighter lamps make other rings by chance.
    if light[best] < _AS_BRIGHT * light[brightest] and len(surest.members) >= LEAST_CROWD:
        best = brightest
    return alike[best], sum(light[k] > _AS_BRIGHT * light[best] for k in open_within if k != best)


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
