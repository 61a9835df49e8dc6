"""What a believable tank brings to the errors of the paper's tables: each thing that is known only so well, alone."""

import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose.camera.calibrate import Board, Calibration, calibrate
from dockpose.camera.camera import Camera
from dockpose.camera.port import FRESH_WATER, FlatPort
from dockpose.dock import Dock
from dockpose.estimate import estimate
from dockpose.paper.tables import DIAMETER_M, TABLES, numbers_of, tank_scene
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.simulate import Sensor, render
from dockpose.study.judge import nearest

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
    with _one_thread():
        return calibrate(((f"view {number}", picture(number, *pose)) for number, pose in poses), BOARD)


def calibrations(camera: Camera, count: int, corner_px: float, seed: int) -> list[Camera]:
    """Calibrate a camera again and again by Zhang's way, from other views and other Gaussian errors of the corners."""
    # The numbers of one belong together: its focal length, centre and distortion err in ways that partly cancel.
    columns, rows = BOARD.columns - 1, BOARD.rows - 1
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    flat = BOARD.square_m * np.column_stack([column.ravel() + 1, row.ravel() + 1, np.zeros(column.size)])
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
        with _one_thread():
            _, K, distortion, _, _ = cv2.calibrateCamera(model, views, size, np.eye(3), np.zeros(5), criteria=criteria)
        numbers = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
        coefficients = tuple(np.asarray(distortion).ravel()[:5].tolist())
        found.append(Camera(*numbers, *size, distortion=coefficients, port=camera.port))
    return found


@contextmanager
def _one_thread() -> Iterator[None]:
    """OpenCV's threads add up the same numbers in another order each time, which changes the last digits."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


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
MISPLACED_M, DIAMETER_OFF_M, PORT_OFF_M = 0.001, 0.001, 0.001
READ_NOISE_LEVELS, JPEG_QUALITY = 2.0, 75
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
_PICTURES = {
    "quiet": Sensor(read_noise_levels=0.0, electrons_per_level=1e12),
    "noise": Sensor(read_noise_levels=READ_NOISE_LEVELS),
    "jpeg": Sensor(read_noise_levels=0.0, electrons_per_level=1e12, jpeg_quality=JPEG_QUALITY),
    "both": Sensor(read_noise_levels=READ_NOISE_LEVELS, jpeg_quality=JPEG_QUALITY),
}


@dataclass(frozen=True)
class Budget:
    """Signed errors, in centimetres and degrees, of the poses of Tables 2 to 4 in turn."""

    items: dict[str, np.ndarray]  # (draws, 12, 5) by what is off: the keys of ``ITEMS``
    pictures: dict[str, np.ndarray]  # (pictures, 12, 5) where all is known: "quiet", with "noise", "jpeg", or "both"
    together: np.ndarray  # (draws, 12, 5): with all of ``TOGETHER`` at once
    right: float  # share in which the right one of the two poses was chosen, with all at once
    centroid_px: float  # root mean square error of a light's x or y in the pictures with noise and JPEG
    corner_px: float  # root mean square error of a corner's x or y in the rendered calibration
    cameras: Sequence[Camera]  # the calibrated cameras


def poses_of_tables() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measured poses (12, 5), the paper's signed errors (12, 5) and numbers of lights (12,) of all three tables."""
    measured = np.vstack([table.measured for table in TABLES.values()])
    estimated = np.vstack([table.estimated for table in TABLES.values()])
    lights = np.concatenate([[table.lights] * len(table.measured) for table in TABLES.values()])
    return measured, estimated - measured, lights


def reading_steps() -> np.ndarray:
    """Steps (5,) in which the measured values are printed: centimetres and degrees."""
    measured = poses_of_tables()[0]
    cm, deg = (
        next(step for step in (1.0, 0.5, 0.1) if np.allclose(group / step, np.rint(group / step)))
        for group in (measured[:, :3], measured[:, 3:])
    )
    return np.array([cm, cm, cm, deg, deg])


