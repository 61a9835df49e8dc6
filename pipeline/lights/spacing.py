"""Even spacing around a circle or an ellipse: the corners, the phase of angles, and whether these are even."""

import math

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.ellipse import Ellipse

_EVEN_WITHIN = 0.2  # of the spacing, root mean square; perspective bends an even spacing by as much


def regular(sides: int, roll_rad: float = 0.0) -> np.ndarray:
    """Corners (N, 2) of a regular polygon on the unit circle."""
    corner_rad = roll_rad + 2 * math.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(corner_rad), np.sin(corner_rad)])


@compiled
def phase_of(angles: np.ndarray, sides: int) -> float:
    """Angle of the first corner of the regular polygon that angles (N,) are nearest to."""
    return np.arctan2(np.sin(sides * angles).sum(), np.cos(sides * angles).sum()) / sides


def angles_on(points: np.ndarray, ellipse: Ellipse) -> np.ndarray:
    """Angles (N,) of points around an ellipse that is stretched to a circle."""
    cos, sin = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    x, y = (points - ellipse.centre_px).T
    major, minor = ellipse.semi_axes_px
    return np.arctan2((-x * sin + y * cos) / minor, (x * cos + y * sin) / major)


def are_even(angles: np.ndarray, lights: int) -> bool:
    """Whether angles are as evenly spaced as a regular polygon's corners, some of which may be missing."""
    off = (angles - phase_of(angles, lights)) * (lights / (2 * math.pi))
    corners = np.rint(off)
    if len(set((corners % lights).tolist())) < len(angles):
        return False
    return math.sqrt(((off - corners) ** 2).mean()) < _EVEN_WITHIN
