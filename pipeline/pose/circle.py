"""The two poses of a circle whose image is a given ellipse."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_number
from dockpose.lights.cone import circles_behind
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.uncertainty import PoseErrors


@dataclass(frozen=True)
class CirclePose:
    """Where the dock is and which way it faces, in the camera frame (x right, y down, z forward).

    Attributes
    ----------
    position_m : (3,) float array, metres
        The dock's centre.
    normal : (3,) float array
        Unit normal of the dock's face, towards the camera.
    centre_px : (2,) float array, pixels
        Image of the dock's centre, in the undistorted picture.
    probability : float or None
        Probability that this is the right one of the two candidates; None where nothing tells them apart.
    rms_px : float or None, pixels
        Root mean square reprojection error of the lights; None where it was not computed.
    roll_rad : float or None, radians
        Angle of light 0 around the dock's axis. Where lights are alike and evenly spaced any of them may be light 0,
        and this is the smallest such angle. None where it was not computed.
    sigma_position_m : tuple of 3 float or None, metres
        Standard errors of x, y and z as far as they come from this picture: what they would scatter by in pictures of
        the same place. None where not computed.
    sigma_theta_rad : tuple of 2 float or None, radians
        Standard errors of theta_x and theta_y, likewise.
    errors : PoseErrors or None
        How the errors of position and attitude go together, and what of them all pictures share. None where not
        computed.
    """

    position_m: np.ndarray
    normal: np.ndarray
    centre_px: np.ndarray
    probability: float | None = None
    rms_px: float | None = None
    roll_rad: float | None = None
    sigma_position_m: tuple[float, float, float] | None = None
    sigma_theta_rad: tuple[float, float] | None = None
    errors: PoseErrors | None = None

    @classmethod
    def at(cls, position_m: np.ndarray, normal: np.ndarray, camera: Camera, **known: Any) -> CirclePose:
        """Return the pose at a place, and what is known of it besides, with the image of the dock's centre."""
        x, y, z = position_m.tolist()
        centre_px = np.array([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy])
        return cls(position_m, normal, centre_px, **known)

    @cached_property
    def theta_x_rad(self) -> float:
        """The paper's pitch: n = Ry(theta_y) Rx(theta_x) (0, 0, -1)."""
        return angles_of(self.normal)[0]

    @cached_property
    def theta_y_rad(self) -> float:
        """The paper's yaw: n = Ry(theta_y) Rx(theta_x) (0, 0, -1)."""
        return angles_of(self.normal)[1]

    @cached_property
    def rotation(self) -> np.ndarray:
        """Rotation (3, 3) from the dock's frame, without roll, to the camera's; its third column is -normal."""
        x, y, z = self.normal.tolist()
        level = math.hypot(x, z)
        if level < 1e-12:
            return rotation_from_angles(self.theta_x_rad, self.theta_y_rad)
        return np.array([[-z / level, x * y / -level, -x], [0, level, -y], [x / level, y * z / -level, -z]])

    @cached_property
    def sigma_total_position_m(self) -> tuple[float, float, float] | None:
        """Standard errors of x, y, z with those that all pictures share: the truth is within 1.96 of them in 95 %."""
        return None if self.errors is None else self.errors.sigmas[None][0]

    @cached_property
    def sigma_total_theta_rad(self) -> tuple[float, float] | None:
        """Standard errors of theta_x and theta_y in radians, likewise."""
        return None if self.errors is None else self.errors.sigmas[None][1]

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names; angles in degrees, None for what was not computed."""
        return {
            "position_m": self.position_m.tolist(),
            "normal": self.normal.tolist(),
            "theta_x_deg": math.degrees(self.theta_x_rad),
            "theta_y_deg": math.degrees(self.theta_y_rad),
            "roll_deg": _listed(self.roll_rad, np.degrees),
            "centre_px": self.centre_px.tolist(),
            "probability": self.probability,
            "rms_px": self.rms_px,
            "sigma_position_m": _listed(self.sigma_position_m),
            "sigma_theta_deg": _listed(self.sigma_theta_rad, np.degrees),
            "sigma_total_position_m": _listed(self.sigma_total_position_m),
            "sigma_total_theta_deg": _listed(self.sigma_total_theta_rad, np.degrees),
            "quaternion_xyzw": list(self.quaternion_xyzw),
            "covariance_m_rad": _listed(self.covariance),
            "covariance_total_m_rad": _listed(self.covariance_total),
        }

    def summary(self) -> dict[str, Any]:
        """The pose as other programs take it: plain values, the errors' covariance in the order of ROS."""
        line, only_here = self.to_dict(), ("normal", "roll_deg", "centre_px", "probability", "rms_px")
        return {key: value for key, value in line.items() if key not in only_here}

    @cached_property
    def quaternion_xyzw(self) -> tuple[float, float, float, float]:
        """The rotation without roll as a unit quaternion (x, y, z, w): Ry(theta_y) Rx(theta_x)."""
        half_x, half_y = self.theta_x_rad / 2, self.theta_y_rad / 2
        cx, sx, cy, sy = math.cos(half_x), math.sin(half_x), math.cos(half_y), math.sin(half_y)
        return sx * cy, cx * sy, -sx * sy, cx * cy

    @cached_property
    def covariance(self) -> np.ndarray | None:
        """Covariance (6, 6) in ROS's order, m and rad about the camera's axes, roll unknown; None if not computed."""
        return None if self.errors is None else self.errors.in_camera(total=False)

    @cached_property
    def covariance_total(self) -> np.ndarray | None:
        """The same with the errors that all pictures share: what a filter may take for the error of one pose."""
        return None if self.errors is None else self.errors.in_camera(total=True)

    @property
    def T_camera_dock(self) -> np.ndarray:
        """The 4 x 4 transform from the dock's frame (z into the dock, away from the camera) to the camera's."""
        transform = np.eye(4)
        transform[:3, :3] = self.rotation
        transform[:3, 3] = self.position_m
        return transform


