"""The 3D scene, in metres: the camera with its image plane, both candidate poses, and known ones."""

import math
from typing import Any

import cv2
import msgspec
import numpy as np
import viser
from dockpose import Estimate
from dockpose.app.drawing.colours import MEASURED_COLOUR, PATH_COLOUR, POSE_COLOURS, POSE_NAMES, TRUTH_COLOUR, rgb
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.view import View
from dockpose.app.web.scene.drawing import Drawing, drawing_of, image_plane, lights_on_ring
from dockpose.app.web.scene.surroundings import KnownDock, Label, add_lines, circle
from dockpose.app.web.scene.viewpoints import Viewpoints
from dockpose.estimate.canvas import to_bgr8
from viser import transforms

NORMAL_LENGTH = 1.3  # radii, as in the annotated picture
_TEXTURE_WIDTH_PX = 320  # more than the plane has on any screen
_GREY = (130, 130, 130)
_AXIS_COLOURS = np.array([(214, 39, 40), (44, 160, 44), (31, 119, 180)], dtype=np.uint8)
_IMAGE_OPACITY = 0.7  # the docks behind it shine through, over their own lights when seen from the camera
_RING, _DISC_CORNERS, _DISC_APART, _HOLE = 96, 48, 0.01, 0.62  # of a dock, its sides' distance and hole in radii
_CHOSEN_OPACITY, _OTHER_OPACITY = 0.9, 0.35
_BLACK_PERCENTILE, _GAMMA = 50.0, 0.6  # of the picture on the picture plane, whose brightest pixel is white
_LIFT, _AROUND, _LIGHT = 90, 1.35, 0.012  # grey around the ring, as far as this of its size; lights, of the width
_AMBIENT = 2.5
_CELLS_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


def grid_cell_m(depth_m: float) -> float:
    """Size of a grid square: about eight to the dock."""
    return next((cell for cell in _CELLS_M if cell >= depth_m / 8), _CELLS_M[-1])


def disc(*, faces_camera: bool) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N, 3) and triangles (M, 3) of one side of a disc of radius 1 with a hole, where the vehicle goes in."""
    rim = circle(_DISC_CORNERS)[:, 0]
    depth = [0.0, 0.0, -_DISC_APART if faces_camera else _DISC_APART]
    first = np.arange(_DISC_CORNERS)
    following, count = np.roll(first, -1), _DISC_CORNERS
    corners = [(first, first + count, following), (following, first + count, following + count)]
    return np.concatenate([rim, _HOLE * rim]) + depth, np.concatenate([np.column_stack(one) for one in corners])


class EstimatedDock:
    """Draws one candidate, solid where it is the chosen one: a disc with its lights and an arrow out of its face."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        path = f"/docks/pose_{name.lower()}"
        self._is_chosen: bool | None = None  # and drawn so
        self.frame = scene.add_frame(path, show_axes=False, visible=False)
        self._ring = add_lines(scene, f"{path}/ring", circle(_RING), colour, 3.0)
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
        self._ring.points = circle(_RING)[np.arange(_RING) % 4 < (4 if is_chosen else 2)]  # or dashed
        self._ring.thickness = 3.0 if is_chosen else 2.0
        self._lights.point_size = 0.08 if is_chosen else 0.06
        self._normal.shaft_radius, self._normal.head_radius = (0.03, 0.09) if is_chosen else (0.015, 0.06)
        for side in self._sides:
            side.opacity = _CHOSEN_OPACITY if is_chosen else _OTHER_OPACITY


