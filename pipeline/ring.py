"""Which of the groups are the dock's lights: those that lie on one ellipse."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from pipeline.ellipse import (
    MIN_POINTS,
    NoEllipseError,
    conic_coefficients,
    conic_matrix,
    fit_ellipse,
    sampson_distances,
)

# A light's centre may lie this far off the ellipse: uneven glow and lamp housings move it by a pixel or so, and on
# a large ring by a share of its size.
TOLERANCE_PX = 1.5
TOLERANCE_OF_AXIS = 0.015
MAX_HYPOTHESES = 4000
_NARROWEST = 0.15  # minor to major axis: a dock seen at 80 degrees


@dataclass(frozen=True)
class Ring:
    """The markers that are lights of the dock.

    Attributes
    ----------
    on_ring : (N,) bool for each marker.
    reason : one sentence: what was kept or thrown out, or why nothing is a ring.
    """

    on_ring: np.ndarray
    reason: str

    @property
    def found(self) -> bool:
        """Whether there are enough lights for an ellipse."""
        return bool(self.on_ring.sum() >= MIN_POINTS)


def find_ring(points_px: np.ndarray) -> Ring:
    """Find the markers that lie on one ellipse.

    Parameters
    ----------
    points_px : (N, 2) centres of the markers, undistorted, N at least 5.

    Notes
    -----
    All markers if one ellipse fits them all; otherwise the ellipse through five of them that most others agree
    with (at least one more, since an ellipse runs through almost any five). Every five are tried, or 4000 fives
    drawn with a fixed seed where there are more.
    """
    everything = np.ones(len(points_px), dtype=bool)
    if _agreeing(points_px, everything).all():
        return Ring(everything, f"All {len(points_px)} groups lie on one ellipse.")
    best, best_score = np.zeros(len(points_px), dtype=bool), (MIN_POINTS, 0.0)
    for conic, major in _hypotheses(points_px):
        distance = sampson_distances(conic, points_px)
        near = distance <= _tolerance_px(major)
        score = (int(near.sum()), -float(distance[near].sum()))
        if score > best_score:
            best, best_score = near, score
    agreeing = _agreeing(points_px, best)
    if not best.any() or agreeing.sum() <= MIN_POINTS:
        return Ring(
            np.zeros(len(points_px), dtype=bool), f"No ellipse runs through six of the {len(points_px)} groups."
        )
    kept = int(agreeing.sum())
    return Ring(
        agreeing, f"{kept} of {len(points_px)} groups lie on one ellipse; the other {len(points_px) - kept} do not."
    )


def _tolerance_px(major_px: float) -> float:
    return max(TOLERANCE_PX, TOLERANCE_OF_AXIS * major_px)


def _agreeing(points: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Which points lie on the ellipse fitted to the members; none where there is no such ellipse."""
    try:
        ellipse = fit_ellipse(points[members])
    except NoEllipseError:
        return np.zeros(len(points), dtype=bool)
    major, minor = ellipse.semi_axes_px
    if minor < _NARROWEST * major:
        return np.zeros(len(points), dtype=bool)
    return ellipse.distances(points) <= _tolerance_px(major)


def _fives(count: int) -> np.ndarray:
    if comb(count, MIN_POINTS) <= MAX_HYPOTHESES:
        return np.array(list(combinations(range(count), MIN_POINTS)))
    order = np.random.default_rng(0).random((MAX_HYPOTHESES, count)).argsort(axis=1)
    return order[:, :MIN_POINTS]


def _hypotheses(points: np.ndarray) -> list[tuple[np.ndarray, float]]:
    """Conics (6,) and major semi-axes of the real, not too narrow ellipses through five points each."""
    origin, scale = points.mean(axis=0), points.std()
    unit = (points - origin) / scale
    x, y = unit[_fives(len(points))].transpose(2, 0, 1)
    rows = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=2)
    conics = np.linalg.svd(rows, full_matrices=True)[2][:, 5]
    A, B, C, D, E, F = conics.T
    determinant = 4 * A * C - B * B
    real = determinant > 1e-12
    A, B, C, D, E, F, determinant = (value[real] for value in (A, B, C, D, E, F, determinant))
    value_at_centre = F + (B * D * E - A * E * E - C * D * D) / determinant
    half_sum, half_gap = (A + C) / 2, np.hypot(A - C, B) / 2
    small, large = np.abs(half_sum) - half_gap, np.abs(half_sum) + half_gap
    major = np.sqrt(np.abs(value_at_centre) / small)
    good = (np.sqrt(small / large) > _NARROWEST) & (np.sign(value_at_centre) != np.sign(half_sum))
    to_unit = np.array([[1, 0, -origin[0]], [0, 1, -origin[1]], [0, 0, scale]]) / scale
    monomials = _conic_map(to_unit)
    kept = conics[real][good]
    return [(conic, float(axis)) for conic, axis in zip(kept @ monomials, major[good] * scale, strict=True)]


def _conic_map(to_unit: np.ndarray) -> np.ndarray:
    """Matrix (6, 6) that takes conic coefficients (row vectors) of unit points to those of picture points."""
    return np.array([conic_coefficients(to_unit.T @ conic_matrix(row) @ to_unit) for row in np.eye(6)])
