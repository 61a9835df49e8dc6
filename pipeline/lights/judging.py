"""How likely chance is to make a polygon of points, and whether it is less likely to without some of them."""

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.chance import LEAST_CROWD, Fit, Scene, log_chance_of, squares_apart_px2
from dockpose.lights.reprojection import Sought, as_pose, off_corners, stretch


@compiled
def judged(
    sought: Sought, corners: np.ndarray, squares: float, mapping: np.ndarray, scene: Scene
) -> tuple[float, np.ndarray, float, np.ndarray]:
    """Chance of a ring, inf of none, its corners, squares and mapping: one of its points may be no light of it."""
    chance = log_chance_of(fit_of(corners, squares, mapping), scene, True)
    if chance < np.inf or np.count_nonzero(corners >= 0) <= LEAST_CROWD:
        return chance, corners, squares, mapping
    corners = corners.copy()
    corners[off_corners(sought, corners, mapping)[2]] = -1
    squares, mapping = as_pose(sought, corners, mapping)
    return log_chance_of(fit_of(corners, squares, mapping), scene, True), corners, squares, mapping


@compiled
def fit_of(corners: np.ndarray, squares: float, mapping: np.ndarray) -> Fit:
    """A polygon whose lights are alike off their places both ways."""
    return Fit(corners, squares, (-1.0, -1.0), stretch(mapping), (mapping[0, 2], mapping[1, 2]))


@compiled
def least_likely(
    sought: Sought, corners: np.ndarray, mapping: np.ndarray, scene: Scene, is_exact: bool
) -> tuple[float, np.ndarray, float, np.ndarray]:
    """Chance, corners, squares and mapping without points that make a ring likelier to be chance; inf of none.

    Whatever an exact ring leaves out, a row of lights becomes several, and less like lamps on a cable.
    """
    squares, mapping = as_pose(sought, corners, mapping)
    best = np.inf, corners, squares, mapping
    while True:
        fit = fit_of(corners, squares, mapping)
        lit = np.flatnonzero(corners >= 0)
        if not is_exact:
            flat = np.empty((len(lit), 2))
            flatten(mapping, sought.points[corners[lit]], flat)
            apart_px2 = squares_apart_px2(flat, 2 * np.pi / len(corners) * lit, fit.semi_axes_px)
            fit = Fit(corners, squares, apart_px2, fit.semi_axes_px, fit.centre_px)
        chance = log_chance_of(fit, scene, not is_exact)
        if chance < best[0]:
            best = chance, corners, squares, mapping
        if len(lit) <= LEAST_CROWD:
            return best
        corners = corners.copy()
        corners[off_corners(sought, corners, mapping)[2]] = -1
        squares, mapping = as_pose(sought, corners, mapping)


@compiled_bare
def _of_three(mapping: np.ndarray, one: int, two: int, to: tuple[float, float, float]) -> float:
    """Determinant of two columns of a map (3, 3) and a third."""
    across = mapping[1, one] * mapping[2, two] - mapping[2, one] * mapping[1, two]
    down = mapping[2, one] * mapping[0, two] - mapping[0, one] * mapping[2, two]
    return (
        across * to[0] + down * to[1] + (mapping[0, one] * mapping[1, two] - mapping[1, one] * mapping[0, two]) * to[2]
    )


@compiled_bare
def flatten(mapping: np.ndarray, places: np.ndarray, flat: np.ndarray) -> float:
    """Fill in radius less 1 and angle (M, 2) of places (M, 2) in a circle's plane; how many are near it."""
    near = 1.0
    for k in range(len(places)):
        # The inverse is a matrix of cross products, but for its size, which is divided out.
        to = places[k, 0], places[k, 1], 1.0
        x, y, w = _of_three(mapping, 1, 2, to), _of_three(mapping, 2, 0, to), _of_three(mapping, 0, 1, to)
        x, y = x / w, y / w
        flat[k, 0], flat[k, 1] = np.hypot(x, y) - 1, np.arctan2(y, x)
        near += flat[k, 0] < 1
    return near
