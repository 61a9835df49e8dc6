"""Lens models: directions to image points and back, in units of the focal length."""

import math
from functools import lru_cache

import cv2
import numpy as np
from numpy.polynomial.polynomial import polyval

_NEWTON_STEPS = 40
_CLOSE_ENOUGH = 1e-13
_LONGEST_STEP = 0.5
_STEEPEST = 1e3  # steeper rays of a fisheye lens are clamped to this tangent in a pinhole picture


def bend(directions: np.ndarray, coefficients: tuple[float, ...], fisheye: bool) -> np.ndarray:
    """Image points (N, 2) of directions (N, 3), in focal lengths; NaN outside the lens' view."""
    if fisheye:
        return _bend_fisheye(directions, coefficients)
    image = np.full((len(directions), 2), np.nan)
    in_front = directions[:, 2] > 0
    if in_front.any():
        tangents = directions[in_front, :2] / directions[in_front, 2:]
        image[in_front] = _distort(tangents, coefficients)[0] if any(coefficients) else tangents
    return image


def straighten(image: np.ndarray, coefficients: tuple[float, ...], fisheye: bool) -> np.ndarray:
    """Directions (N, 3) of image points (N, 2), in focal lengths; out of reach the last with an image."""
    if fisheye:
        return _straighten_fisheye(image, coefficients)
    tangents = image if not any(coefficients) else _undistort(image, coefficients)
    return np.column_stack([tangents, np.ones(len(tangents))])


def tangents_of(directions: np.ndarray) -> np.ndarray:
    """Where a pinhole would see directions (N, 3): (N, 2) in focal lengths, clamped to 89.9 degrees off the axis."""
    sideways = np.hypot(directions[:, 0], directions[:, 1])
    forward = np.maximum(directions[:, 2], sideways / _STEEPEST)
    return directions[:, :2] / np.maximum(forward, np.finfo(float).tiny)[:, None]


def _distort(tangents: np.ndarray, coefficients: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV's distortion of points (N, 2), and its derivatives (N, 2, 2)."""
    points = np.column_stack([tangents, np.ones(len(tangents))])[:, None]
    zero, unit = np.zeros(3), np.eye(3)
    image, jacobian = cv2.projectPoints(points, zero, zero, unit, np.array(coefficients, dtype=float))
    # Columns 3 and 4, the derivatives by the camera's x and y position, equal those by the point's.
    return image[:, 0], jacobian[:, 3:5].reshape(-1, 2, 2)


def _undistort(image: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """Invert :func:`_distort` by Newton's method, which from the distorted point never overshoots."""
    tangents = image.copy()
    for _ in range(_NEWTON_STEPS):
        reached, slopes = _distort(tangents, coefficients)
        missing = image - reached
        rising = np.linalg.det(slopes) > 1e-6
        if not rising.any():
            break
        step = np.zeros_like(tangents)
        step[rising] = np.linalg.solve(slopes[rising], missing[rising, :, None])[..., 0]
        length = np.hypot(step[:, 0], step[:, 1])
        tangents += step * np.minimum(1, _LONGEST_STEP / np.maximum(length, _LONGEST_STEP))[:, None]
        if length.max() < _CLOSE_ENOUGH:
            break
    return tangents


def _polynomial(theta: np.ndarray, coefficients: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Distance from the principal point, theta (1 + k1 theta^2 + ... + k4 theta^8), and its slope."""
    squared, terms = theta * theta, np.array((1.0, *coefficients))
    return theta * polyval(squared, terms), polyval(squared, (2 * np.arange(len(terms)) + 1) * terms)


@lru_cache(maxsize=64)
def widest_rad(coefficients: tuple[float, ...]) -> float:
    """Angle off the axis, at most pi, up to which the polynomial of a fisheye lens grows."""
    falling = [(2 * power + 1) * k for power, k in enumerate((1.0, *coefficients))]
    roots = np.roots(falling[::-1])
    real = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    return min([math.pi, *np.sqrt(real)])


def _bend_fisheye(directions: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    """OpenCV's fisheye model: equidistant, with a polynomial of the angle off the axis (Kannala and Brandt 2006)."""
    sideways = np.hypot(directions[:, 0], directions[:, 1])
    theta = np.arctan2(sideways, directions[:, 2])
    distance = np.where(theta < widest_rad(coefficients), _polynomial(theta, coefficients)[0], np.nan)
    scale = distance / np.maximum(sideways, np.finfo(float).tiny)
    return directions[:, :2] * scale[:, None]


def _straighten_fisheye(image: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    distance = np.hypot(image[:, 0], image[:, 1])
    low, high = np.zeros_like(distance), np.full_like(distance, widest_rad(coefficients))
    theta = np.minimum(distance, high)
    for _ in range(_NEWTON_STEPS):  # Newton's method, with bisection where a step would leave the bracket
        value, slope = _polynomial(theta, coefficients)
        short = value < distance
        low, high = np.where(short, theta, low), np.where(short, high, theta)
        step = (distance - value) / np.where(slope > 0, slope, 1.0)
        target = theta + step
        inside = (slope > 0) & (target >= low) & (target <= high)
        theta = np.where(inside, target, (low + high) / 2)
        if np.abs(step).max(initial=0.0) < _CLOSE_ENOUGH:
            break
    sideways = np.sin(theta) / np.maximum(distance, np.finfo(float).tiny)
    return np.column_stack([image * sideways[:, None], np.cos(theta)])
