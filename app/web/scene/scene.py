"""The 3D scene, in metres: the camera with its image plane, both candidate poses, and known ones."""

import math
import time

import cv2
import msgspec
import numpy as np
import viser
from dockpose import Camera, Dock, Estimate
from dockpose.app.drawing.colours import MEASURED_COLOUR, PATH_COLOUR, POSE_COLOURS, POSE_NAMES, TRUTH_COLOUR, rgb
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.view import View
from dockpose.app.web.scene.surroundings import KnownDock, Label, PortDisc, add_lines, circle, labels, port_radius_m
from dockpose.app.web.scene.viewpoints import Extent, Viewpoints
from dockpose.estimate.canvas import to_bgr8
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.known import KnownPose
from viser import transforms

PLANE_AT = 0.3  # of the way to the dock: near enough to the camera to belong to it, large enough to be seen
NORMAL_LENGTH = 1.3  # radii, as in the annotated picture
_TEXTURE_WIDTH_PX = 640
_QUICK_TEXTURE_WIDTH_PX = 320  # where pictures follow each other faster than a browser can draw large ones
_QUICK_S = 0.5
_PATH_POINTS = 400
_GREY = (130, 130, 130)
_AXIS_COLOURS = np.array([(214, 39, 40), (44, 160, 44), (31, 119, 180)], dtype=np.uint8)
_IMAGE_OPACITY = 0.7  # the docks behind it shine through, over their own lights when seen from the camera
_DISC_CORNERS, _DISC_APART = 48, 0.01  # of a dock, and its two sides from its plane, in radii
_HOLE = 0.62  # of its radius
_CHOSEN_OPACITY, _OTHER_OPACITY = 0.9, 0.35
_BLACK_PERCENTILE, _GAMMA = 2.0, 0.6  # of the picture on the picture plane, whose brightest pixel is white
_AMBIENT = 2.5
_DECIMETRES_FROM_M, _DECIMETRES_TO_M = 0.5, 4.0
_CELLS_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


def ring_segments(*, dashed: bool) -> np.ndarray:
    """Segments (N, 2, 3) of a circle of radius 1 in the dock's plane, solid or dashed."""
    return circle(96)[np.arange(96) % 4 < (2 if dashed else 4)]


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


def docks_of(found: Estimate, *known: KnownPose | None) -> Extent | None:
    """The box around all docks, estimated and known; None where there is none."""
    positions = [np.asarray(pose.position_m) for pose in (*filter(None, known), *found.candidates)]
    if not positions:
        return None
    return Extent(np.min(positions, axis=0) - found.dock.radius, np.max(positions, axis=0) + found.dock.radius)