def _listed(numbers: Any, changed: Callable[[Any], Any] = np.asarray) -> Any:
    """Numbers as lists of Python's own; None for what was not computed."""
    return None if numbers is None else changed(numbers).tolist()


def angles_of(normal: np.ndarray) -> tuple[float, float]:
    """theta_x and theta_y, in radians, of a dock with this unit normal (3,)."""
    x, y, z = normal.tolist()
    return math.asin(max(-1.0, min(1.0, y))), math.atan2(-x, -z)


def rotation_from_angles(theta_x_rad: float, theta_y_rad: float, roll_rad: float | None = None) -> np.ndarray:
    """Rotation (3, 3) Ry(theta_y) Rx(theta_x) Rz(roll) of the dock's frame; its third column is minus the normal."""
    cx, sx = math.cos(theta_x_rad), math.sin(theta_x_rad)
    cy, sy = math.cos(theta_y_rad), math.sin(theta_y_rad)
    level = np.array([[cy, sy * sx, sy * cx], [0, cx, -sx], [-sy, cy * sx, cy * cx]])
    if roll_rad is None:
        return level
    c, s = math.cos(roll_rad), math.sin(roll_rad)
    return level @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def circle_poses(ellipse: Ellipse, camera: Camera, diameter: float) -> tuple[CirclePose, CirclePose]:
    """Return the two poses of a circle whose image is a given ellipse.

    Parameters
    ----------
    ellipse : Ellipse
        The circle's image, in pixels of the undistorted picture.
    camera : Camera
        The intrinsics.
    diameter : float, metres
        Diameter of the circle, above 0.

    Returns
    -------
    tuple of 2 CirclePose
        Both poses, the one whose normal points further to the left first. They coincide for a circle seen square on.

    Raises
    ------
    ValueError
        If the diameter is not positive.
    NoEllipseError
        If the ellipse is so small or narrow that rounding errors leave no circle behind it.

    Notes
    -----
    The closed form in the eigenvalues l1 >= l2 > 0 > l3 of the cone through the ellipse.

    References
    ----------
    Safaee-Rad, Tchoukanov, Smith and Benhabib 1992, "Three-dimensional location estimation of circular features for
    machine vision".

    Examples
    --------
    >>> from dockpose.lights.ellipse import fit_ellipse
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> pose = CirclePose(np.array([0.1, 0.0, 1.5]), np.array([0.5, 0.0, -0.75**0.5]), np.zeros(2))
    >>> angles = np.radians(np.arange(0, 360, 36))
    >>> ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles)]) @ pose.rotation[:, :2].T
    >>> ellipse = fit_ellipse(camera.project(pose.position_m + ring))
    >>> [np.degrees(each.theta_y_rad).round(1).item() for each in circle_poses(ellipse, camera, 0.30)]
    [37.1, -30.0]
    """
    check_number("diameter", diameter, above=0)
    focal_px, centre_px = (camera.fx, camera.fy), (camera.cx, camera.cy)
    # The image of the centre is the pole of the line at infinity of the circle's plane, not the ellipse's centre.
    (left, left_m), (right, right_m) = circles_behind(ellipse.conic, focal_px, centre_px, diameter / 2)
    return CirclePose.at(left_m, left, camera), CirclePose.at(right_m, right, camera)
