"""The ellipse through the lights: direct least-squares fit, and conversion of conic coefficients to parameters."""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from dockpose.checks import as_points
from dockpose.compiled import compiled

MIN_POINTS = 5  # a conic has five degrees of freedom
_PARTIAL = 0.5  # distance from the points' mean to the ellipse's centre, in semi-axes: 0.64 for half of it, 0 for all


class NoEllipseError(ValueError):
    """The points do not determine an ellipse; the text says why."""


@dataclass(frozen=True)
class Ellipse:
    """An ellipse in a picture, in pixels.

    Attributes
    ----------
    conic : (6,) float array
        Coefficients A..F of A x^2 + B x y + C y^2 + D x + E y + F = 0, negative inside, of unit norm.
    centre_px : (float, float), pixels
        Centre (x, y).
    semi_axes_px : (float, float), pixels
        Semi-major and semi-minor axis.
    angle_rad : float, radians
        Angle from the x axis to the major axis, towards y, in (-pi/2, pi/2].
    rms_px : float, pixels
        Root mean square distance (first order, Sampson 1982) of the points it was fitted to; 0 if it was not fitted.
    """

    conic: np.ndarray
    centre_px: tuple[float, float]
    semi_axes_px: tuple[float, float]
    angle_rad: float
    rms_px: float = 0.0

    @property
    def eccentricity(self) -> float:
        """0 for a circle, approaching 1 for a line."""
        major, minor = self.semi_axes_px
        return math.sqrt(max(0.0, 1 - (minor / major) ** 2))

    @property
    def matrix(self) -> np.ndarray:
        """The symmetric 3 x 3 matrix of the conic."""
        A, B, C, D, E, F = self.conic
        return np.array([[A, B / 2, D / 2], [B / 2, C, E / 2], [D / 2, E / 2, F]])

    def points(self, count: int = 180) -> np.ndarray:
        """Return ``count`` points (count, 2) around the ellipse, in pixels."""
        t = np.linspace(0, 2 * np.pi, count, endpoint=False)
        cos, sin = math.cos(self.angle_rad), math.sin(self.angle_rad)
        along, across = self.semi_axes_px[0] * np.cos(t), self.semi_axes_px[1] * np.sin(t)
        x = self.centre_px[0] + along * cos - across * sin
        y = self.centre_px[1] + along * sin + across * cos
        return np.column_stack([x, y])

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names; angles in degrees."""
        return {
            "centre_px": list(self.centre_px),
            "semi_axes_px": list(self.semi_axes_px),
            "angle_deg": math.degrees(self.angle_rad),
            "eccentricity": self.eccentricity,
            "rms_px": self.rms_px,
        }

    def distances(self, points_px: Any) -> np.ndarray:
        """First-order distances (N,) in pixels of points (N, 2) from the ellipse (Sampson 1982)."""
        points = np.ascontiguousarray(as_points("points_px", points_px, 2))
        return np.sqrt(_squared_distances(self.conic, points))


def fit_ellipse(points_px: Any) -> Ellipse:
    """Fit an ellipse to five or more points by least squares (Halir and Flusser 1998).

    Parameters
    ----------
    points_px : (N, 2) array_like, pixels
        Points on the ellipse.

    Returns
    -------
    Ellipse
        The ellipse and the root mean square distance of the points from it.

    Raises
    ------
    NoEllipseError
        If there are fewer than five distinct points, they lie on a line, or no ellipse passes through them.

    Examples
    --------
    >>> import numpy as np
    >>> angles = np.radians([0, 60, 120, 180, 240, 300])
    >>> ring = np.column_stack([320 + 100 * np.cos(angles), 240 + 50 * np.sin(angles)])
    >>> ellipse = fit_ellipse(ring)
    >>> [round(value, 3) for value in (*ellipse.centre_px, *ellipse.semi_axes_px)]
    [320.0, 240.0, 100.0, 50.0]
    >>> round(ellipse.eccentricity, 3)
    0.866
    """
    points = np.ascontiguousarray(as_points("points_px", points_px, 2))
    if not np.isfinite(points).all():
        raise NoEllipseError("a point is not finite")
    different = _different(points[: 2 * MIN_POINTS])
    if different < MIN_POINTS and (different := _different(points)) < MIN_POINTS:
        raise NoEllipseError(f"an ellipse needs {MIN_POINTS} different points, there are {different}")
    x, y, scale, normalised = _normalised(points)  # pixels far from the origin lose no precision
    design = _design(normalised)
    conic = _halir_flusser(design)
    if _is_partial(conic):  # it comes out too small
        conic = _hyper_conic(design, conic)
    rms = scale * math.sqrt(float(_squared_distances(conic, normalised).mean()))
    return ellipse_from_conic(_moved(conic, x, y, scale), rms)


def _different(points: np.ndarray) -> int:
    """How many of points (N, 2) are not the same."""
    return len(set(map(tuple, points.tolist())))


def ellipse_from_conic(conic: Any, rms_px: float = 0.0) -> Ellipse:
    """Return the ellipse with conic coefficients A..F (6,); NoEllipseError where they belong to none."""
    conic = np.array(conic, dtype=float)
    if not math.isfinite(conic.sum()):
        raise NoEllipseError("a coefficient of the conic is not finite")
    A, B, C, *_ = conic
    if 4 * A * C <= B * B:
        raise NoEllipseError("the points lie on a hyperbola or a parabola, not on an ellipse")
    x, y, major, minor, angle_rad = map(float, axes_of(conic))  # as it is without compiling, too
    if not minor > 0:
        raise NoEllipseError("no point of the plane lies on this ellipse")
    return Ellipse(conic / math.copysign(np.linalg.norm(conic), A + C), (x, y), (major, minor), angle_rad, rms_px)


@compiled
def axes_of(conic: np.ndarray) -> tuple[float, float, float, float, float]:
    """Centre x, y, semi-axes, the larger first, and its angle, of the ellipse of a conic (6,); NaN of no ellipse."""
    A, B, C, D, E, F = conic * (1.0 if conic[0] + conic[2] >= 0 else -1.0)
    determinant = A * C - B * B / 4
    x, y = (B * E / 4 - C * D / 2) / determinant, (B * D / 4 - A * E / 2) / determinant
    inside = -(F + (D * x + E * y) / 2)
    large = (A + C) / 2 + np.hypot(A - C, B) / 2
    return x, y, np.sqrt(inside * large / determinant), np.sqrt(inside / large), np.arctan2(-B, C - A) / 2


def _squared_distances(conic: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Squares (N,) of |value| / |gradient| of a conic (6,) at points (N, 2)."""
    A, B, C, D, E, F = conic.tolist()
    x, y = points.T
    value = A * x * x + B * x * y + C * y * y + D * x + E * y + F
    across, down = 2 * A * x + B * y + D, B * x + 2 * C * y + E
    return value * value / np.maximum(across * across + down * down, 1e-300)


