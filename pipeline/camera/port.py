"""Flat ports: refraction for a camera that was calibrated in air and looks through a window into water."""

import msgspec
import numpy as np
from dockpose.checks import check_number, make_plain

FRESH_WATER, SEA_WATER = 1.333, 1.340
ACRYLIC, GLASS = 1.491, 1.517
_NEWTON_STEPS = 12
_STEEPEST = 1e4  # tangent in air, beyond any lens' view; without an air gap some points have no ray at all


class FlatPort(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A plane window at right angles to the camera's axis.

    Parameters
    ----------
    air_gap_m : float, metres
        Distance from the camera's centre of projection to the window, at least 0.
    glass_m : float, metres
        Thickness of the window, at least 0.
    glass_index, water_index : float
        Refractive indices, above 1 (air is 1).

    Raises
    ------
    ValueError
        If a length is negative, or an index is not above 1.
    """

    air_gap_m: float
    glass_m: float
    glass_index: float = GLASS
    water_index: float = FRESH_WATER

    def __post_init__(self) -> None:
        make_plain(self)
        for name in ("air_gap_m", "glass_m"):
            check_number(name, getattr(self, name), least=0)
        for name in ("glass_index", "water_index"):
            check_number(name, getattr(self, name), above=1)

    @property
    def outside_m(self) -> float:
        """Distance from the camera's centre to the water side of the window."""
        return self.air_gap_m + self.glass_m

    def into_air(self, points_m: np.ndarray) -> np.ndarray:
        """Directions (N, 3), z = 1, in which the camera sees points (N, 3) in the water, in metres; else NaN."""
        sideways = np.hypot(points_m[:, 0], points_m[:, 1])
        depth = points_m[:, 2] - self.outside_m
        beyond = depth > 0
        depth = np.where(beyond, depth, 1.0)
        tangent = np.zeros_like(sideways)
        for _ in range(_NEWTON_STEPS):
            secant2 = 1 + tangent**2
            sine2 = tangent**2 / secant2
            reach, slope = self.air_gap_m * tangent, np.full_like(tangent, self.air_gap_m)
            for length, index in ((self.glass_m, self.glass_index), (depth, self.water_index)):
                cosine2 = index**2 - sine2
                reach += length * np.sqrt(sine2 / cosine2)
                slope += length * index**2 / (cosine2 * secant2) ** 1.5
            tangent = np.minimum(tangent + (sideways - reach) / slope, _STEEPEST)
        scale = np.where(beyond, tangent / np.maximum(sideways, 1e-300), np.nan)
        return np.column_stack([points_m[:, 0] * scale, points_m[:, 1] * scale, np.where(beyond, 1.0, np.nan)])

    def into_water(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Starts (N, 3) in metres on the axis, and unit vectors (N, 3), in the water, of rays (N, 3) in air."""
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        sine2 = unit[:, 0] ** 2 + unit[:, 1] ** 2
        in_water = np.column_stack([unit[:, :2] / self.water_index, np.sqrt(1 - sine2 / self.water_index**2)])
        # tan / sin for each medium, which has a limit on the axis, where both vanish.
        air = 1 / unit[:, 2]
        glass = 1 / np.sqrt(self.glass_index**2 - sine2)
        water = 1 / np.sqrt(self.water_index**2 - sine2)
        start_z = self.outside_m - (self.air_gap_m * air + self.glass_m * glass) / water
        return np.column_stack([np.zeros((len(unit), 2)), start_z]), in_water
