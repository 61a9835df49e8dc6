"""Which of the groups are the dock's lights: those that lie, evenly spaced, on one ellipse."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.polygon import find_polygon

# A light's centre may lie this far off the ellipse: uneven glow and lamp housings move it by a pixel or so, and on
# a large ring by a share of its size.
TOLERANCE_PX = 1.5
TOLERANCE_OF_AXIS = 0.02
_NARROWEST = 0.12  # minor to major axis: a dock seen at 83 degrees
_WIDEST_GAP = 3.2  # of the mean spacing: two lights that are missing side by side
_EVEN_WITHIN = 0.2  # of the spacing, root mean square; perspective bends an even spacing by as much


@dataclass(frozen=True)
class Ring:
    """The markers that are lights of the dock.

    Attributes
    ----------
    on_ring : (N,) bool for each marker.
    reason : one sentence: what was kept or thrown out, or why nothing is a ring.
    ellipse : through the lights, where it was fitted on the way; None where it was not.
    """

    on_ring: np.ndarray
    reason: str
    ellipse: Ellipse | None = None

    @property
    def found(self) -> bool:
        """Whether any lights were found."""
        return bool(self.on_ring.any())


def find_ring(points_px: np.ndarray, markers: Markers, lights: int | None, focal_px: float) -> Ring:
    """Find the markers that are the dock's lights.

    Parameters
    ----------
    points_px : (N, 2) centres of the markers, undistorted.
    markers : the same markers, for their sizes and brightness.
    lights : how many lights the dock has, evenly spaced; None where that is not known.
    focal_px : of the camera.

    Notes
    -----
    Where one ellipse runs through all markers, they are the lights. Otherwise the image of a regular polygon with as
    many corners as the dock has lights is sought among the markers, see :mod:`dockpose.lights.polygon`; of two, as a
    ring and its mirror image in the water's surface, the brighter.
    """
    count = len(points_px)
    ellipse = _ellipse_through(points_px)
    if ellipse is not None and _may_be_all(points_px, ellipse, lights):
        return Ring(np.ones(count, dtype=bool), f"All {count} groups lie on one ellipse.", ellipse)
    brightness = markers.areas_px * markers.peaks.astype(float)
    on_ring = find_polygon(points_px, brightness, lights, focal_px)
    kept = int(on_ring.sum())
    if kept == 0:
        wanted = "a ring of evenly spaced lights" if lights is None else f"a ring of {lights} evenly spaced lights"
        return Ring(on_ring, f"None of the {count} groups of bright pixels form {wanted}.")
    others = count - kept
    if others == 0:
        return Ring(on_ring, f"All {count} groups lie on one ring.")
    return Ring(on_ring, f"{kept} of {count} groups lie on one ring; the other {others} do not.")


def tolerance_px(major_px: float) -> float:
    """How far off its ellipse, of this major semi-axis, a light may lie, in pixels."""
    return max(TOLERANCE_PX, TOLERANCE_OF_AXIS * major_px)


def _ellipse_through(points: np.ndarray) -> Ellipse | None:
    """The ellipse that all points lie on; None where there is none, or it is too narrow to be a dock."""
    if len(points) < MIN_POINTS:
        return None
    try:
        ellipse = fit_ellipse(points)
    except NoEllipseError:
        return None
    major, minor = ellipse.semi_axes_px
    if minor < _NARROWEST * major or ellipse.distances(points).max() > tolerance_px(major):
        return None
    return ellipse


def _may_be_all(points: np.ndarray, ellipse: Ellipse, lights: int | None) -> bool:
    """Whether points on an ellipse are proof enough of a ring: evenly spaced, or else six or more all around it."""
    angles = _angles_on(points, ellipse)
    if lights is not None:
        return len(points) <= lights and _is_even(angles, lights)
    if len(points) == MIN_POINTS:
        return _is_even(angles, MIN_POINTS)
    ordered = np.sort(angles)
    gaps = np.diff(ordered, append=ordered[0] + 2 * np.pi)
    return bool(gaps.max() < _WIDEST_GAP * 2 * np.pi / len(points))


def _angles_on(points: np.ndarray, ellipse: Ellipse) -> np.ndarray:
    """Angles (N,) of points around an ellipse that is stretched to a circle."""
    cos, sin = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    x, y = (points - ellipse.centre_px).T
    major, minor = ellipse.semi_axes_px
    return np.arctan2((-x * sin + y * cos) / minor, (x * cos + y * sin) / major)


def _is_even(angles: np.ndarray, lights: int) -> bool:
    """Whether angles are as evenly spaced as a regular polygon's corners, some of which may be missing."""
    # In plain Python: for ten numbers that is several times as fast.
    slots = [angle * lights / (2 * math.pi) for angle in angles.tolist()]
    phase = cmath.phase(sum(cmath.exp(2j * math.pi * slot) for slot in slots)) / (2 * math.pi)
    corners = [round(slot - phase) for slot in slots]
    distinct = len({corner % lights for corner in corners}) == len(corners)
    squares = sum((slot - phase - corner) ** 2 for slot, corner in zip(slots, corners, strict=True))
    return distinct and math.sqrt(squares / len(slots)) < _EVEN_WITHIN
