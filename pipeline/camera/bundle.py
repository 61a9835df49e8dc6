"""Bundle adjustment over boards: what all pictures share and each board's pose, with standard errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.camera import Camera

STEP = 1e-6  # of the numeric derivatives: metres, radians, or a share of the focal length
_SMALLEST = 1e-100  # length of a derivative; 0 at a limit
_NOTHING = 1e-12  # share of the information that is rounding
_SETTLED = 1e-9  # share of the squares by which a step lowers them, below which it was the last
_MOST_STEPS = 60  # a pose that fits takes six, and one that does not would take all of scipy's six hundred
_LOST_PX = 1e6  # residual of a corner that has no image: any other pose is better


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


def _off_px(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """Residuals (2 N,) of corners by their standard error, finite also where a corner has no image."""
    off_px = residuals(camera, sighting, pose).ravel() / sighting.sigma
    return np.nan_to_num(off_px, nan=_LOST_PX, posinf=_LOST_PX, neginf=-_LOST_PX)


def settled_pose(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """The pose (6,) of a board with the least reprojection error, from a start near it."""
    from scipy.optimize import least_squares  # takes half a second to import, which only calibration needs

    return least_squares(lambda each: _off_px(camera, sighting, each), pose, method="lm", max_nfev=_MOST_STEPS).x


def adjust(sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (P,) and poses (N, 6) with the least reprojection error, by variable projection (Kaufman 1975)."""
    from scipy.optimize import least_squares

    start = poses.copy()

    @lru_cache(maxsize=1)
    def settled(*numbers: float) -> tuple[Camera, np.ndarray]:
        camera = shared.camera_of(np.array(numbers))
        start[:] = [settled_pose(camera, each, pose) for each, pose in zip(sightings, start, strict=True)]
        return camera, start.copy()

    def off_px(numbers: np.ndarray) -> np.ndarray:
        try:
            camera, there = settled(*numbers.tolist())
        except ValueError:  # a step to a camera that cannot be
            return np.full(2 * sum(len(each.picture_px) for each in sightings), _LOST_PX)
        return np.concatenate([_off_px(camera, *each) for each in zip(sightings, there, strict=True)])

    def by_numbers(numbers: np.ndarray) -> np.ndarray:
        _, blocks = _blocks(sightings, settled(*numbers.tolist())[1], shared, numbers)
        return np.vstack([_beside_pose(J, P) for _, J, P in blocks])

    jac: Any = by_numbers  # which scipy's default value hides from type checkers
    found = least_squares(off_px, shared.numbers, jac, method="lm", x_scale="jac", ftol=_SETTLED).x
    return found, settled(*found.tolist())[1]


def _blocks(
    sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared, numbers: np.ndarray
) -> tuple[float, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    """Sum of squares; and for each board residuals by their standard error, their slopes by numbers and by its pose."""
    camera, blocks = shared.camera_of(numbers), []
    around = [[shared.camera_of(numbers + sign * step) for sign in (1, -1)] for step in np.diag(shared.steps)]
    for sighting, pose in zip(sightings, poses, strict=True):
        changes = [residuals(more, sighting, pose) - residuals(less, sighting, pose) for more, less in around]
        J = np.column_stack([change.ravel() for change in changes]) / (2 * shared.steps * sighting.sigma)

        def by_pose(each: np.ndarray, sighting: Sighting = sighting) -> np.ndarray:
            return residuals(camera, sighting, each) / sighting.sigma

        P = slopes(by_pose, pose, np.full(6, STEP))
        blocks.append((np.nan_to_num(by_pose(pose).ravel()), np.nan_to_num(J), np.nan_to_num(P)))
    return sum(float(off @ off) for off, _, _ in blocks), blocks


def _beside_pose(J: np.ndarray, P: np.ndarray) -> np.ndarray:
    """What of derivatives (M, P) by the numbers a board's pose, with derivatives (M, 6), cannot make up for."""
    return J - P @ np.linalg.lstsq(P, J, rcond=None)[0]


@dataclass(frozen=True)
class Sigmas:
    """Standard errors of a fit's numbers."""

    # by name: ``fx``, ``fy``, ``cx``, ``cy`` in pixels, then the coefficients that were fitted
    values: dict[str, float]
    covariance: np.ndarray  # (P, P): of these numbers, in their order
    noise_px: float  # standard deviation of a corner along x or y


def sigmas(sightings: Sequence[Sighting], poses: np.ndarray, shared: Shared) -> Sigmas:
    """Standard errors, poses free: the larger of those by residuals and by the gradients' scatter (White 1982)."""
    squares, blocks = _blocks(sightings, poses, shared, shared.numbers)
    information, lengths2 = np.zeros((len(shared.names),) * 2), np.zeros(len(shared.names))
    gradients, corners = [], 0
    for off, by_numbers, by_pose in blocks:
        J = _beside_pose(by_numbers, by_pose)
        information += J.T @ J
        lengths2 += (by_numbers**2).sum(axis=0)
        gradients.append(J.T @ off)
        corners += len(off)
    noise = float(np.sqrt(squares / max(1, corners - 6 * len(sightings) - len(shared.names))))
    inverse = _inverse(information, np.sqrt(lengths2))
    U = np.array(gradients)
    scatter = inverse @ (U.T @ U) @ inverse * len(U) / max(1, len(U) - 1)
    deviations = np.sqrt(np.maximum(noise**2 * np.diag(inverse), np.diag(scatter)))
    larger = deviations / np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    values = dict(zip(shared.names, deviations.tolist(), strict=True))
    return Sigmas(values, inverse * np.outer(larger, larger), noise)


def _inverse(information: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Inverse of the information; huge along what the poses can make up for, by the derivatives' ``lengths`` (P,)."""
    scale = np.maximum(lengths, _SMALLEST)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    return (vectors / np.maximum(values, _NOTHING)) @ vectors.T / np.outer(scale, scale)
