"""Rings of lights in their places: from three corners of a polygon, or of many lights from the ellipse through them."""

from operator import attrgetter
from typing import Literal

import numpy as np
from dockpose.dock import Dock
from dockpose.lights.chance import FIRST_POINTS, NUMBERS, Scene
from dockpose.lights.conics import LEAST_LIGHTS, polygons_on_ellipses
from dockpose.lights.polygon import MAX_POINTS, Candidate, accepted, find_polygons, regular
from dockpose.lights.triples import FEW_POINTS

# Rings of lights in their places, these alone with many lights, or with none missing, and rings whose lights are off
# their places.
Kind = Literal["exact", "of many", "whole", "handmade"]

_STAND_OUT = 0.5  # of the light of a few, that of the next: lamps of one kind differ by as much


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


def candidates_from(
    scene: Scene, chosen: np.ndarray, dock: Dock, tolerance: float, *, whole: bool = False
) -> list[Candidate]:
    """Polygons of the dock's lights that chance would hardly make, begun from the chosen points; the surest first."""
    units = [places_of(sides, dock) for sides in (NUMBERS if dock.lights is None else (dock.lights,))]
    return sorted(find_polygons(scene, units, tolerance, chosen, whole=whole), key=attrgetter("log_chance"))


def _of_many(scene: Scene, order: np.ndarray, dock: Dock, tolerance: float) -> list[Candidate]:
    """Rings of many evenly spaced lights, by ellipses through most of the first points in order; the surest first."""
    chosen = np.sort(order[:MAX_POINTS])
    if not scene.even or (dock.lights or LEAST_LIGHTS) < LEAST_LIGHTS:
        return []
    rings = polygons_on_ellipses(scene.points_px, chosen, dock.lights, scene.focal_px, tolerance)
    return sorted(filter(None, [accepted(polygon, scene) for polygon in rings]), key=attrgetter("log_chance"))


def is_even(dock: Dock) -> bool:
    """Whether a dock's lights are evenly spaced on its circle."""
    return not (dock.angles_deg or dock.offsets_m)


def places_of(sides: int, dock: Dock) -> np.ndarray:
    """Places (N, 2) of the dock's lights on its plane, in radii, in order around it."""
    if not is_even(dock):
        places = dock.light_points()[:, :2] / dock.radius
        return places[np.argsort(np.mod(np.arctan2(places[:, 1], places[:, 0]), 2 * np.pi))]
    return regular(sides)
