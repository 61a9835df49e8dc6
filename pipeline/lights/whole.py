"""Whether one ellipse runs through all groups of a picture, spaced as the dock's lights are."""

import math

import numpy as np
from dockpose.dock import Dock
from dockpose.lights.chance import ACCEPTED, log_chance_ellipses
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.lights.growing import NARROWEST

# A light's centre may lie this share of the major semi-axis off the ellipse: uneven glow and lamp housings move it by a
# pixel or so, and on a large ring by a share of its size.
TOLERANCE_OF_AXIS = 0.02
_EVEN_WITHIN = 0.2  # of the spacing, root mean square; perspective bends an even spacing by as much
_WIDEST_GAP = 3.2  # of the mean spacing, where the number of lights is not known: two missing side by side


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
        is_every_nth = MIN_POINTS < count < dock.lights and dock.lights % count == 0 and _is_even(angles, count)
        return dock.lights if _is_even(angles, dock.lights) and not is_every_nth else None
    if _is_even(angles, count):
        return count
    ordered = np.sort(angles)
    gaps = np.diff(ordered, append=ordered[0] + 2 * np.pi)
    if count == MIN_POINTS or gaps.max() > _WIDEST_GAP * 2 * np.pi / count:
        return None
    return 0 if log_chance_of_all(ellipse, count, density) < math.log(ACCEPTED) else None


def log_chance_of_all(ellipse: Ellipse, count: int, density: float) -> float:
    """Logarithm of the expected number of ellipses through all of so many points; any five lie on a conic."""
    if count <= MIN_POINTS:
        return math.inf
    return log_chance_ellipses(count, ellipse.rms_px, ellipse.semi_axes_px[0], density, count)


def angles_on(points: np.ndarray, ellipse: Ellipse) -> np.ndarray:
    """Angles (N,) of points around an ellipse that is stretched to a circle."""
    cos, sin = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    x, y = (points - ellipse.centre_px).T
    major, minor = ellipse.semi_axes_px
    return np.arctan2((-x * sin + y * cos) / minor, (x * cos + y * sin) / major)


def _is_even(angles: np.ndarray, lights: int) -> bool:
    """Whether angles are as evenly spaced as a regular polygon's corners, some of which may be missing."""
    turns = lights * angles
    off = (turns - math.atan2(np.sin(turns).sum(), np.cos(turns).sum())) / (2 * math.pi)
    corners = np.rint(off)
    if len(set((corners % lights).tolist())) < len(angles):
        return False
    return math.sqrt(((off - corners) ** 2).mean()) < _EVEN_WITHIN
