"""The two circles of known radius behind an ellipse (Safaee-Rad, Tchoukanov, Smith and Benhabib 1992)."""

import math

import cv2
import numpy as np
from dockpose.lights.ellipse import NoEllipseError


def circles_behind(
    conic: np.ndarray, focal_px: tuple[float, float], centre_px: tuple[float, float], radius: float
) -> np.ndarray:
    """Normal towards the camera and centre (2, 2, 3) of both circles, the one that faces farther left first."""
    _, eigenvalues, axes = cv2.eigen(_cone(conic, *focal_px, *centre_px))
    l1, l2, l3 = eigenvalues.ravel().tolist()
    if not l3 < 0 < l2:
        raise NoEllipseError("the ellipse is too small, or too narrow, to be a circle's picture")
    return _poses_of_cone(l1, l2, l3, axes, radius)


def _cone(conic: np.ndarray, fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """The cone's matrix (3, 3), of unit norm: K^T Q K of the conic's matrix Q and the camera's K."""
    A, B, C, D, E, F = conic.tolist()
    xz = fx * (A * cx + (B * cy + D) / 2)
    yz = fy * (C * cy + (B * cx + E) / 2)
    zz = A * cx * cx + B * cx * cy + C * cy * cy + D * cx + E * cy + F
    xx, xy, yy = fx * fx * A, fx * fy * B / 2, fy * fy * C
    cone = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return cone / np.linalg.norm(cone)


def _poses_of_cone(l1: float, l2: float, l3: float, axes: np.ndarray, radius: float) -> np.ndarray:
    """Normal and centre (2, 2, 3) of both poses, left first, by eigenvalues, falling, and axes in rows (3, 3)."""
    g, h = math.sqrt((l2 - l3) / (l1 - l3)), math.sqrt(max(0.0, l1 - l2) / (l1 - l3))
    distance = l2 * radius / math.sqrt(-l1 * l3)
    poses = np.empty((2, 2, 3))
    for (normal, centre), side in zip(poses, (h, -h), strict=True):
        normal[:] = side * axes[0] + g * axes[2]
        centre[:] = distance * (side * l3 * axes[0] + g * l1 * axes[2]) / l2
        centre *= -1.0 if centre[2] < 0 else 1.0
        normal *= -1.0 if normal @ centre > 0 else 1.0
    return poses[::-1].copy() if poses[0, 0, 0] > poses[1, 0, 0] else poses