def _normalised(points: np.ndarray) -> tuple[float, float, float, np.ndarray]:
    """Mean x and y of points (N, 2), their scatter about it, and the points (N, 2) from there in its units."""
    middle = points.mean(axis=0)
    centred = points - middle
    scale = math.sqrt(np.vdot(centred, centred) / len(points))
    return middle[0], middle[1], scale, centred / scale


def _design(points: np.ndarray) -> np.ndarray:
    """Rows x^2, x y, y^2, x, y, 1 (N, 6) of points (N, 2)."""
    design, (x, y) = np.ones((len(points), 6)), points.T
    design[:, 0], design[:, 1], design[:, 2], design[:, 3:5] = x * x, x * y, y * y, points
    return design


def _moved(conic: np.ndarray, x: float, y: float, scale: float) -> tuple[float, ...]:
    """Conic (6,) in pixels, from the conic of points that were shifted by -x, -y and divided by scale."""
    A, B, C, D, E, F = conic.tolist()
    D, E, F = D * scale, E * scale, F * scale * scale
    return (
        *(A, B, C),
        D - 2 * A * x - B * y,
        E - 2 * C * y - B * x,
        F + A * x * x + B * x * y + C * y * y - D * x - E * y,
    )


def _halir_flusser(design: np.ndarray) -> np.ndarray:
    """Conic coefficients (6,) for the design matrix (N, 6) of centred, scaled points (their section 4)."""
    scatter, count = design.T @ design, len(design)
    S1, S2, S3 = scatter[:3, :3], scatter[:3, 3:], scatter[3:, 3:]
    if S3[0, 0] * S3[1, 1] - S3[0, 1] ** 2 < 1e-12 * count**2:
        raise NoEllipseError("the points lie on a line")
    T = -np.linalg.solve(S3, S2.T)
    M = S1 + S2 @ T
    reduced = np.array([M[2] / 2, -M[1], M[0] / 2])  # by the inverse of the constraint 4AC - B^2 = 1
    # All eigenvalues are real, since M is symmetric and not negative; OpenCV finds them in a tenth of numpy's time.
    try:
        eigenvalues, vectors = cv2.eigenNonSymmetric(reduced)
    except cv2.error as error:
        raise NoEllipseError("no ellipse runs through the points within rounding errors") from error
    conic = _least_ellipse(eigenvalues.ravel(), vectors, T)
    if conic[0] == 0.0:
        raise NoEllipseError("no ellipse runs through the points")
    return conic


