"""Bundle adjustment over boards: what all pictures share and each board's pose, with standard errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.camera import Camera

STEP = 1e-6  # of the numeric derivatives: metres, radians, or a share of the focal length
_SMALLEST = 1e-100  # length of a derivative; 0 at a limit
_NOTHING = 1e-12  # share of the information that is rounding
_POSE_ROUNDS = 8  # at the most
_SETTLED_PX = 1e-6  # far below the noise of a corner
_ROUNDS, _SETTLED, _LEAST_DAMPING, _MOST_DAMPING = 60, 1e-9, 1e-12, 1e8  # of Levenberg and Marquardt's method


@dataclass(frozen=True)
class Shared:
    """Numbers that all pictures share, and the camera that they make."""

    names: tuple[str, ...]  # their names
    numbers: np.ndarray  # (P,): their values
    steps: np.ndarray  # (P,): steps for the derivatives by each
    camera_of: Callable[[np.ndarray], Camera]  # makes a camera of values (P,)


def residuals(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """Corners as the camera would see the board at a pose (6,), less where they were seen: (N, 2) in pixels."""
    turned = sighting.board_m.astype(float) @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
    return camera.project(turned) - sighting.picture_px


def rms_px(off_px: np.ndarray) -> float:
    """Root mean square length of residuals (N, 2)."""
    return float(np.sqrt((off_px**2).sum(axis=1).mean()))


def slopes(change: Callable[[np.ndarray], np.ndarray], at: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Derivatives (M, P) of a function of P numbers with M values, by central differences."""
    columns = [
        (change(at + step).ravel() - change(at - step).ravel()) / (2 * size)
        for step, size in zip(np.diag(steps), steps, strict=True)
    ]
    return np.column_stack(columns) if columns else np.empty((change(at).size, 0))


def settled_pose(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """The pose (6,) of a board with the least reprojection error, by Gauss-Newton steps from a start near it."""
    for _ in range(_POSE_ROUNDS):
        off = residuals(camera, sighting, pose).ravel()
        J = slopes(lambda each: residuals(camera, sighting, each), pose, np.full(6, STEP))
        if not (np.isfinite(J).all() and np.isfinite(off).all()):
            break
        step = np.linalg.lstsq(J, -off, rcond=None)[0]
        pose = pose + step
        if np.abs(J @ step).max() < _SETTLED_PX:
            break
    return pose


def adjust(sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (P,) and poses (N, 6) with the least squares, by Levenberg and Marquardt's method, poses eliminated."""
    numbers, damping = shared.numbers, 1e-3
    squares, blocks = _blocks(sightings, poses, shared, numbers)
    for _ in range(_ROUNDS):
        step, turns = _step(blocks, damping)
        moved, after = numbers + step, poses + turns
        try:
            reached = _squares(sightings, after, shared.camera_of(moved))
        except ValueError:  # a step to a camera that cannot be
            reached = np.inf
        if not reached < squares:
            damping = max(10 * damping, _LEAST_DAMPING)
            if damping > _MOST_DAMPING:
                break
            continue
        settled = squares - reached < _SETTLED * squares
        numbers, poses, damping = moved, after, max(damping / 10, _LEAST_DAMPING)
        squares, blocks = _blocks(sightings, poses, shared, numbers)
        if settled:
            break
    return numbers, poses


def _squares(sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera) -> float:
    total = sum(float((residuals(camera, each, pose) ** 2).sum()) for each, pose in zip(sightings, poses, strict=True))
    return total if np.isfinite(total) else np.inf


def _blocks(
    sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared, numbers: np.ndarray
) -> tuple[float, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Sum of squares; and for each board residuals, derivatives by the shared numbers and by its pose."""
    camera, blocks = shared.camera_of(numbers), []
    around = [[shared.camera_of(numbers + sign * step) for sign in (1, -1)] for step in np.diag(shared.steps)]
    for sighting, pose in zip(sightings, poses, strict=True):
        changes = [residuals(more, sighting, pose) - residuals(less, sighting, pose) for more, less in around]
        J = np.column_stack([change.ravel() for change in changes]) / (2 * shared.steps)

        def by_pose(each: np.ndarray, sighting: Sighting = sighting) -> np.ndarray:
            return residuals(camera, sighting, each)

        P = slopes(by_pose, pose, np.full(6, STEP))
        blocks.append((np.nan_to_num(by_pose(pose).ravel()), np.nan_to_num(J), np.nan_to_num(P)))
    return sum(float(off @ off) for off, _, _ in blocks), blocks


def _step(blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]], damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Step of the shared numbers (P,) and of the poses (N, 6), by the Schur complement."""
    size = blocks[0][1].shape[1]
    left, right, kept = np.zeros((size, size)), np.zeros(size), []
    for off, J, P in blocks:
        own = P.T @ P
        inverse = np.linalg.pinv(own + damping * np.diag(np.diag(own)), hermitian=True)
        mixed = J.T @ P @ inverse
        left += J.T @ J - mixed @ P.T @ J + damping * np.diag((J**2).sum(axis=0))
        right += J.T @ off - mixed @ (P.T @ off)
        kept.append((inverse, P, J, off))
    step = -np.linalg.lstsq(left, right, rcond=None)[0]
    return step, np.array([-inverse @ (P.T @ (off + J @ step)) for inverse, P, J, off in kept])


@dataclass(frozen=True)
class Sigmas:
    """Standard errors of a fit's numbers."""

    # by name: ``fx``, ``fy``, ``cx``, ``cy`` in pixels, then the coefficients that were fitted
    values: dict[str, float]
    noise_px: float  # standard deviation of a corner along x or y


def sigmas(sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared) -> Sigmas:
    """Standard errors of numbers that all pictures share, with each board's pose free.

    ``poses`` (N, 6).

    Each board's pose is eliminated (Schur complement), which leaves the information of the shared numbers. Errors of
    corners in one picture may be alike (a lens that the model does not quite meet, a bent board), so the errors are
    also computed from the scatter of the pictures' gradients, and the larger of the two is given for each number.

    White 1982, "Maximum likelihood estimation of misspecified models", Econometrica 50.
    """
    squares, blocks = _blocks(sightings, poses, shared, shared.numbers)
    information, lengths2 = np.zeros((len(shared.names),) * 2), np.zeros(len(shared.names))
    gradients, corners = [], 0
    for off, by_numbers, by_pose in blocks:
        J = by_numbers - by_pose @ np.linalg.lstsq(by_pose, by_numbers, rcond=None)[0]
        information += J.T @ J
        lengths2 += (by_numbers**2).sum(axis=0)
        gradients.append(J.T @ off)
        corners += len(off)
    noise = float(np.sqrt(squares / max(1, corners - 6 * len(sightings) - len(shared.names))))
    inverse = _inverse(information, np.sqrt(lengths2))
    U = np.array(gradients)
    scatter = inverse @ (U.T @ U) @ inverse * len(U) / max(1, len(U) - 1)
    deviations = np.sqrt(np.maximum(noise**2 * np.diag(inverse), np.diag(scatter)))
    return Sigmas(dict(zip(shared.names, deviations.tolist(), strict=True)), noise)


def _inverse(information: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Inverse of the information, huge along what the pictures do not tell: what all the poses can make up for.

    ``lengths`` are of the derivatives while the poses are fixed: what they leave of them is compared with.
    """
    scale = np.maximum(lengths, _SMALLEST)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    return (vectors / np.maximum(values, _NOTHING)) @ vectors.T / np.outer(scale, scale)
