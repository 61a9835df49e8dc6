"""How well a usual calibration knows a camera: chessboard pictures rendered, found and calibrated, many times over."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import msgspec
import numpy as np
from dockpose.camera.calibrate import Board, Calibration, calibrate
from dockpose.camera.camera import Camera
from dockpose.pose.circle import rotation_from_angles

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
    pictures = (
        (f"view {number}", _picture(drawing, rays, pose, focal_px, np.random.default_rng([seed, 6, number])))
        for number, pose in enumerate(_board_poses(seed, 0))
    )
    with _one_thread():
        return calibrate(pictures, BOARD)


def calibrations(camera: Camera, count: int, corner_px: float, seed: int) -> list[Camera]:
    """Calibrate a camera again and again by Zhang's way, from other views and other Gaussian errors of the corners.

    The numbers of one belong together: its focal length, centre and distortion err in ways that partly cancel.
    """
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


def _picture(
    drawing: np.ndarray,
    rays: np.ndarray,
    pose: tuple[np.ndarray, np.ndarray],
    focal_px: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """Look along every pixel's ray at the board, whose drawing is blurred to the sharpness of a pixel."""
    rotation, position = pose
    depth = (position @ rotation[:, 2]) / (rays @ rotation[:, 2])
    on_board = (rays * depth[..., None] - position) @ rotation
    warp = (on_board[..., :2] / BOARD.square_m * _SQUARE_PX + _SQUARE_PX - 0.5).astype(np.float32)
    blur = 0.5 * _SQUARE_PX * float(position[2]) / BOARD.square_m / focal_px
    sharp = cv2.GaussianBlur(drawing, (0, 0), blur)
    seen = cv2.remap(sharp, warp[..., 0], warp[..., 1], cv2.INTER_LINEAR, borderValue=90).astype(float)
    return np.clip(0.7 * seen + 20 + rng.normal(0, _NOISE_LEVELS, seen.shape), 0, 255).astype(np.uint8)
