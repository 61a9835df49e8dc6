"""The ellipse through the lights: direct least-squares fit, and conic coefficients <-> parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.checks import as_points

MIN_POINTS = 5


class NoEllipseError(ValueError):
    """The points do not determine an ellipse; the text says why."""


@dataclass(frozen=True)
class Ellipse:
    """An ellipse in a picture, in pixels.

    Attributes
    ----------
    conic : (6,) coefficients A..F of A x^2 + B x y + C y^2 + D x + E y + F = 0, negative inside, of unit norm.
    centre_px : (x, y).
    semi_axes_px : (major, minor).
    angle_rad : from the x axis to the major axis towards y, in (-pi/2, pi/2].
    rms_px : root mean square distance (first order, Sampson 1982) of the points it was fitted to; 0 where it was not.
    """

    conic: np.ndarray
    centre_px: tuple[float, float]
    semi_axes_px: tuple[float, float]
    angle_rad: float
    rms_px: float = 0.0

    @property
    def eccentricity(self) -> float:
        """Zero for a circle, towards 1 for a line."""
        major, minor = self.semi_axes_px
        return math.sqrt(max(0.0, 1 - (minor / major) ** 2))

    @property
    def matrix(self) -> np.ndarray:
        """The symmetric 3 x 3 matrix of the conic."""
        return conic_matrix(self.conic)

    def points(self, count: int = 180) -> np.ndarray:
        """Return ``count`` points (count, 2) around the ellipse, in pixels."""
        t = np.linspace(0, 2 * np.pi, count, endpoint=False)
        cos, sin = math.cos(self.angle_rad), math.sin(self.angle_rad)
        along, across = self.semi_axes_px[0] * np.cos(t), self.semi_axes_px[1] * np.sin(t)
        x = self.centre_px[0] + along * cos - across * sin
        y = self.centre_px[1] + along * sin + across * cos
        return np.column_stack([x, y])

    def distances(self, points_px: Any) -> np.ndarray:
        """First-order distances (N,) in pixels of points (N, 2) from the ellipse (Sampson 1982)."""
        return sampson_distances(self.conic, as_points("points_px", points_px, 2))


def conic_matrix(conic: np.ndarray) -> np.ndarray:
    """Symmetric 3 x 3 matrix [[A, B/2, D/2], [B/2, C, E/2], [D/2, E/2, F]] of conic coefficients (6,)."""
    A, B, C, D, E, F = conic
    return np.array([[A, B / 2, D / 2], [B / 2, C, E / 2], [D / 2, E / 2, F]])


def conic_coefficients(matrix: np.ndarray) -> np.ndarray:
    """Coefficients (6,) of a symmetric 3 x 3 conic matrix."""
    m = matrix
    return np.array([m[0, 0], 2 * m[0, 1], m[1, 1], 2 * m[0, 2], 2 * m[1, 2], m[2, 2]])


def fit_ellipse(points_px: Any) -> Ellipse:
    """Fit an ellipse to five or more points by direct least squares.

    Parameters
    ----------
    points_px : (N, 2) points in pixels.

    Raises
    ------
    NoEllipseError
        if there are fewer than five different points, or they lie on a line, or no ellipse runs through them.

    Notes
    -----
    Halir and Flusser 1998, "Numerically stable direct least squares fitting of ellipses": minimises the algebraic
    distance under 4AC - B^2 = 1. The points are centred and scaled first, so that pixels far from the origin lose
    no precision; the fit itself does not change under an affine map.
    """
    points = as_points("points_px", points_px, 2)
    if not np.isfinite(points).all():
        raise NoEllipseError("a point is not finite")
    different = len(np.unique(points, axis=0))
    if different < MIN_POINTS:
        raise NoEllipseError(f"an ellipse needs {MIN_POINTS} different points, there are {different}")
    origin = points.mean(axis=0)
    scale = np.sqrt(((points - origin) ** 2).sum(axis=1).mean())
    unit_conic = _halir_flusser((points - origin) / scale)
    to_unit = np.array([[1, 0, -origin[0]], [0, 1, -origin[1]], [0, 0, scale]]) / scale
    ellipse = ellipse_from_conic(conic_coefficients(to_unit.T @ conic_matrix(unit_conic) @ to_unit))
    rms = float(np.sqrt(np.mean(ellipse.distances(points) ** 2)))
    return Ellipse(ellipse.conic, ellipse.centre_px, ellipse.semi_axes_px, ellipse.angle_rad, rms)


def ellipse_from_conic(conic: Any) -> Ellipse:
    """Return the ellipse with conic coefficients A..F (6,). Raises NoEllipseError where they are no real ellipse."""
    matrix = conic_matrix(np.asarray(conic, dtype=float))
    if not np.isfinite(matrix).all():
        raise NoEllipseError("a coefficient of the conic is not finite")
    quadratic = matrix[:2, :2]
    if np.linalg.det(quadratic) <= 0:
        raise NoEllipseError("the points lie on a hyperbola or a parabola, not on an ellipse")
    centre = np.linalg.solve(quadratic, -matrix[:2, 2])
    value_at_centre = matrix[2, 2] + matrix[:2, 2] @ centre
    sign = 1.0 if np.trace(quadratic) > 0 else -1.0
    if sign * value_at_centre >= 0:
        raise NoEllipseError("no point of the plane lies on this ellipse")
    eigenvalues, axes = np.linalg.eigh(sign * quadratic)
    major, minor = np.sqrt(-sign * value_at_centre / eigenvalues)
    angle = math.atan2(axes[1, 0], axes[0, 0])
    angle = angle - math.pi * math.ceil(angle / math.pi - 0.5)
    coefficients = sign * np.asarray(conic, dtype=float)
    return Ellipse(
        conic=coefficients / np.linalg.norm(coefficients),
        centre_px=(float(centre[0]), float(centre[1])),
        semi_axes_px=(float(major), float(minor)),
        angle_rad=angle,
    )


def sampson_distances(conic: np.ndarray, points: np.ndarray) -> np.ndarray:
    """First-order distances (N,) of points (N, 2) from a conic (6,): |value| / |gradient| (Sampson 1982)."""
    x, y = points[:, 0], points[:, 1]
    A, B, C, D, E, F = conic
    value = A * x * x + B * x * y + C * y * y + D * x + E * y + F
    gradient = np.hypot(2 * A * x + B * y + D, B * x + 2 * C * y + E)
    return np.abs(value) / np.maximum(gradient, np.finfo(float).tiny)


def _halir_flusser(points: np.ndarray) -> np.ndarray:
    """Conic coefficients of centred and scaled points (Halir and Flusser 1998, section 4)."""
    x, y = points[:, 0], points[:, 1]
    quadratic = np.column_stack([x * x, x * y, y * y])
    linear = np.column_stack([x, y, np.ones_like(x)])
    S1, S2, S3 = quadratic.T @ quadratic, quadratic.T @ linear, linear.T @ linear
    if np.linalg.cond(S3) > 1e12:
        raise NoEllipseError("the points lie on a line")
    T = -np.linalg.solve(S3, S2.T)
    M = S1 + S2 @ T
    reduced = np.array([M[2] / 2, -M[1], M[0] / 2])
    eigenvalues, eigenvectors = np.linalg.eig(reduced)
    vectors = np.real(eigenvectors)
    constraint = 4 * vectors[0] * vectors[2] - vectors[1] ** 2
    is_ellipse = (constraint > 0) & (np.abs(np.imag(eigenvalues)) < 1e-9 * np.abs(eigenvalues).max())
    if not is_ellipse.any():
        raise NoEllipseError("no ellipse runs through the points")
    best = np.flatnonzero(is_ellipse)[np.argmin(np.abs(eigenvalues[is_ellipse]))]
    return np.concatenate([vectors[:, best], T @ vectors[:, best]])
