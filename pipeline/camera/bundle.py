"""Bundle adjustment over boards: what all pictures share and each board's pose, with standard errors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.camera import Camera
from dockpose.camera.sigma import numbers_of, with_numbers

# Of the numeric derivatives: metres and radians of a pose, shares of the focal length; metres of a port.
STEP, PORT_STEP_M = 1e-6, 1e-5
_SMALLEST = 1e-100  # length of a derivative; 0 at a limit
_NOTHING = 1e-12  # share of the information that is rounding
_SETTLED = 1e-9  # share of the squares by which a step lowers them, below which it was the last
_MOST_STEPS = 60  # a pose that fits takes six, and one that does not would take all of scipy's six hundred
_LOST_PX = 1e6  # residual of a corner that has no image: any other pose is better


def residuals(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """Corners as the camera would see the board at a pose (6,), less where they were seen: (N, 2) in pixels."""
    turned = sighting.board_m.astype(float) @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]
    return camera.project(turned) - sighting.picture_px


def rms_px(off_px: np.ndarray) -> float:
    """Root mean square length of residuals (N, 2)."""
    return float(np.sqrt((off_px**2).sum(axis=1).mean()))


def errors_px(camera: Camera, sightings: Sequence[Sighting], poses: np.ndarray) -> np.ndarray:
    """Root mean square reprojection error (N,) of each board; infinite where a corner has no image."""
    errors = [rms_px(residuals(camera, sighting, pose)) for sighting, pose in zip(sightings, poses, strict=True)]
    return np.nan_to_num(np.array(errors), nan=np.inf)


def _off_px(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """Residuals (2 N,) of corners by their standard error, finite also where a corner has no image."""
    off_px = residuals(camera, sighting, pose).ravel() / sighting.sigma
    return np.nan_to_num(off_px, nan=_LOST_PX, posinf=_LOST_PX, neginf=-_LOST_PX)


def settled_pose(camera: Camera, sighting: Sighting, pose: np.ndarray) -> np.ndarray:
    """The pose (6,) of a board with the least reprojection error, from a start near it."""
    from scipy.optimize import least_squares  # takes half a second to import, which only calibration needs

    return least_squares(lambda each: _off_px(camera, sighting, each), pose, method="lm", max_nfev=_MOST_STEPS).x


def adjust(
    sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (P,) of a camera and poses (N, 6) of least reprojection error, by variable projection (Kaufman 1975)."""
    from scipy.optimize import least_squares

    start = poses.copy()

    @lru_cache(maxsize=1)
    def settled(*numbers: float) -> tuple[Camera, np.ndarray]:
        tried = with_numbers(camera, names, np.array(numbers))
        start[:] = [settled_pose(tried, each, pose) for each, pose in zip(sightings, start, strict=True)]
        return tried, start.copy()

    def off_px(numbers: np.ndarray) -> np.ndarray:
        try:
            tried, there = settled(*numbers.tolist())
        except ValueError:  # a step to a camera that cannot be
            return np.full(2 * sum(len(each.picture_px) for each in sightings), _LOST_PX)
        return np.concatenate([_off_px(tried, *each) for each in zip(sightings, there, strict=True)])

    def by_numbers(numbers: np.ndarray) -> np.ndarray:
        blocks = _blocks(sightings, settled(*numbers.tolist())[1], camera, names, numbers)
        return np.vstack([_beside_pose(J, P) for _, J, P in blocks])

    jac: Any = by_numbers  # which scipy's default value hides from type checkers
    found = least_squares(off_px, numbers_of(camera, names), jac, method="lm", x_scale="jac", ftol=_SETTLED).x
    return found, settled(*found.tolist())[1]


def _blocks(
    sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera, names: Sequence[str], numbers: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """For each board residuals by their standard error, and their slopes by the camera's numbers and by its pose."""
    sizes = [PORT_STEP_M if name.endswith("_m") else STEP * (1 if "[" in name else camera.fx) for name in names]
    around = [[with_numbers(camera, names, numbers + sign * step) for sign in (1, -1)] for step in np.diag(sizes)]
    camera = with_numbers(camera, names, numbers)
    for sighting, pose in zip(sightings, poses, strict=True):
        by_number = [residuals(more, sighting, pose) - residuals(less, sighting, pose) for more, less in around]
        turned = [[residuals(camera, sighting, pose + sign * step) for sign in (1, -1)] for step in STEP * np.eye(6)]
        off = residuals(camera, sighting, pose).ravel()
        J = np.column_stack([change.ravel() for change in by_number]) / (2 * np.array(sizes))
        P = np.column_stack([(more - less).ravel() for more, less in turned]) / (2 * STEP)
        off, J, P = (np.nan_to_num(each / sighting.sigma) for each in (off, J, P))
        yield off, J, P


def _beside_pose(J: np.ndarray, P: np.ndarray) -> np.ndarray:
    """What of derivatives (M, P) by the numbers a board's pose, with derivatives (M, 6), cannot make up for."""
    return J - P @ np.linalg.lstsq(P, J, rcond=None)[0]


@dataclass(frozen=True)
class Sigmas:
    """Standard errors of a fit's numbers."""

    # By name: ``fx``, ``fy``, ``cx``, ``cy`` in pixels, then coefficients; or a port's lengths in metres.
    values: dict[str, float]
    covariance: np.ndarray  # (P, P): of these numbers, in their order
    noise_px: float  # standard deviation of a corner along x or y


def sigmas(
    sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera, names: Sequence[str], numbers: np.ndarray
) -> Sigmas:
    """Standard errors, poses free: the larger of those by residuals and by the gradients' scatter (White 1982)."""
    information, lengths2, squares = np.zeros((len(names),) * 2), np.zeros(len(names)), 0.0
    gradients, corners = [], 0
    for off, by_numbers, by_pose in _blocks(sightings, poses, camera, names, numbers):
        J = _beside_pose(by_numbers, by_pose)
        information += J.T @ J
        lengths2 += (by_numbers**2).sum(axis=0)
        squares += float(off @ off)
        gradients.append(J.T @ off)
        corners += len(off)
    noise = float(np.sqrt(squares / max(1, corners - 6 * len(sightings) - len(names))))
    inverse = _inverse(information, np.sqrt(lengths2))
    U = np.array(gradients)
    scatter = inverse @ (U.T @ U) @ inverse * len(U) / max(1, len(U) - 1)
    deviations = np.sqrt(np.maximum(noise**2 * np.diag(inverse), np.diag(scatter)))
    larger = deviations / np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    return Sigmas(dict(zip(names, deviations.tolist(), strict=True)), inverse * np.outer(larger, larger), noise)


def _inverse(information: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Inverse of the information; huge along what the poses can make up for, by the derivatives' ``lengths`` (P,)."""
    scale = np.maximum(lengths, _SMALLEST)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    return (vectors / np.maximum(values, _NOTHING)) @ vectors.T / np.outer(scale, scale)
