"""What is compared: a measured trajectory of the camera's carrier, and docks as they were seen."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.uncertainty import cross
from numpy.typing import ArrayLike

GAP = 5.0  # of the usual time between rows: a longer one is a gap


@dataclass(frozen=True)
class Trajectory:
    """Poses of the tracked body that carries the camera, as another system has measured them.

    Attributes
    ----------
    name : str
        How messages call it.
    times_s : (N,) float array, seconds
        By the system's own clock, growing.
    positions_m : (N, 3) float array, metres
        The body's origin in the system's frame, the world.
    quaternions_xyzw : (N, 4) float array or None
        Rotation from the body's frame to the world's; None where it is not measured.
    notes : tuple of str
        A sentence on each thing that was left out or assumed in reading it.
    """

    name: str
    times_s: np.ndarray
    positions_m: np.ndarray
    quaternions_xyzw: np.ndarray | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class DockTrack:
    """Docks as they were seen, a frame a row; NaN where none was, or a number is not known.

    Attributes
    ----------
    times_s : (N,) float array, seconds
        By the film's clock, growing.
    positions_m, normals : (N, 3) float array, metres
        Centre of the dock that was chosen, in the camera's frame, and unit normal of its face, towards the camera.
    covariances : (N, 5, 5) float array, metres and radians
        Of x, y, z, theta_x, theta_y, as far as the errors come from each picture, see :func:`five_of`.
    covariances_total : (N, 5, 5) float array or None, metres and radians
        The same with what all pictures share, which intervals rest on; None: as the others.
    other_positions_m, other_normals : (N, 3) float array or None, metres
        Of the candidate that was not chosen.
    camera, dock : Camera, Dock or None
        Where they are known.
    """

    times_s: np.ndarray
    positions_m: np.ndarray
    normals: np.ndarray
    covariances: np.ndarray
    covariances_total: np.ndarray | None = None
    other_positions_m: np.ndarray | None = None
    other_normals: np.ndarray | None = None
    camera: Camera | None = None
    dock: Dock | None = None


@dataclass(frozen=True)
class Placement:
    """Where one frame lies in another; None: not known, as the motion cannot tell it.

    Attributes
    ----------
    position_m : (3,) float array or None, metres
        Its origin.
    quaternion_xyzw : (4,) float array or None
        Rotation from its axes to the other's.
    position_sigma_m : (3,) float array or None, metres
        Standard errors; None where it was given.
    angle_sigma_deg : (3,) float array or None, degrees
        Standard errors of a rotation about its own axes, NaN about the one that nothing shows, as the dock's normal.
    """

    position_m: ArrayLike | None = None
    quaternion_xyzw: ArrayLike | None = None
    position_sigma_m: ArrayLike | None = None
    angle_sigma_deg: ArrayLike | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names."""
        return {
            name: None if value is None else [None if one != one else one for one in np.asarray(value, float).tolist()]
            for name, value in vars(self).items()
        }


def five_of(covariances: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Covariances (N, 6, 6) in ROS's order, of docks with normals (N, 3), as those of the five degrees of freedom.

    The result (N, 5, 5) is of x, y, z in metres and theta_x, theta_y in radians: to first order a rotation w about the
    camera's axes moves the normal by w x n, and the angles are its arcs.
    """
    by = np.zeros((len(normals), 5, 6))
    by[:, :3, :3] = np.eye(3)
    by[:, 3:, 3:] = -angle_slopes(normals) @ cross(normals)
    return by @ covariances @ by.transpose(0, 2, 1)


def angle_slopes(normals: np.ndarray) -> np.ndarray:
    """Derivatives (N, 2, 3) of theta_x and theta_y by the normals (N, 3)."""
    x, _, z = normals.T
    level = np.maximum(x * x + z * z, 1e-12)
    o = np.zeros_like(x)
    return np.stack([o, 1 / np.sqrt(level), o, z / level, o, -x / level], axis=1).reshape(-1, 2, 3)


def angles(normals: np.ndarray) -> np.ndarray:
    """theta_x and theta_y (N, 2), in radians, of docks with these unit normals (N, 3)."""
    x, y, z = normals.T
    return np.column_stack([np.arcsin(np.clip(y, -1, 1)), np.arctan2(-x, -z)])
