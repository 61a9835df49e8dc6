"""Guidance: where the vehicle is in the corridor before the dock's entrance, and where it shall go."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose
from dockpose.pose.fixed import fixed_to
from dockpose.vehicle import Vehicle

# Of each frame the direction ahead, and up.
_AXES = {
    "camera": (np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])),
    "frd": (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])),
    "flu": (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])),
}
_STEP_RAD = 1e-6  # for derivatives
_LEVEL = 1e-3  # sine of the angle between corridor and upright below which another direction stands for up


@dataclass(frozen=True)
class Guidance:
    """Where the vehicle, or the camera where no vehicle is known, is in the corridor before the entrance.

    Attributes
    ----------
    frame : {"camera", "frd", "flu"}
        Whose place it is, and the frame of ``target_m``.
    along_m, across_m, above_m : float, metres
        From the entrance: out along the corridor's axis, to the right and up, as one sees it who goes in.
    sigma_total_m : tuple of 3 float or None, metres
        Their standard errors, with all that is known to be off.
    yaw_off_deg, pitch_off_deg : float, degrees
        How far the vehicle's nose, or the camera's axis, points right of and above the direction in.
    off_axis_deg : float, degrees
        Angle between the corridor's axis and the line from the entrance to the vehicle.
    inside_cone : bool
        Whether it is in the corridor.
    target : {"entrance", "standoff"}
        Where to go: in, or, from outside the cone, first to the point on the axis at the stand-off.
    target_m : tuple of 3 float, metres
        Where that is, in ``frame``.
    """

    frame: str
    along_m: float
    across_m: float
    above_m: float
    sigma_total_m: tuple[float, float, float] | None
    yaw_off_deg: float
    pitch_off_deg: float
    off_axis_deg: float
    inside_cone: bool
    target: str
    target_m: tuple[float, float, float]


def entrance_of(pose: CirclePose, dock: Dock, camera: Camera) -> CirclePose | None:
    """Pose of a dock's entrance in the camera's frame, z along the way in; None where the dock has none."""
    entrance = dock.entrance
    return None if entrance is None else fixed_to(pose, dock, entrance.position_m, entrance.normal, camera)


def guide(pose: CirclePose, dock: Dock, camera: Camera, vehicle: Vehicle | None = None) -> Guidance | None:
    """Tell where the vehicle is in the corridor before a dock's entrance.

    Parameters
    ----------
    pose : CirclePose
        The dock's pose in the camera's frame, as of an estimate.
    dock : Dock
        The dock, with its entrance.
    camera : Camera
        The camera.
    vehicle : Vehicle, optional
        The vehicle that carries the camera; None guides the camera itself.

    Returns
    -------
    Guidance or None
        None where the dock has no entrance.
    """
    entrance, there = dock.entrance, entrance_of(pose, dock, camera)
    if entrance is None or there is None:
        return None
    if vehicle is None:
        frame, place_m, inwards, covariance = "camera", there.position_m, -there.normal, there.covariance_total
    else:
        body = vehicle.pose(there)
        frame, place_m, inwards, covariance = body.frame, body.position_m, body.rotation[:, 2], body.covariance_total
    ahead, up = _AXES[frame]
    axes = _corridor(inwards, up, ahead)
    along, across, above = (axes @ -place_m * [-1, 1, 1]).tolist()
    on_axis, on_right, on_up = (axes @ ahead).tolist()
    lateral = math.hypot(across, above)
    inside = along >= 0 and lateral <= entrance.radius_m + along * math.tan(math.radians(entrance.cone_deg))
    x, y, z = (place_m if inside else place_m - entrance.standoff_m * inwards).tolist()
    return Guidance(
        frame,
        along,
        across,
        above,
        None if covariance is None else _sigmas(place_m, inwards, covariance, up, ahead),
        math.degrees(math.atan2(on_right, on_axis)),
        math.degrees(math.asin(max(-1.0, min(1.0, on_up)))),
        math.degrees(math.atan2(lateral, along)),
        inside,
        "entrance" if inside else "standoff",
        (x, y, z),
    )


def guided(pose: CirclePose | None, dock: Dock, camera: Camera, vehicle: Vehicle | None) -> dict[str, Any]:
    """What a JSON object says besides the chosen pose: the entrance, both in the vehicle's frame, and guidance."""
    if pose is None:
        return {"entrance": None, "vehicle": None, "guidance": None}
    entrance, guidance = entrance_of(pose, dock, camera), guide(pose, dock, camera, vehicle)
    return {
        "entrance": None if entrance is None else entrance.summary(),
        "vehicle": None if vehicle is None else vehicle.pose(pose).to_dict(),
        "guidance": None if guidance is None else asdict(guidance),
    }


def _corridor(inwards: np.ndarray, up: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """The corridor's own axes (3, 3), as rows: in, right and up, upright as the vehicle is."""
    right = np.cross(inwards, up)
    if float(np.linalg.norm(right)) < _LEVEL:  # an entrance in the floor: its upper side is where the nose points
        right = np.cross(inwards, ahead)
    right /= np.linalg.norm(right)
    return np.array([inwards, right, np.cross(right, inwards)])


def _sigmas(
    place_m: np.ndarray, inwards: np.ndarray, covariance: np.ndarray, up: np.ndarray, ahead: np.ndarray
) -> tuple[float, float, float]:
    """Standard errors of a place in the corridor, by the covariance (6, 6) of the entrance's pose."""
    slopes = np.empty((3, 6))
    slopes[:, :3] = -_corridor(inwards, up, ahead)
    for axis, turn in enumerate(np.cross(np.eye(3), inwards)):
        more, less = (_corridor(inwards + sign * _STEP_RAD * turn, up, ahead) @ -place_m for sign in (1, -1))
        slopes[:, 3 + axis] = (more - less) / (2 * _STEP_RAD)
    along, across, above = np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes)).tolist()
    return along, across, above
