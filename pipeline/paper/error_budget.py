"""What a believable tank brings to the errors of the paper's tables: each thing that is known only so well, alone."""

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose.camera.calibrate import Board, Calibration, calibrate_pictures
from dockpose.camera.camera import Camera
from dockpose.camera.port import FRESH_WATER, FlatPort
from dockpose.dock import Dock
from dockpose.paper.scenes import DIAMETER_M
from dockpose.paper.tables import TABLES, tank_picture
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.study.judge import judge_choice

BOARD = Board(10, 7, 0.024)
VIEWS = 25  # "take 20 to 30", say most calibration guides
_RANGE_M = (0.28, 0.40)  # fills half to all of the picture of a camera with 525 px
_TILT_RAD, _ASIDE_M = 0.5, 0.05
_SQUARE_PX = 40  # in the drawing of the board
_NOISE_LEVELS = 2.0
_ROUNDS = 60  # far more than a calibration needs


def rendered_calibration(camera: Camera, seed: int) -> Calibration:
    """Render pictures of a board through a camera's lens, and calibrate from them as ``dockpose calibrate`` does."""
    row, column = np.indices((BOARD.rows, BOARD.columns))
    flat = np.kron(255 * ((row + column) % 2), np.ones((_SQUARE_PX, _SQUARE_PX))).astype(np.uint8)
    drawing = np.pad(flat, _SQUARE_PX, constant_values=255)  # with a white rim of one square
    x, y = np.meshgrid(np.arange(float(camera.width)), np.arange(float(camera.height)))
    lens, focal_px = msgspec.structs.replace(camera, port=None), math.sqrt(camera.fx * camera.fy)
    rays = lens.rays(np.column_stack([x.ravel(), y.ravel()])).reshape(camera.height, camera.width, 3)  # units, in air

    def picture(number: int, rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Look along every pixel's ray at the board, whose drawing is blurred to the sharpness of a pixel."""
        depth = (position @ rotation[:, 2]) / (rays @ rotation[:, 2])
        on_board = (rays * depth[..., None] - position) @ rotation
        warp = (on_board[..., :2] / BOARD.square_m * _SQUARE_PX + _SQUARE_PX - 0.5).astype(np.float32)
        blur = 0.5 * _SQUARE_PX * float(position[2]) / BOARD.square_m / focal_px
        sharp = cv2.GaussianBlur(drawing, (0, 0), blur)
        seen = cv2.remap(sharp, warp[..., 0], warp[..., 1], cv2.INTER_LINEAR, borderValue=90).astype(float)
        noise = np.random.default_rng([seed, 6, number]).normal(0, _NOISE_LEVELS, seen.shape)
        return np.clip(0.7 * seen + 20 + noise, 0, 255).astype(np.uint8)

    poses = enumerate(_board_poses(seed, 0))
    return calibrate_pictures(((f"view {number}", picture(number, *pose)) for number, pose in poses), BOARD)


def calibrations(camera: Camera, count: int, corner_px: float, seed: int) -> list[Camera]:
    """Calibrate a camera again and again by Zhang's way, from other views and other Gaussian errors of the corners."""
    # The numbers of one belong together: its focal length, centre and distortion err in ways that partly cancel.
    column, row = np.meshgrid(np.arange(1, BOARD.columns), np.arange(1, BOARD.rows))
    flat = BOARD.square_m * np.column_stack([column.ravel(), row.ravel(), np.zeros(column.size)])
    lens = msgspec.structs.replace(camera, port=None)
    size, found = (camera.width, camera.height), []
    for number in range(count):
        rng = np.random.default_rng([seed, 4, number])
        views = [
            (lens.project(position + flat @ rotation.T) + rng.normal(0, corner_px, (len(flat), 2))).astype(np.float32)
            for rotation, position in _board_poses(seed, 1 + number)
        ]
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, _ROUNDS, 1e-9)
        model = [flat.astype(np.float32)] * len(views)
        _, K, distortion, _, _ = cv2.calibrateCamera(model, views, size, np.eye(3), np.zeros(5), criteria=criteria)
        coefficients = tuple(np.asarray(distortion).ravel()[:5].tolist())
        fx, fy, cx, cy = K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
        found.append(Camera(fx, fy, cx, cy, *size, coefficients, camera.port))
    return found


