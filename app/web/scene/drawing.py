"""What both drawings of the 3D scene share, viser's and static/scene.js: where things are, in the camera's frame."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose import Camera, Dock, Estimate
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.scene.surroundings import Label, circle, labels
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.known import KnownPose

PLANE_AT = 0.3  # of the way to the dock: near enough to the camera to belong to it, large enough to be seen
_NEAR = 1.5  # radii: docks farther off are drawn nearer, and never beyond twice as many
_EMPTY = 4.0  # radii of water, where there is no dock
_BREAK = 0.44, 0.52  # of the way to the dock: where the lines to it are broken
_BREAK_HALF, _BREAK_DEEP = 0.35, 0.07  # of a mark across them, in radii
_RIM_CORNERS = 24
_PATH_S = 5.0


def shortened(points: np.ndarray, radius: float) -> np.ndarray:
    """Points (..., 3) as they are drawn: along their rays, none beyond three radii, and farther ones always beyond."""
    near, ranges = _NEAR * radius, np.linalg.norm(points, axis=-1, keepdims=True)
    return np.where(
        ranges <= near, points, points * near / np.maximum(ranges, near) * (2 - near / np.maximum(ranges, near))
    )


def lights_on_ring(dock: Dock, roll_rad: float | None) -> np.ndarray:
    """Positions (N, 3) of a dock's lights, extra ones last, in radii; empty where their number is unknown."""
    if dock.lights is None:
        return np.zeros((0, 3))
    angles, roll = (roll_rad or 0.0) + dock.light_angles_rad(), rotation_from_angles(0.0, 0.0, roll_rad or 0.0)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return np.concatenate([ring, np.array(dock.extra_lights_m).reshape(-1, 3) @ roll.T / dock.radius])


def image_plane(camera: Camera) -> tuple[float, float, np.ndarray]:
    """Width, height and centre (3,) of the image plane a metre ahead, its principal point on the optical axis."""
    middle_x = ((camera.width - 1) / 2 - camera.cx) / camera.fx
    middle_y = ((camera.height - 1) / 2 - camera.cy) / camera.fy
    return camera.width / camera.fx, camera.height / camera.fy, np.array([middle_x, middle_y, 1.0])


def rays_to_lights(found: Estimate) -> np.ndarray:
    """Segments (N, 2, 3) in metres from the camera, or its port, to the lights of the chosen pose."""
    pose = found.selected
    if pose is None or found.markers is None or found.ring is None:
        return np.zeros((0, 2, 3))
    points_px = found.markers.points_px[found.ring.on_ring]
    starts, rays = found.camera.ray_starts(points_px), found.camera.rays(points_px)
    lengths = ((pose.position_m - starts) @ pose.normal) / (rays @ pose.normal)
    ends = starts + rays * lengths[:, None]
    if found.camera.port is not None:  # the rays start at its outer face
        face_m = found.camera.port.air_gap_m + found.camera.port.glass_m
        starts = starts + rays * ((face_m - starts[:, 2]) / rays[:, 2])[:, None]
    return np.stack([starts, ends], axis=1)


def broken(rays: np.ndarray, to: np.ndarray, shift: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Segments (N, 2, 3) of rays (M, 2, 3) to a dock that is drawn ``shift`` (3,) from its place, at ``to`` (3,).

    They leave the camera as they are, and reach the lights beyond a gap, whose marks are returned as well.
    """
    if not shift.any():
        return rays, rays[:0]
    starts, ends = rays.swapaxes(0, 1)
    near, far = (at * to[2] / (ends - starts)[:, 2:] * (ends - starts) for at in (_BREAK[0], 1 - _BREAK[1]))
    stubs = [[starts, starts + near], [ends + shift - far, ends + shift]]
    across, along = np.array([0, radius * _BREAK_HALF, 0]), radius * _BREAK_DEEP * to / np.linalg.norm(to)
    zigzag = np.outer([-1, -0.4, 0.4, 1], across) + np.outer([0, 1, -1, 0], along)
    marks = np.concatenate([at * to + np.stack([zigzag[:-1], zigzag[1:]], axis=1) for at in _BREAK])
    return np.concatenate([np.stack(ends_of, axis=1) for ends_of in stubs]), marks


def rim(pose: CirclePose | KnownPose, radius: float) -> np.ndarray:
    """Points (N, 3) around a dock, in metres."""
    return radius * circle(_RIM_CORNERS)[:, 0] @ np.asarray(pose.rotation).T + np.asarray(pose.position_m)


@dataclass(frozen=True, eq=False)
class Drawing:
    """Where everything is drawn, in metres.

    Docks stand ``shift`` (3,) from their places; ``docks`` (N, 3) and ``everything`` (M, 3) are to be seen, to
    ``depth_m``. ``plane`` (4, 3) has the corners of the picture, ``rays``, ``marks`` of the gap in them and ``path``
    are segments (K, 2, 3), ``known`` the rims of docks that were measured or simulated, ``rims`` those found.
    """

    shift: np.ndarray
    docks: np.ndarray
    everything: np.ndarray
    depth_m: float
    plane: np.ndarray
    rays: np.ndarray
    marks: np.ndarray
    path: np.ndarray
    known: list[np.ndarray]
    rims: list[np.ndarray]
    labels: dict[str, Label]

    def numbers(self) -> dict[str, Any]:
        """Return it for static/scene.js."""
        names = "shift", "plane", "rays", "marks", "path", "known", "rims"
        return {name: np.round(getattr(self, name), 4).tolist() for name in names} | {
            "labels": [[name, one.text, one.anchor, *np.round(one.position, 4)] for name, one in self.labels.items()]
        }


def drawing_of(analysis: Analysis) -> Drawing:
    """Return where everything is drawn of a result."""
    found, view, tracked = analysis.shown, analysis.view, analysis.tracked_frame
    radius, known = found.dock.radius, [*filter(None, (view.truth, view.measured_pose))]
    poses = [*known, *found.candidates]
    places = np.array([pose.position_m for pose in poses] or [(0.0, 0.0, _EMPTY * radius)])
    nearest = places[np.linalg.norm(places, axis=1).argmin()]
    to = shortened(nearest, radius)
    rims = [rim(pose, radius) + to - nearest for pose in poses] or [to[None]]
    docks = np.concatenate(rims)
    width, height, middle = image_plane(view.camera)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [width / 2, height / 2, 0]
    plane = PLANE_AT * to[2] * (middle + corners)
    rays, marks = broken(rays_to_lights(found), to, to - nearest, radius)
    path = np.zeros((1, 3)) if tracked is None else tracked.trajectory.path_m(tracked.frame.index, _PATH_S)
    path = shortened(path, radius)
    depth_m = float(docks[:, 2].max())
    return Drawing(
        shift=to - nearest,
        docks=docks,
        everything=np.concatenate([np.zeros((1, 3)), plane, docks]),
        depth_m=depth_m,
        plane=plane,
        rays=rays,
        marks=marks,
        path=np.stack([path[:-1], path[1:]], axis=1),
        known=rims[: len(known)],
        rims=rims[len(known) :],
        labels=labels(found, view, depth_m, to - nearest),
    )