def extent_of(docks: Extent | None) -> Extent:
    """The box around the camera and all docks; a metre of water where there is no dock."""
    if docks is None:
        return Extent(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return Extent(np.minimum(docks.low, 0.0), np.maximum(docks.high, 0.0))


def grid_cell_m(extent: Extent) -> float:
    """Size of a grid square: a decimetre at a tank's distances, elsewhere about ten to the dock."""
    if _DECIMETRES_FROM_M <= extent.depth_m <= _DECIMETRES_TO_M:
        return 0.1
    return next((cell for cell in _CELLS_M if cell >= extent.depth_m / 15), _CELLS_M[-1])


def disc(*, faces_camera: bool) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N, 3) and triangles (M, 3) of one side of a disc of radius 1 with a hole, where the vehicle goes in."""
    rim = circle(_DISC_CORNERS)[:, 0]
    depth = [0.0, 0.0, -_DISC_APART if faces_camera else _DISC_APART]
    first = np.arange(_DISC_CORNERS)
    following, count = np.roll(first, -1), _DISC_CORNERS
    triangles = np.concatenate(
        [
            np.column_stack([first, first + count, following]),
            np.column_stack([following, first + count, following + count]),
        ]
    )
    return np.concatenate([rim, _HOLE * rim]) + depth, triangles


class EstimatedDock:
    """Draws one candidate, solid where it is the chosen one: a disc with its lights and an arrow out of its face."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        path = f"/pose_{name.lower()}"
        self._is_chosen: bool | None = None  # and drawn so
        self.frame = scene.add_frame(path, show_axes=False, visible=False)
        self._ring = add_lines(scene, f"{path}/ring", ring_segments(dashed=False), colour, 3.0)
        shades = {"face": 0.75 * np.array([255] * 3) + 0.25 * np.array(colour), "back": 0.55 * np.array(colour)}
        self._sides = [
            scene.add_mesh_simple(
                f"{path}/{side}",
                *disc(faces_camera=side == "face"),
                color=tuple(shade.astype(int)),
                side="double",
                flat_shading=True,
            )
            for side, shade in shades.items()
        ]
        self._lights = scene.add_point_cloud(f"{path}/lights", np.zeros((1, 3)), colour, point_shape="circle")
        ends = np.array([[[0, 0, 0], [0, 0, -NORMAL_LENGTH]]])
        self._normal = scene.add_arrows(f"{path}/normal", ends, colour, head_length=0.2)

    def show(self, index: int, found: Estimate) -> None:
        """Draw the candidate of that index, if there is one."""
        self.frame.visible = index < len(found.candidates)
        if not self.frame.visible:
            return
        pose = found.candidates[index]
        self.frame.position = pose.position_m
        self.frame.wxyz = transforms.SO3.from_matrix(pose.rotation).wxyz
        dock = found.dock if found.dock.lights else msgspec.structs.replace(found.dock, lights=found.lights_on_ring)
        self._lights.points = lights_on_ring(dock, pose.roll_rad)
        for node in (self._ring, self._lights, self._normal, *self._sides):
            node.scale = found.dock.radius
        if self._is_chosen is not (pose is found.selected):
            self._is_chosen = pose is found.selected
            self._set_look(self._is_chosen)

    def _set_look(self, is_chosen: bool) -> None:
        self._ring.points = ring_segments(dashed=not is_chosen)
        self._ring.thickness = 3.0 if is_chosen else 2.0
        self._lights.point_size = 0.08 if is_chosen else 0.06
        self._normal.shaft_radius, self._normal.head_radius = (0.03, 0.09) if is_chosen else (0.015, 0.06)
        for side in self._sides:
            side.opacity = _CHOSEN_OPACITY if is_chosen else _OTHER_OPACITY


