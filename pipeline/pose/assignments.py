"""Which lights of a dock a few points can be: every assignment, and how well each could explain the points."""

import math
from functools import lru_cache
from itertools import combinations

import numpy as np
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError

MOST_ASSIGNMENTS = 20_000  # for time
MOST_OF_THREE = 70  # three lights fit whichever they are: so many answers answer nothing
FEWEST = 3  # each has two coordinates, a pose six numbers
_STEP_PX = 1e-3  # of the derivatives, far below the noise of a centroid


@lru_cache(maxsize=32)
def assignments(count: int, dock: Dock) -> np.ndarray:
    """Lights (K, count) that points around the picture can be; NoEllipseError where too many to tell apart."""
    total = dock.lights or 0
    firsts = range(total) if dock.angles_deg else range(1)
    number = len(firsts) * math.comb(total - 1, count - 1)
    if number > (MOST_OF_THREE if count == FEWEST else MOST_ASSIGNMENTS):
        raise NoEllipseError(f"{count} of {total} lights can be too many different ones")
    around = np.argsort(np.mod(dock.light_angles_rad(), 2 * math.pi))
    rest = np.array(list(combinations(range(1, total), count - 1)), dtype=np.intp).reshape(-1, count - 1)
    steps = np.hstack([np.zeros((len(rest), 1), dtype=np.intp), rest])
    rows = around[(np.array(firsts)[:, None, None] + steps) % total].reshape(-1, count)
    rows.setflags(write=False)
    return rows


def squares_of(dock: Dock, tangents: np.ndarray, slopes_px: np.ndarray) -> np.ndarray:
    """Squared residuals (K,) in px^2, to first order, of assignments of four or more rays (N, 2)."""
    count = len(tangents)
    inverse = np.broadcast_to(np.linalg.inv(slopes_px), (count, 2, 2))
    fours = list(combinations(range(count), 4))
    total = np.zeros(len(assignments(count, dock)))
    for four in fours:
        which = list(four)
        products = _products(tangents[which], inverse[which])
        if products is None:
            return np.full(len(total), np.inf)
        at_right_angles, as_long = (terms @ products for terms in _conditions(count, four, dock))
        e, f, E, F = at_right_angles[:, 0], as_long[:, 0], at_right_angles[:, 1:], as_long[:, 1:]
        ee, ef, ff = (np.einsum("ij,ij->i", one, other) for one, other in ((E, E), (E, F), (F, F)))
        squares = (e * e * ff - 2 * e * f * ef + f * f * ee) / np.maximum(ee * ff - ef * ef, 1e-12 * ee * ff)
        total += squares
    return total / len(fours) * (count - 3)


@lru_cache(maxsize=64)
def _conditions(count: int, four: tuple[int, ...], dock: Dock) -> tuple[np.ndarray, np.ndarray]:
    """What h1.h2 and (h1.h1 - h2.h2) / 2 of each assignment are, (K, 6) each, of the six different numbers of A'A."""
    angles = dock.light_angles_rad()[assignments(count, dock)[:, four]]
    lights = np.stack([np.cos(angles), np.sin(angles), np.ones_like(angles)], axis=-1)
    G = plane_of(lights)
    (a, b, c), (d, e, f) = G[:, :, 0].T, G[:, :, 1].T
    at_right_angles = np.stack([a * d, b * e, c * f, a * e + b * d, a * f + c * d, b * f + c * e], axis=1)
    halves = [(one * one - other * other) / 2 for one, other in ((a, d), (b, e), (c, f))]
    as_long = [*halves, a * b - d * e, a * c - d * f, b * c - e * f]
    return at_right_angles, np.stack(as_long, axis=1)


def _products(tangents: np.ndarray, inverse: np.ndarray) -> np.ndarray | None:
    """The six numbers of A'A and their derivatives by each coordinate's pixel (6, 9); None for points of no ellipse."""
    moved = np.broadcast_to(tangents, (17, 4, 2)).copy()
    for k in range(8):
        step = _STEP_PX * inverse[k // 2, :, k % 2]
        moved[1 + k, k // 2] += step
        moved[9 + k, k // 2] -= step
    A = basis_of(np.concatenate([moved, np.ones((17, 4, 1))], axis=2))
    if A is None:
        return None
    products = A.transpose(0, 2, 1) @ A
    six = products[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.vstack([six[:1], (six[1:9] - six[9:]) / (2 * _STEP_PX)]).T


def basis_of(points: np.ndarray) -> np.ndarray | None:
    """[a1 x1, a2 x2, a3 x3] (K, 3, 3), x4 their sum, of points (K, 4, 3); None where they are not in convex order."""
    columns = points[:, :3].transpose(0, 2, 1)
    if abs(np.linalg.det(columns[0])) < 1e-14:
        return None
    a = np.linalg.solve(columns, points[:, 3, :, None])[..., 0]
    if not (a[0] * [1, -1, 1] > 0).all():
        return None
    return columns * a[:, None, :]


def plane_of(lights: np.ndarray) -> np.ndarray:
    """The inverse (K, 3, 3) of the same matrix of four lights (K, 4, 3) of the dock, given as (x, y, 1)."""
    one, two, three, four = lights.transpose(1, 0, 2)
    rows = np.stack([np.cross(two, three), np.cross(three, one), np.cross(one, two)], axis=1)
    return rows / (rows @ four[..., None])