def _least_ellipse(eigenvalues: np.ndarray, vectors: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Conic (6,) of the eigenvector, a row of (3, 3), that is an ellipse with the least eigenvalue; else zeros."""
    conic, least = np.zeros(6), np.inf
    for value, (a, b, c) in zip(np.abs(eigenvalues).tolist(), vectors.tolist(), strict=True):
        if 4 * a * c - b * b > 0 and value < least:
            least = value
            conic[:3], conic[3:] = (a, b, c), T[:, 0] * a + T[:, 1] * b + T[:, 2] * c
    return conic


def _is_partial(conic: np.ndarray) -> bool:
    """Whether the points, whose mean is the origin, cover about half of the ellipse or less."""
    A, B, C, D, E, F = conic.tolist()
    at_centre = F + (B * D * E - A * E * E - C * D * D) / (4 * A * C - B * B)
    return at_centre != 0 and F / at_centre < 1 - _PARTIAL**2


def _hyper_conic(design: np.ndarray, direct: np.ndarray) -> np.ndarray:
    """Conic (6,) by HyperLS (Kanatani and Rangarajan 2011, equations 26 and 29), or the direct fit where it is none."""
    # The paper's order and scale: xi = (x^2, 2xy, y^2, 2x, 2y, 1).
    xi = design * [1, 2, 1, 2, 2, 1]
    x, y, one, zero = design[:, 3], design[:, 4], design[:, 5], np.zeros(len(design))
    # Half the derivatives of xi by x and by y, whose noise is independent.
    by_x, by_y = np.stack([x, y, zero, one, zero, zero], axis=1), np.stack([zero, x, y, zero, one, zero], axis=1)
    V0 = 4 * (by_x[:, :, None] * by_x[:, None] + by_y[:, :, None] * by_y[:, None])
    count = len(design)
    M = xi.T @ xi / count
    eigenvalues, vectors = np.linalg.eigh(M)
    # Pseudo-inverse of rank 5: without the smallest eigenvalue, which would be 0 but for noise.
    inverse = (vectors[:, 1:] / np.maximum(eigenvalues[1:], 1e-15)) @ vectors[:, 1:].T
    mean_xi, e = xi.sum(axis=0) / count, np.array([1.0, 0, 1, 0, 0, 0])
    moved = xi @ inverse
    pulled = np.einsum("nij,nj,nk->ik", V0, moved, xi)
    N = V0.sum(axis=0) / count + np.outer(mean_xi, e) + np.outer(e, mean_xi)
    N -= (np.einsum("ni,ni,njk->jk", moved, xi, V0) + pulled + pulled.T) / count**2
    try:
        # M theta = lambda N theta with the least |lambda|, solved inverted: M is positive definite and N is not.
        root = np.linalg.cholesky(M)
        inverted, candidates = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, N).T))
    except np.linalg.LinAlgError:
        return direct
    conic = np.linalg.solve(root.T, candidates[:, np.argmax(np.abs(inverted))]) * [1, 2, 1, 2, 2, 1]
    return conic if 4 * conic[0] * conic[2] > conic[1] ** 2 else direct