def error_budget(seed: int) -> Budget:
    """Measure the budget; half a minute of computing."""
    corner_px = rendered_calibration(CAMERA, seed).error_px / math.sqrt(2)
    cameras = calibrations(CAMERA, CALIBRATIONS, corner_px, seed)
    pictures = {name: _of_pictures(sensor, seed) for name, sensor in _PICTURES.items()}
    centroid_px = pictures["both"][1]
    items = {name: errors_of((name,), cameras, centroid_px, seed)[0] for name in ITEMS}
    together, right = errors_of(TOGETHER, cameras, centroid_px, seed)
    found = {name: errors for name, (errors, _) in pictures.items()}
    return Budget(items, found, together, right, centroid_px, corner_px, cameras)


def errors_of(
    items: Collection[str],
    cameras: Sequence[Camera],
    centroid_px: float,
    seed: int,
    camera: Camera = CAMERA,
    draws: int = DRAWS,
) -> tuple[np.ndarray, float]:
    """Signed errors (draws, 12, 5) in cm and degrees where ``items`` are wrong, and the share of right choices."""
    # ``items`` are of ``ITEMS`` and "centroids"; the draws are the same whichever they are.
    measured, _, lights = poses_of_tables()
    errors, right = np.empty((draws, len(measured), 5)), 0
    for draw in range(draws):
        for number, row in enumerate(measured):
            rng = np.random.default_rng([seed, 7, draw, number])
            points, believed, dock = _draw(rng, items, row, int(lights[number]), camera, cameras, centroid_px)
            choice = find_poses(points, believed, dock)[1]
            best = nearest(choice.candidates, -rotation_from_angles(*np.radians(row[3:]))[:, 2])
            errors[draw, number] = np.array(numbers_of(best)) - row
            right += best is choice.candidates[choice.selected]
    return errors, right / (draws * len(measured))


def _draw(
    rng: np.random.Generator,
    items: Collection[str],
    row: np.ndarray,
    lights: int,
    camera: Camera,
    cameras: Sequence[Camera],
    centroid_px: float,
) -> tuple[np.ndarray, Camera, Dock]:
    """Where the lights are seen, and the camera and dock as they are believed to be."""
    roll, calibrated = rng.uniform(0, 2 * math.pi), cameras[int(rng.integers(len(cameras)))]
    along, across = rng.normal(0, MISPLACED_M, (2, lights))
    diameter, gap = rng.normal(0, DIAMETER_OFF_M), rng.normal(0, PORT_OFF_M)
    noise = rng.normal(0, centroid_px, (lights, 2))
    angles = roll + 2 * math.pi * np.arange(lights) / lights + ("along" in items) * along / (DIAMETER_M / 2)
    radii = DIAMETER_M / 2 + ("across" in items) * across
    ring = radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(lights)])
    points = camera.project(row[:3] / 100 + ring @ rotation_from_angles(*np.radians(row[3:])).T)
    points = points + ("centroids" in items) * noise
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
    return points, believed, Dock(DIAMETER_M + ("diameter" in items) * diameter, lights)


def _of_pictures(sensor: Sensor, seed: int) -> tuple[np.ndarray, float]:
    """Errors (pictures, 12, 5) of rendered pictures, and the root mean square error of a light's x or y in pixels."""
    measured, _, lights = poses_of_tables()
    errors, off_px = np.full((PICTURES, len(measured), 5), np.nan), []
    for draw in range(PICTURES):
        for number, row in enumerate(measured):
            rng = np.random.default_rng([seed, 8, draw, number])
            dock = Dock(DIAMETER_M, int(lights[number]))
            scene = tank_scene(row, dock, rng.uniform(0, 360), int(rng.integers(1 << 30)), CAMERA)
            image, truth = render(msgspec.structs.replace(scene, sensor=sensor))
            found = estimate(image, CAMERA, dock)
            if found.markers is None or found.ring is None or not found.candidates:
                continue
            errors[draw, number] = np.array(numbers_of(nearest(found.candidates, truth.normal))) - row
            points = found.markers.points_px[found.ring.on_ring]
            away = points[:, None] - truth.lights_px
            closest = np.argmin((away**2).sum(axis=2), axis=1)
            off_px.append(away[np.arange(len(points)), closest].ravel())
    return errors, float(np.sqrt(np.mean(np.concatenate(off_px) ** 2)))