class Scene3D:
    """Draws analyses. Nodes are made once and then changed, so that dragging a slider does not flicker."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._pictured: tuple[Any, Any] = None, None
        self._looked_at: str | None = None
        self.drawn: Drawing | None = None
        self._viewpoints = Viewpoints(server)
        self.fit = self._viewpoints.fit
        scene = server.scene
        scene.set_up_direction("-y")
        scene.set_global_visibility(False)  # until a browser has the rest of its page
        scene.configure_default_lights(cast_shadow=False)  # shadows would take half the drawing time
        scene.add_light_ambient("/light", intensity=_AMBIENT)  # a face is as light from every side
        scene.configure_environment_map(None)  # nothing reflects it, and software takes seconds
        self._grid = scene.add_grid(
            "/grid", plane="xz", cell_color=_GREY, cell_thickness=0.5, section_color=_GREY, fade_strength=0.5
        )
        self._grid_label = scene.add_label("/grid/label", "", anchor="bottom-center")
        no_lines = np.zeros((1, 2, 3))
        axes = np.stack([np.zeros((3, 3)), np.eye(3) / 3], axis=1)
        self._axes = add_lines(scene, "/camera/axes", axes, np.repeat(_AXIS_COLOURS[:, None], 2, axis=1), 2.5)
        self._edges = add_lines(scene, "/edges", no_lines, _GREY, 1.5)
        self._rays = add_lines(scene, "/rays", no_lines, _GREY, 0.8)
        self._path = add_lines(scene, "/path", no_lines, rgb(PATH_COLOUR), 2.0)
        self._image: viser.ImageHandle | None = None
        self._docks = scene.add_frame("/docks", show_axes=False)
        self._truth = KnownDock(scene, "truth", rgb(TRUTH_COLOUR))
        self._measured = KnownDock(scene, "measured", rgb(MEASURED_COLOUR))
        self._labels: dict[str, viser.LabelHandle] = {}
        self._poses = [EstimatedDock(scene, *pose) for pose in zip(POSE_NAMES, map(rgb, POSE_COLOURS), strict=True)]

    def show(self, analysis: Analysis) -> None:
        """Draw what was found; called from the worker's thread."""
        found, view = analysis.estimate, analysis.view
        drawn = self.drawn = drawing_of(analysis)
        with self._server.atomic():
            self._show_camera(view, found, drawn)
            self._show_grid(max(float(drawn.everything[:, 1].max()), found.dock.radius), drawn.depth_m)
            self._rays.points, self._path.points = drawn.rays, drawn.path
            self._docks.position = drawn.shift
            for index, dock in enumerate(self._poses):
                dock.show(index, found)
            self._show_labels(drawn.labels)
            self._truth.show(view.truth, found.dock.radius)
            self._measured.show(view.measured_pose, found.dock.radius)
        # While a simulated scene is changed, or a sequence goes on, it is the same one that is looked at.
        looked_at = view.list_name if view.list_name == "sequence" else view.source
        is_other, self._looked_at = self._looked_at != looked_at, looked_at
        self._viewpoints.show(drawn.everything, is_other=is_other)

    def _show_labels(self, placed: dict[str, Label]) -> None:
        for name, label in placed.items():
            if name not in self._labels:
                self._labels[name] = self._server.scene.add_label(f"/labels/{name}", label.text)
            handle = self._labels[name]
            handle.text, handle.position, handle.anchor = label.text, label.position, label.anchor
        for name, handle in self._labels.items():
            handle.visible = name in placed

    def _show_camera(self, view: View, found: Estimate, drawn: Drawing) -> None:
        """Draw the picture on its plane, the plane's edges and the axes."""
        width, height, middle = image_plane(view.camera)
        if self._image is None or self._pictured[0] is not view.image or self._pictured[1] is not found.ring:
            texture = picture_on_plane(view.image, found, _TEXTURE_WIDTH_PX)
            self._image = self._server.scene.add_image("/camera/image", texture, width, height)
            self._pictured = view.image, found.ring
        self._image.render_width, self._image.render_height = width, height
        plane_z = float(drawn.plane[0, 2])
        self._image.position, self._image.scale, self._axes.scale = plane_z * middle, plane_z, plane_z
        following = np.roll(drawn.plane, -1, axis=0)
        edges = np.stack([np.concatenate([0 * following, drawn.plane]), np.tile(following, (2, 1))], axis=1)
        self._edges.points = np.concatenate([edges, drawn.marks])

    def _show_grid(self, floor_y: float, depth_m: float) -> None:
        cell = grid_cell_m(depth_m)
        depth = cell * math.ceil(1.3 * depth_m / cell)
        self._grid.cell_size, self._grid.section_size = cell, 10 * cell
        self._grid.width, self._grid.height = depth, depth
        self._grid.position = (0.0, floor_y, depth / 2 - cell)
        self._grid_label.text = f"grid squares: {100 * cell:g} cm"


def picture_on_plane(image: np.ndarray, found: Estimate, widest_px: int) -> np.ndarray:
    """The picture (H, W, 4) at most so wide, stretched, translucent; bright around the ring, its lights made large."""
    picture = np.ascontiguousarray(to_bgr8(image)[:, :, ::-1])
    height, width = picture.shape[:2]
    scale = min(1.0, widest_px / width)
    size = max(1, round(width * scale)), max(1, round(height * scale))
    around = np.zeros(size[::-1], np.uint8)
    if found.ring is not None and found.markers is not None and found.ring.on_ring.any():
        picture = cv2.dilate(picture, np.ones((max(1, round(width * _LIGHT)),) * 2, np.uint8))
        x_px, y_px = found.markers.points_px[found.ring.on_ring].T
        reach_px = _AROUND * max(np.ptp(x_px), np.ptp(y_px)) / 2
        cv2.circle(around, (round(scale * x_px.mean()), round(scale * y_px.mean())), round(scale * reach_px), 255, -1)
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(float)
    low, high = np.percentile(small, _BLACK_PERCENTILE), small.max()
    shown = 255 * np.clip((small - low) / max(high - low, 1.0), 0, 1) ** _GAMMA
    shown = np.where(around[:, :, None] > 0, _LIFT + (1 - _LIFT / 255) * shown, shown)
    return np.dstack([shown, np.where(around > 0, 255, 255 * _IMAGE_OPACITY)]).astype(np.uint8)