def _board_poses(seed: int, number: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rotation and position of the board's corner in each view."""
    rng = np.random.default_rng([seed, 5, number])
    for _ in range(VIEWS):
        rotation = rotation_from_angles(*rng.uniform(-_TILT_RAD, _TILT_RAD, 2))
        middle = np.array([*rng.uniform(-_ASIDE_M, _ASIDE_M, 2), rng.uniform(*_RANGE_M)])
        size = BOARD.square_m * np.array([BOARD.columns, BOARD.rows, 0.0])
        yield rotation, middle - rotation @ (size / 2)


# The ring is as large in the picture as for the tables' pinhole camera of 700 px; the distortion is a webcam's.
CAMERA = Camera(
    *(700 / FRESH_WATER, 700 / FRESH_WATER, 319.5, 239.5, 640, 480),
    distortion=(-0.18, 0.05, 0.0, 0.0, 0.0),
    port=FlatPort(air_gap_m=0.03, glass_m=0.01),
)
OFF_M = 0.001  # standard error of a light's place along and across the ring, of the diameter, and of the air gap
DRAWS, CALIBRATIONS, PICTURES = 30, 100, 6  # a pose; in all; a pose

# Errors of what is believed, each alone; the first four are of the calibration, and not all of them add up.
ITEMS = {
    "intrinsics": "intrinsics of a calibration",
    "distortion": "distortion of a calibration",
    "calibration": "both of these, as they belong together",
    "ignored": "distortion ignored",
    "along": "lights 1 mm off along the ring",
    "across": "lights 1 mm off across the ring",
    "diameter": "diameter off by 1 mm",
    "port": "port's air gap off by 1 mm",
}
TOGETHER = ("calibration", "along", "across", "diameter", "port", "centroids")
# Pictures where all is known, by what their sensor adds.
_NOISY, _EXACT = {"read_noise_levels": 2.0}, {"read_noise_levels": 0.0, "electrons_per_level": 1e12}
PICTURES_OF = {
    "picture without noise": _EXACT,
    "noise of 2 grey levels, and shot noise": _NOISY,
    "JPEG of quality 75": {**_EXACT, "jpeg_quality": 75},
    "noise and JPEG": {**_NOISY, "jpeg_quality": 75},
}


def poses_of_tables() -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Measured poses (12, 5), the paper's signed errors (12, 5) and numbers of lights of all three tables."""
    tables = TABLES.values()
    measured, estimated = (np.vstack([getattr(of, name) for of in tables]) for name in ("measured", "estimated"))
    return measured, estimated - measured, [table.lights for table in tables for _ in table.measured]


def errors_of(
    items: Collection[str], cameras: Sequence[Camera], centroid_px: float, seed: int, camera: Camera = CAMERA
) -> np.ndarray:
    """Signed errors (DRAWS, 12, 5) in cm and degrees where ``items`` are wrong."""
    # ``items`` are of ``ITEMS`` and "centroids"; the draws are the same whichever they are.
    measured, _, lights = poses_of_tables()
    errors = np.empty((DRAWS, len(measured), 5))
    for draw, number in np.ndindex(errors.shape[:2]):
        rng = np.random.default_rng([seed, 7, draw, number])
        position_m, rotation = measured[number, :3] / 100, rotation_from_angles(*np.radians(measured[number, 3:]))
        ring, noise, believed, dock = _draw(rng, items, lights[number], camera, cameras)
        points = camera.project(position_m + ring @ rotation.T) + ("centroids" in items) * centroid_px * noise
        errors[draw, number] = judge_choice(find_poses(points, believed, dock)[1], position_m, -rotation[:, 2])[0]
    return errors * _IN_CM


_IN_CM = np.array([100.0, 100.0, 100.0, 1.0, 1.0])


def _draw(
    rng: np.random.Generator, items: Collection[str], lights: int, camera: Camera, cameras: Sequence[Camera]
) -> tuple[np.ndarray, np.ndarray, Camera, Dock]:
    """Where the lights are (N, 3), noise (N, 2) of one pixel, and the camera and dock as they are believed to be."""
    roll, calibrated = rng.uniform(0, 2 * math.pi), cameras[int(rng.integers(len(cameras)))]
    along, across = rng.normal(0, OFF_M, (2, lights))
    diameter, gap = rng.normal(0, OFF_M), rng.normal(0, OFF_M)
    noise = rng.normal(0, 1, (lights, 2))
    angles = roll + 2 * math.pi * np.arange(lights) / lights + ("along" in items) * along / (DIAMETER_M / 2)
    radii = DIAMETER_M / 2 + ("across" in items) * across
    ring = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(lights)])
    changes: dict[str, Any] = {}
    if {"intrinsics", "calibration"} & set(items):
        changes |= {name: getattr(calibrated, name) for name in ("fx", "fy", "cx", "cy")}
    if {"distortion", "calibration"} & set(items):
        changes["distortion"] = calibrated.distortion
    if "ignored" in items:
        changes["distortion"] = ()
    if "port" in items and camera.port is not None:
        changes["port"] = msgspec.structs.replace(camera.port, air_gap_m=max(0.0, camera.port.air_gap_m + gap))
    believed = msgspec.structs.replace(camera, **changes)
    return ring, noise, believed, Dock(DIAMETER_M + ("diameter" in items) * diameter, lights)


def errors_of_pictures(seed: int, **sensor: Any) -> tuple[np.ndarray, float]:
    """Errors (PICTURES, 12, 5) of rendered pictures, and the root mean square error of a light's x or y in pixels."""
    measured, _, lights = poses_of_tables()
    errors, off_px = np.full((PICTURES, len(measured), 5), np.nan), []
    for draw, number in np.ndindex(errors.shape[:2]):
        dock = Dock(DIAMETER_M, lights[number])
        found, truth = tank_picture(measured[number], dock, [seed, 8, draw, number], CAMERA, **sensor)
        if found.markers is None or found.ring is None or found.choice is None:
            continue
        errors[draw, number] = judge_choice(found.choice, truth.position_m, truth.normal)[0]
        points = found.markers.points_px[found.ring.on_ring]
        away = points[:, None] - truth.lights_px
        closest = np.argmin((away**2).sum(axis=2), axis=1)
        off_px.append(away[np.arange(len(points)), closest].ravel())
    return errors * _IN_CM, float(np.sqrt(np.mean(np.concatenate(off_px) ** 2)))
