"""The vehicle: where its camera sits, and poses in its own frame."""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose.checks import check_number, check_one_of, make_plain
from dockpose.files import FileError, read_yaml
from dockpose.pose.circle import CirclePose
from dockpose.pose.uncertainty import cross

# Of each frame the axes of a camera that looks ahead and stands upright (right, down, ahead), as columns.
_AHEAD = {
    "frd": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "flu": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
}
FRAMES = tuple(_AHEAD)
_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")


class Mount(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Where the camera sits on the vehicle, and how well that is known.

    Parameters
    ----------
    position_m : (float, float, float), metres
        The camera's place in the vehicle's frame.
    quaternion_xyzw : (float, float, float, float), optional
        Rotation from the camera's frame (x right, y down, z ahead) to the vehicle's, of any length but 0.
    roll_deg, pitch_deg, yaw_deg : float, degrees, optional
        Instead of the quaternion: how the camera is turned about the vehicle's x, y and z axes, by the right-hand rule;
        all 0 for one that looks ahead and stands upright. The yaw comes first, then the pitch about the new y axis and
        the roll about the new x axis.
    position_sigma_m : float, metres
        Standard error of the place, per axis.
    angle_sigma_deg : float, degrees
        Standard error of the rotation, per axis.

    Raises
    ------
    ValueError
        If a number is not finite or out of range, or both a quaternion and angles are given.
    """

    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion_xyzw: tuple[float, float, float, float] | None = None
    roll_deg: float | None = None
    pitch_deg: float | None = None
    yaw_deg: float | None = None
    position_sigma_m: float = 0.0
    angle_sigma_deg: float = 0.0

    def __post_init__(self) -> None:
        make_plain(self)
        for axis, value in zip("xyz", self.position_m, strict=True):
            check_number(f"position_m {axis}", value)
        angles = [name for name in _ANGLES if getattr(self, name) is not None]
        for name in angles:
            check_number(name, getattr(self, name))
        for name in ("position_sigma_m", "angle_sigma_deg"):
            check_number(name, getattr(self, name), least=0)
        if self.quaternion_xyzw is not None:
            for index, value in enumerate(self.quaternion_xyzw):
                check_number(f"quaternion_xyzw[{index}]", value)
            if angles:
                raise ValueError(f"{angles[0]} does not go with quaternion_xyzw; give one or the other")
            if math.hypot(*self.quaternion_xyzw) < 1e-6:
                raise ValueError("quaternion_xyzw has no length")


class Vehicle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The vehicle that carries the camera.

    Parameters
    ----------
    T_body_camera : Mount
        Where its camera sits.
    frame : {"frd", "flu"}
        Axes of its frame: x ahead, y right, z down, as of ArduPilot and PX4; or x ahead, y left, z up, as of ROS.

    Raises
    ------
    ValueError
        If the frame is neither.

    Examples
    --------
    A camera 20 cm ahead of the vehicle's origin, which looks 30 degrees down: what is a metre ahead of it is nearer to
    the vehicle's nose, and lower.

    >>> vehicle = Vehicle(T_body_camera=Mount(position_m=(0.2, 0.0, 0.0), pitch_deg=-30.0), frame="frd")
    >>> (vehicle.rotation @ [0.0, 0.0, 1.0] + [0.2, 0.0, 0.0]).round(3)
    array([1.066, 0.   , 0.5  ])
    """

    T_body_camera: Mount
    frame: str = "frd"

    def __post_init__(self) -> None:
        check_one_of("frame", self.frame, FRAMES)

    @property
    def rotation(self) -> np.ndarray:
        """Rotation (3, 3) from the camera's frame to the vehicle's."""
        from scipy.spatial.transform import Rotation  # takes a third of a second to import

        mount = self.T_body_camera
        if mount.quaternion_xyzw is not None:
            return Rotation.from_quat(mount.quaternion_xyzw).as_matrix()
        yaw, pitch, roll = (math.radians(getattr(mount, name) or 0.0) for name in reversed(_ANGLES))
        return Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix() @ _AHEAD[self.frame]

    def rotated(self, degrees: int) -> "Vehicle":
        """The same vehicle for the camera of the picture turned clockwise, see :meth:`Camera.rotated`."""
        from scipy.spatial.transform import Rotation  # takes a third of a second to import

        turn = Rotation.from_euler("z", -degrees, degrees=True)
        quaternion = (Rotation.from_matrix(self.rotation) * turn).as_quat()
        return self._mounted(quaternion, self.frame)

    def in_frame(self, frame: str) -> "Vehicle":
        """The same vehicle with its frame's axes as "frd" or "flu" has them."""
        from scipy.spatial.transform import Rotation  # takes a third of a second to import

        if frame == self.frame:
            return self
        x, y, z = self.T_body_camera.position_m
        turned = np.diag([1.0, -1.0, -1.0]) @ self.rotation
        return self._mounted(Rotation.from_matrix(turned).as_quat(canonical=True), frame, position_m=(x, -y, -z))

    def _mounted(self, quaternion: np.ndarray, frame: str, **more: Any) -> "Vehicle":
        """The vehicle whose camera is turned by a quaternion (4,), whatever angles were given."""
        angles = dict.fromkeys(_ANGLES)
        mount = msgspec.structs.replace(self.T_body_camera, quaternion_xyzw=quaternion, **angles, **more)
        return Vehicle(T_body_camera=mount, frame=frame)

    @property
    def camera(self) -> "BodyPose":
        """Where its camera is."""
        return BodyPose(self.frame, np.array(self.T_body_camera.position_m), self.rotation, None, None)

    def pose(self, pose: CirclePose) -> "BodyPose":
        """A pose in the vehicle's frame, its covariance carried over.

        Parameters
        ----------
        pose : CirclePose
            In the camera's frame, as of an estimate.

        Returns
        -------
        BodyPose
            The same in the vehicle's; in its total covariance is what the mount may be off.
        """
        rotation, mount = self.rotation, self.T_body_camera
        seen = rotation @ pose.position_m
        by_turn = np.vstack([-cross(seen[None])[0], np.eye(3)])
        own = np.zeros((6, 6))
        own[:3, :3] = mount.position_sigma_m**2 * np.eye(3)
        own += math.radians(mount.angle_sigma_deg) ** 2 * by_turn @ by_turn.T
        alone, total = self.rotation_of(pose.covariance), self.rotation_of(pose.covariance_total)
        total = None if total is None else total + own
        return BodyPose(self.frame, seen + mount.position_m, rotation @ pose.rotation, alone, total)

    def rotation_of(self, covariance: np.ndarray | None) -> np.ndarray | None:
        """A covariance (6, 6) about the camera's axes, about the vehicle's."""
        both = np.kron(np.eye(2), self.rotation)
        return None if covariance is None else both @ covariance @ both.T


@dataclass(frozen=True)
class BodyPose:
    """Where something of the dock is in the vehicle's frame.

    Attributes
    ----------
    frame : {"frd", "flu"}
        The frame's axes.
    position_m : (3,) float array, metres
        Its place.
    rotation : (3, 3) float array
        From its own frame (z into the dock), without roll as seen by the camera, to the vehicle's.
    covariance, covariance_total : (6, 6) float array or None
        In ROS's order, metres and radians about the vehicle's axes: from this picture alone; with what camera, dock and
        mount may be off.
    """

    frame: str
    position_m: np.ndarray
    rotation: np.ndarray
    covariance: np.ndarray | None
    covariance_total: np.ndarray | None

    @cached_property
    def quaternion_xyzw(self) -> tuple[float, float, float, float]:
        """The rotation as a unit quaternion (x, y, z, w), w not negative."""
        from scipy.spatial.transform import Rotation  # takes a third of a second to import

        x, y, z, w = Rotation.from_matrix(self.rotation).as_quat(canonical=True).tolist()
        return x, y, z, w

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names."""
        return {
            "frame": self.frame,
            "position_m": self.position_m.tolist(),
            "normal": (-self.rotation[:, 2]).tolist(),
            "quaternion_xyzw": list(self.quaternion_xyzw),
            "sigma_position_m": _sigmas(self.covariance),
            "sigma_total_position_m": _sigmas(self.covariance_total),
            "covariance_m_rad": None if self.covariance is None else self.covariance.tolist(),
            "covariance_total_m_rad": None if self.covariance_total is None else self.covariance_total.tolist(),
        }


def _sigmas(covariance: np.ndarray | None) -> list[float] | None:
    return None if covariance is None else np.sqrt(np.diag(covariance)[:3]).tolist()


def load_vehicle(path: str | Path) -> Vehicle:
    """Read a vehicle file.

    Parameters
    ----------
    path : str or Path
        The file, with the keys ``T_body_camera`` and ``frame``.

    Returns
    -------
    Vehicle
        The vehicle.

    Raises
    ------
    FileError
        If the file cannot be read, or a key is unknown, missing or wrong; the text names it.
    """
    content = read_yaml(path)
    if "frame" not in content:
        raise FileError(f"{path}: frame is missing; say frd (x ahead, y right, z down) or flu (x ahead, y left, z up)")
    try:
        return msgspec.convert(content, Vehicle)
    except msgspec.ValidationError as error:
        raise FileError(f"{path}: {error}") from error
