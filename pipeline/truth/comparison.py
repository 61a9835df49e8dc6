"""Docks as they were seen beside a measured trajectory: clocks, mount and dock found, errors and what they mean."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from dockpose.truth.trajectory import Placement


@dataclass(frozen=True)
class TrajectoryComparison:
    """What a measured trajectory says of docks that were seen.

    Attributes
    ----------
    offset_s, offset_sigma_s : float or None, seconds
        Added to the results' times it gives the trajectory's, at the first frame. None: cannot be told, or was given.
    drift_ppm, drift_sigma_ppm : float or None, millionths of a second per second
        By how much the offset grows.
    mount, dock_in_world : Placement
        The camera in the tracked body, and the dock, without roll, in the trajectory's frame.
    scale, scale_sigma : float or None
        True lengths over estimated ones, a share: true diameter over that which was searched with.
    notes : tuple of str
        A sentence on each thing that the motion cannot tell, that was left out or assumed.
    errors : (N, 5) float array, metres and radians
        Estimated less true x, y, z, theta_x, theta_y of each frame; NaN where there is no dock or no truth.
    sigmas : (N, 5) float array, metres and radians
        Standard errors that the results claim for these.
    true_positions_m, true_normals : (N, 3) float array, metres
        The dock in the camera by the trajectory, divided by the scale; NaN where it has a gap.
    camera_m, true_camera_m : (N, 3) float array, metres
        The camera in the trajectory's frame, by the results and by the trajectory.
    clock_residuals_s : (N,) float array, seconds
        By which time each frame alone is off; NaN where the motion is too slow to say.
    is_fitted : (N,) bool array
        Whether a frame was fitted; the others were reported.
    is_wrong_pose, is_wrong_dock : (N,) bool array
        Whether the other candidate fits and the chosen one does not; whether neither does.
    views : (N,) str array
        "whole", "partly" or "not" as the ring is in the picture by the trajectory; "" where that is not known.
    report : dict
        Statistics of the frames reported, by names that carry their units.
    """

    offset_s: float | None
    offset_sigma_s: float | None
    drift_ppm: float | None
    drift_sigma_ppm: float | None
    mount: Placement
    dock_in_world: Placement
    scale: float | None
    scale_sigma: float | None
    notes: tuple[str, ...]
    errors: np.ndarray
    sigmas: np.ndarray
    true_positions_m: np.ndarray
    true_normals: np.ndarray
    camera_m: np.ndarray
    true_camera_m: np.ndarray
    clock_residuals_s: np.ndarray
    is_fitted: np.ndarray
    is_wrong_pose: np.ndarray
    is_wrong_dock: np.ndarray
    views: np.ndarray
    report: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names; None for what is not known."""
        numbers = ("offset_s", "offset_sigma_s", "drift_ppm", "drift_sigma_ppm")
        return {
            **{name: getattr(self, name) for name in numbers},
            "mount": self.mount.to_dict(),
            "dock_in_world": self.dock_in_world.to_dict(),
            "scale": self.scale,
            "scale_sigma": self.scale_sigma,
            "notes": list(self.notes),
            **self.report,
        }