class Scene3D:
    """Draws analyses. Nodes are made once and then changed, so that dragging a slider does not flicker."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._pictured: np.ndarray | None = None
        self._pictured_at_s = -math.inf
        self._looked_at: str | None = None
        self.extent = Extent(np.zeros(3), np.ones(3))
        self._viewpoints = Viewpoints(server)
        self.look_from = self._viewpoints.look_from
        scene = server.scene
        scene.set_up_direction("-y")
        scene.set_global_visibility(False)  # until a browser has the rest of its page
        scene.configure_default_lights(cast_shadow=False)  # shadows would take half the drawing time
        scene.add_light_ambient("/light", intensity=_AMBIENT)  # a face is as light from every side
        scene.configure_environment_map(None)  # nothing reflects it, and software takes seconds
        self._grid = scene.add_grid(
            "/grid", plane="xz", cell_color=_GREY, cell_thickness=0.5, section_color=_GREY, fade_strength=0.5
        )
        self._grid_label = scene.add_label("/grid/label", "", anchor="top-left")
        no_lines = np.zeros((1, 2, 3))
        axes = np.stack([np.zeros((3, 3)), np.eye(3) / 3], axis=1)
        self._axes = add_lines(scene, "/camera/axes", axes, np.repeat(_AXIS_COLOURS[:, None], 2, axis=1), 2.5)
        self._edges = add_lines(scene, "/camera/edges", no_lines, _GREY, 1.5)
        self._rays = add_lines(scene, "/rays", no_lines, _GREY, 0.8)
        self._path = add_lines(scene, "/path", no_lines, rgb(PATH_COLOUR), 2.0)
        self._image: viser.ImageHandle | None = None
        self._truth = KnownDock(scene, "truth", rgb(TRUTH_COLOUR))
        self._measured = KnownDock(scene, "measured", rgb(MEASURED_COLOUR))
        self._port = PortDisc(scene)
        self._labels: dict[str, viser.LabelHandle] = {}
        self._poses = [EstimatedDock(scene, *pose) for pose in zip(POSE_NAMES, map(rgb, POSE_COLOURS), strict=True)]

    def show(self, analysis: Analysis) -> None:
        """Draw what was found; called from the worker's thread."""
        found, view = analysis.estimate, analysis.view
        docks = docks_of(found, view.truth, view.measured_pose)
        self.extent = extent_of(docks)
        plane_z = PLANE_AT * self.extent.depth_m
        with self._server.atomic():
            plane_bottom = self._show_camera(view, plane_z)
            self._show_grid(max(float(self.extent.high[1]) + 0.15 * self.extent.depth_m, 1.05 * plane_bottom))
            self._rays.visible = found.selected is not None
            self._rays.points = rays_to_lights(found)
            for index, dock in enumerate(self._poses):
                dock.show(index, found)
            port_radius = port_radius_m(found.camera, self.extent.depth_m)
            self._port.show(found.camera, port_radius)
            self._show_labels(labels(found, view, self.extent.depth_m, port_radius))
            tracked = analysis.tracked_frame
            path = np.zeros((1, 3)) if tracked is None else tracked.trajectory.path_m(_PATH_POINTS)
            self._path.points = np.stack([path[:-1], path[1:]], axis=1)
            self._truth.show(view.truth, found.dock.radius)
            self._measured.show(view.measured_pose, found.dock.radius)
        self._pictured = view.image
        # While a simulated scene is changed, or a sequence goes on, it is the same one that is looked at.
        looked_at = view.list_name if view.list_name == "sequence" else view.source
        is_other, self._looked_at = self._looked_at != looked_at, looked_at
        self._viewpoints.show(self.extent, docks, is_other=is_other)

    def _show_labels(self, placed: dict[str, Label]) -> None:
        for name, label in placed.items():
            if name not in self._labels:
                self._labels[name] = self._server.scene.add_label(f"/labels/{name}", label.text)
            handle = self._labels[name]
            handle.text, handle.position, handle.anchor = label.text, label.position, label.anchor
        for name, handle in self._labels.items():
            handle.visible = name in placed

    def _show_camera(self, view: View, plane_z: float) -> float:
        """Draw the image plane, its edges and the axes; returns the lowest y of the plane."""
        width, height, middle = image_plane(view.camera)
        if self._image is None or self._pictured is not view.image:
            now_s = time.monotonic()
            is_quick, self._pictured_at_s = now_s - self._pictured_at_s < _QUICK_S, now_s
            widest = _QUICK_TEXTURE_WIDTH_PX if is_quick else _TEXTURE_WIDTH_PX
            texture = _translucent(stretched(_at_most(to_bgr8(view.image), widest)[:, :, ::-1]))
            self._image = self._server.scene.add_image("/camera/image", texture, width, height)
        self._image.visible = True
        self._image.render_width, self._image.render_height = width, height
        self._image.position = plane_z * middle
        signs = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        corners = middle + signs * [width / 2, height / 2, 0]
        towards = np.concatenate([np.zeros((4, 3)), corners])
        self._edges.points = np.stack([towards, np.concatenate([corners, np.roll(corners, -1, axis=0)])], axis=1)
        for node in (self._image, self._edges, self._axes):
            node.scale = plane_z
        return plane_z * (middle[1] + height / 2)

    def _show_grid(self, floor_y: float) -> None:
        cell = grid_cell_m(self.extent)
        depth = cell * math.ceil(1.3 * self.extent.depth_m / cell)
        self._grid.cell_size, self._grid.section_size = cell, 10 * cell
        self._grid.width, self._grid.height = depth, depth
        self._grid.position = (0.0, floor_y, depth / 2 - cell)
        self._grid_label.position = (depth / 6, 0.0, -depth / 10)
        self._grid_label.text = f"grid squares: {100 * cell:g} cm" if cell < 1 else f"grid squares: {cell:g} m"


def stretched(picture: np.ndarray) -> np.ndarray:
    """The picture (H, W, 3) uint8 with its contrast stretched, so that dim lights are seen in a small one."""
    low, high = float(np.percentile(picture, _BLACK_PERCENTILE)), float(picture.max())
    curve = 255 * np.clip((np.arange(256) - low) / max(high - low, 1.0), 0, 1) ** _GAMMA
    return cv2.LUT(np.ascontiguousarray(picture), curve.astype(np.uint8))


def _at_most(picture: np.ndarray, widest_px: int) -> np.ndarray:
    """The picture, at most so wide."""
    height, width = picture.shape[:2]
    scale = min(1.0, widest_px / width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def _translucent(picture: np.ndarray) -> np.ndarray:
    """The picture with an opacity channel."""
    opacity = np.full((*picture.shape[:2], 1), round(255 * _IMAGE_OPACITY), dtype=np.uint8)
    return np.concatenate([picture, opacity], axis=2)
