"""The images of a dock's lights among points: the ring's polygon seen in perspective, some of its corners missing.

Three points that are taken for three corners fix an affine image of the polygon, which predicts the other corners.
Triples whose predictions hold grow, by a homography, to the whole ring. The loops are compiled by numba: a picture
with 150 groups has tens of thousands of triples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dockpose.thresholds.compiled import compiled
from scipy.spatial import KDTree

# The brightest points are looked at, first few, then more.
FIRST_POINTS, MAX_POINTS = 40, 150
NARROWEST = 0.12  # minor to major axis: a dock seen at 83 degrees
_NEIGHBOURS = 12  # of each point: those it may have as the next corners
_TRIALS = 80  # triples that are grown, the most promising
# Corners between the first and the second, and the second and the third point of a triple: neighbours; every second
# corner; one missing between them.
_STEPS = np.array([(1, 1), (2, 2), (1, 2), (2, 1)])
_MORE_STEPS = np.array([(1, 3), (3, 1), (2, 3), (3, 2), (3, 3), (1, 4), (4, 1)])  # where there are few points
_FEW_POINTS = 12
# The predicted corners and how far from them a point may lie, in spacings: perspective bends what is farther away.
_NEXT_TOLERANCE, _FAR_TOLERANCE = 0.2, 0.35
_EXACT = 0.03  # of the spacing: nearer is no better
_GROWING_TOLERANCE, _STRICT_TOLERANCE = 0.22, 0.2  # of the spacing
_STRICT_ROUNDS = 3
TOLERANCE_PX, TOLERANCE_OF_RADIUS = 1.5, 0.025
_SMALLEST_RADIUS_PX = 3.0
_PERSPECTIVE_MARGIN = 1.5  # focal lengths are not always well known
_NOISE_PX = 1.0
_PERSPECTIVE_PRIOR = 0.03


@dataclass(frozen=True)
class Polygon:
    """A ring that was found among points.

    Attributes
    ----------
    corners : (N,) int array
        For each light of the dock the number of the point that lies there, -1 where none does.
    squares_px2 : float
        Sum of the squared distances of these points from their corners, in pixels squared.
    semi_axes_px : tuple of float
        Major and minor semi-axis of the ring's image, in pixels.
    centre_px : tuple of float
        Image of the ring's centre.
    """

    corners: np.ndarray
    squares_px2: float
    semi_axes_px: tuple[float, float]
    centre_px: tuple[float, float]

    @property
    def members(self) -> np.ndarray:
        """Numbers of the points that are corners."""
        return self.corners[self.corners >= 0]


def find_polygons(
    points_px: np.ndarray,
    angles_rad: np.ndarray,
    even: bool,
    focal_px: float,
    tolerance_px: float = TOLERANCE_PX,
    first: np.ndarray | None = None,
) -> list[Polygon]:
    """Find the images of a polygon inscribed in a circle among points.

    Parameters
    ----------
    points_px : (M, 2) float array
        Points, undistorted, in pixels from the principal point.
    angles_rad : (N,) float array
        Angles of the polygon's corners around its circle, ascending, at least four.
    even : bool
        Whether the corners are evenly spaced, so that it does not matter which is the first.
    focal_px : float
        Focal length; it limits how much perspective a polygon of that size in the picture can have.
    tolerance_px : float
        How far from its corner a point may lie; on large rings it may be 2.5 % of the smaller radius.
    first : int array, optional
        Numbers of the points that a ring is begun from, at least three of its corners; None for all.

    Returns
    -------
    list of Polygon
        Those that at least four points support, in the order they were found; deterministic. Whether they are more
        than chance is for :mod:`dockpose.lights.chance` to say.
    """
    sides = len(angles_rad)
    first = np.arange(len(points_px)) if first is None else first
    count = len(first)
    if min(count, sides) < 4:
        return []
    points = np.ascontiguousarray(points_px, dtype=float)
    near = KDTree(points[first]).query(points[first], k=min(_NEIGHBOURS + 1, count))[1][:, 1:]
    near = np.ascontiguousarray(first[near])
    unit = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
    steps = np.vstack([_STEPS, _MORE_STEPS]) if count <= _FEW_POINTS else _STEPS
    steps = steps[steps.sum(axis=1) < sides]
    found: list[Polygon] = []
    for some in (steps[:1], steps[1:]):
        if len(some) == 0 or any(len(polygon.members) >= 0.8 * sides for polygon in found):
            break
        trials = _TRIALS if even else 2 * _TRIALS
        triples = _promising(points, first, near, unit, some, _inverses(unit, some), even, trials)
        grown, squares, mappings = _grow_all(points, unit, triples, focal_px, tolerance_px)
        found += [_polygon(*row) for row in zip(grown, squares.tolist(), mappings, strict=True)]
    return found


def _polygon(corners: np.ndarray, squares_px2: float, mapping: np.ndarray) -> Polygon:
    major, minor = _stretch(mapping)
    return Polygon(corners, squares_px2, (major, minor), (float(mapping[0, 2]), float(mapping[1, 2])))


def _inverses(unit: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """For each pair of steps and first corner, what turns three points into an affine image (S, N, 3, 3)."""
    sides = len(unit)
    first = np.arange(sides)[None]
    corners = np.stack([first + 0 * steps[:, :1], first + steps[:, :1], first + steps.sum(axis=1)[:, None]], axis=2)
    places = np.concatenate([unit, np.ones((sides, 1))], axis=1)[corners % sides]
    return np.ascontiguousarray(np.linalg.inv(places.transpose(0, 1, 3, 2)))


@compiled
def _promising(
    points: np.ndarray,
    middles: np.ndarray,
    near: np.ndarray,
    unit: np.ndarray,
    steps: np.ndarray,
    inverses: np.ndarray,
    even: bool,
    trials: int,
) -> np.ndarray:
    """Triples (T, 6) of points and their corners that predict most of the next corners, and most exactly, first."""
    sides = len(unit)
    best = np.full(trials, -1.0)
    kept = np.full((trials, 6), -1)
    beyond = np.array([-2, -1, 1, 2])
    for step in range(len(steps)):
        one, two = steps[step, 0], steps[step, 1]
        for first in range(1 if even else sides):
            middle, last = (first + one) % sides, (first + one + two) % sides
            inverse = inverses[step, first]
            for row in range(len(middles)):
                m = middles[row]
                for i in near[row]:
                    for j in near[row]:
                        if i == j or (even and one == two and j < i):
                            continue
                        ax, ay = points[m, 0] - points[i, 0], points[m, 1] - points[i, 1]
                        bx, by = points[j, 0] - points[m, 0], points[j, 1] - points[m, 1]
                        cross = ax * by - ay * bx
                        if not even and cross < 0:
                            continue
                        a, b = np.hypot(ax, ay) / one, np.hypot(bx, by) / two
                        if (even and (a > 4 * b or b > 4 * a)) or abs(cross) < 0.04 * a * b * one * two:
                            continue
                        score = _score(
                            points, near[row], unit, inverse, (first, middle, last), (i, m, j), min(a, b), beyond
                        )
                        worst = np.argmin(best)
                        if score > best[worst]:
                            best[worst] = score
                            kept[worst] = np.array([i, m, j, first, middle, last])
    order = np.argsort(-best)
    usable = np.count_nonzero(best >= 0)
    return kept[order[:usable]]


@compiled
def _score(points, candidates, unit, inverse, corners, triple, spacing, beyond):  # type: ignore[no-untyped-def]
    """How many of the next corners have a point, and how near; -1 for no image of a dock."""
    p = np.empty((2, 3))
    for k in range(3):
        p[0, k], p[1, k] = points[triple[k], 0], points[triple[k], 1]
    xx = p[0, 0] * inverse[0, 0] + p[0, 1] * inverse[1, 0] + p[0, 2] * inverse[2, 0]
    xy = p[0, 0] * inverse[0, 1] + p[0, 1] * inverse[1, 1] + p[0, 2] * inverse[2, 1]
    xt = p[0, 0] * inverse[0, 2] + p[0, 1] * inverse[1, 2] + p[0, 2] * inverse[2, 2]
    yx = p[1, 0] * inverse[0, 0] + p[1, 1] * inverse[1, 0] + p[1, 2] * inverse[2, 0]
    yy = p[1, 0] * inverse[0, 1] + p[1, 1] * inverse[1, 1] + p[1, 2] * inverse[2, 1]
    yt = p[1, 0] * inverse[0, 2] + p[1, 1] * inverse[1, 2] + p[1, 2] * inverse[2, 2]
    mean, apart = (xx * xx + xy * xy + yx * yx + yy * yy) / 2, abs(xx * yy - xy * yx)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    if major < _SMALLEST_RADIUS_PX / 2 or apart < NARROWEST / 1.5 * major * major:
        return -1.0
    sides = len(unit)
    score = 0.0
    for b in range(4):
        corner = (corners[0] + beyond[b]) % sides if beyond[b] < 0 else (corners[2] + beyond[b]) % sides
        if corner == corners[0] or corner == corners[1] or corner == corners[2]:
            continue
        if beyond[b] == 2 and (corner - corners[0]) % sides == sides - 2:
            continue  # the same as two before the first
        if beyond[b] == 2 and (corner - corners[0]) % sides == sides - 1:
            continue
        x = xx * unit[corner, 0] + xy * unit[corner, 1] + xt
        y = yx * unit[corner, 0] + yy * unit[corner, 1] + yt
        nearest = np.inf
        for other in candidates:
            if other == triple[0] or other == triple[2]:
                continue
            square = (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2
            nearest = min(nearest, square)
        within = (_NEXT_TOLERANCE if abs(beyond[b]) == 1 else _FAR_TOLERANCE) * spacing
        if nearest < within * within:
            score += 1 + np.log(within / max(np.sqrt(nearest), _EXACT * spacing))
    return score


@compiled
def _grow_all(
    points: np.ndarray, unit: np.ndarray, triples: np.ndarray, focal_px: float, tolerance_px: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (K, N), sums of squares (K,) and homographies (K, 3, 3) of the polygons that triples grow to."""
    sides = len(unit)
    corners = np.full((len(triples), sides), -1)
    squares = np.empty(len(triples))
    mappings = np.empty((len(triples), 3, 3))
    found = 0
    for t in range(len(triples)):
        start = np.full(sides, -1)
        for k in range(3):
            start[triples[t, 3 + k]] = triples[t, k]
        if _is_known(corners[:found], start):
            continue
        grown, square, mapping = _grow(points, unit, start, focal_px, tolerance_px)
        if square < 0 or _is_known(corners[:found], grown):
            continue
        square, mapping = _as_pose(points, grown, unit, mapping, focal_px)
        corners[found], squares[found], mappings[found] = grown, square, mapping
        found += 1
    return corners[:found], squares[:found], mappings[:found]


@compiled
def _is_known(found: np.ndarray, corners: np.ndarray) -> bool:
    """Whether the points of ``corners`` are part of a polygon found before, in the same order around it."""
    sides = len(corners)
    for row in range(len(found)):
        shift, same, mirrored = -1, True, True
        flip = -1
        for corner in range(sides):
            if corners[corner] < 0:
                continue
            place = -1
            for other in range(sides):
                if found[row, other] == corners[corner]:
                    place = other
            if place < 0:
                same = mirrored = False
                break
            if shift < 0:
                shift, flip = (place - corner) % sides, (place + corner) % sides
            same = same and (place - corner) % sides == shift
            mirrored = mirrored and (place + corner) % sides == flip
        if same or mirrored:
            return True
    return False


@compiled
def _grow(points, unit, start, focal_px, tolerance_px):  # type: ignore[no-untyped-def]
    """Grow a polygon from three corners: fit, look for the corners beside those that are known, and fit again.

    Corners are added from near to far, since the first fits bend what is far from the points they are made of. When no
    more are found, all corners are looked for where the last fit puts them, and have to lie there exactly.
    """
    sides = len(unit)
    corners = start.copy()
    places, off, nearest, spacing = np.empty((sides, 2)), np.empty(sides), np.empty(sides, np.int64), np.empty(sides)
    strict = 0
    mapping = np.eye(3)
    while True:
        ok, mapping = _fit(points, corners, unit, focal_px)
        if not ok:
            return corners, -1.0, mapping
        for c in range(sides):
            w = mapping[2, 0] * unit[c, 0] + mapping[2, 1] * unit[c, 1] + 1.0
            places[c, 0] = (mapping[0, 0] * unit[c, 0] + mapping[0, 1] * unit[c, 1] + mapping[0, 2]) / w
            places[c, 1] = (mapping[1, 0] * unit[c, 0] + mapping[1, 1] * unit[c, 1] + mapping[1, 2]) / w
        for c in range(sides):
            best, number = np.inf, -1
            for k in range(len(points)):
                square = (points[k, 0] - places[c, 0]) ** 2 + (points[k, 1] - places[c, 1]) ** 2
                if square < best:
                    best, number = square, k
            off[c], nearest[c] = np.sqrt(best), number
            before, after = places[c - 1], places[(c + 1) % sides]
            spacing[c] = min(
                np.hypot(places[c, 0] - before[0], places[c, 1] - before[1]),
                np.hypot(places[c, 0] - after[0], places[c, 1] - after[1]),
            )
        if strict == _STRICT_ROUNDS:
            break
        exact = max(tolerance_px, TOLERANCE_OF_RADIUS * _stretch(mapping)[1])
        known = 0
        grown = np.full(sides, -1)
        for c in range(sides):
            known += corners[c] >= 0
            within = min(_STRICT_TOLERANCE * spacing[c], exact) if strict else _GROWING_TOLERANCE * spacing[c]
            beside = (
                corners[c] >= 0
                or corners[c - 1] >= 0
                or corners[c - 2] >= 0
                or corners[(c + 1) % sides] >= 0
                or corners[(c + 2) % sides] >= 0
            )
            if off[c] < within and (strict > 0 or beside):
                grown[c] = nearest[c]
        if strict > 0 or np.count_nonzero(grown >= 0) <= known:
            strict += 1
        corners = grown
        if np.count_nonzero(corners >= 0) < 3:
            return corners, -1.0, mapping
    squares = 0.0
    members = 0
    for c in range(sides):
        if corners[c] < 0:
            continue
        members += 1
        squares += (points[corners[c], 0] - places[c, 0]) ** 2 + (points[corners[c], 1] - places[c, 1]) ** 2
        for other in range(c):
            if corners[other] == corners[c]:
                return corners, -1.0, mapping
    return corners, (squares if members >= 4 else -1.0), mapping


@compiled
def _fit(points, corners, unit, focal_px):  # type: ignore[no-untyped-def]
    """Homography (3, 3) of the unit circle's corners to the points, no more in perspective than they ask for.

    Three corners fix an affine image; how much the two numbers of perspective may differ from 0 for the sake of more
    corners is set by a weak prior. Not ok where it is no plausible image of a dock: too small, too narrow, or seen
    from too near.
    """
    count, x0, y0 = 0, 0.0, 0.0
    for corner in corners:
        if corner >= 0:
            count += 1
            x0 += points[corner, 0]
            y0 += points[corner, 1]
    x0, y0, size = x0 / count, y0 / count, 0.0
    for corner in corners:
        if corner >= 0:
            size += (points[corner, 0] - x0) ** 2 + (points[corner, 1] - y0) ** 2
    size = max(np.sqrt(size / (2 * count)), 1e-9)
    normal, right = np.zeros((8, 8)), np.zeros(8)
    row = np.zeros(8)
    for c in range(len(corners)):
        if corners[c] < 0:
            continue
        for axis in range(2):
            seen = (points[corners[c], 0] - x0) / size if axis == 0 else (points[corners[c], 1] - y0) / size
            row[:] = 0.0
            row[3 * axis], row[3 * axis + 1], row[3 * axis + 2] = unit[c, 0], unit[c, 1], 1.0
            row[6], row[7] = -unit[c, 0] * seen, -unit[c, 1] * seen
            for a in range(8):
                right[a] += row[a] * seen
                for b in range(8):
                    normal[a, b] += row[a] * row[b]
    normal[6, 6] += _PERSPECTIVE_PRIOR**2
    normal[7, 7] += _PERSPECTIVE_PRIOR**2
    for a in range(8):
        normal[a, a] += 1e-12
    h = _solve(normal, right)
    mapping = np.empty((3, 3))
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = h[6], h[7], 1.0
    for k in range(3):
        mapping[0, k] = size * h[k] + x0 * mapping[2, k]
        mapping[1, k] = size * h[3 + k] + y0 * mapping[2, k]
    major, minor = _stretch(mapping)
    # The scale changes across a dock by its radius over its range, which is its radius in the picture over the focal
    # length, times the sine of its tilt; what the lights' own noise feigns comes on top.
    most = _PERSPECTIVE_MARGIN * major / focal_px + _NOISE_PX / max(minor, 1e-9)
    plausible = (
        minor >= max(_SMALLEST_RADIUS_PX / 3, NARROWEST * major)
        and major >= _SMALLEST_RADIUS_PX
        and np.hypot(h[6], h[7]) <= most
    )
    return plausible, mapping


@compiled
def _as_pose(points, corners, unit, mapping, focal_px):  # type: ignore[no-untyped-def]
    """Sum of squares and homography of the circle's pose that is nearest to a homography.

    A homography has two numbers more than a pose, which can bend any five points into a ring. With L its linear part
    at the circle's middle c, both over the focal length, a pose has L + c p^T above p^T, p the perspective, in columns
    at right angles and of one length; two p solve that. Each is refined in turn with the affine part.
    """
    least, best = np.inf, mapping
    for sign in (-1.0, 1.0):
        trial = mapping.copy()
        squares = np.inf
        for _ in range(4):
            cx, cy = trial[0, 2] / focal_px, trial[1, 2] / focal_px
            a = (trial[0, 0] - trial[0, 2] * trial[2, 0]) / focal_px
            b = (trial[0, 1] - trial[0, 2] * trial[2, 1]) / focal_px
            c = (trial[1, 0] - trial[1, 2] * trial[2, 0]) / focal_px
            d = (trial[1, 1] - trial[1, 2] * trial[2, 1]) / focal_px
            k = 1 + cx * cx + cy * cy
            gx, gy = a * cx + c * cy, b * cx + d * cy
            hxx, hxy, hyy = a * a + c * c - gx * gx / k, a * b + c * d - gx * gy / k, b * b + d * d - gy * gy / k
            turn = np.arctan2(2 * hxy, hxx - hyy) / 2
            long = np.sqrt(np.hypot(hxx - hyy, 2 * hxy) / k)
            px, py = -sign * long * np.sin(turn) - gx / k, sign * long * np.cos(turn) - gy / k
            squares, trial = _fit_affine(points, corners, unit, px, py)
        if squares < least:
            least, best = squares, trial
    return least, best


@compiled
def _fit_affine(points, corners, unit, px, py):  # type: ignore[no-untyped-def]
    """Sum of squares and homography (3, 3) of the best affine part for a given perspective."""
    normal, right = np.zeros((3, 3)), np.zeros((3, 2))
    row = np.empty(3)
    for c in range(len(corners)):
        if corners[c] >= 0:
            w = 1 + px * unit[c, 0] + py * unit[c, 1]
            row[0], row[1], row[2] = unit[c, 0] / w, unit[c, 1] / w, 1 / w
            for i in range(3):
                for j in range(3):
                    normal[i, j] += row[i] * row[j]
                right[i, 0] += row[i] * points[corners[c], 0]
                right[i, 1] += row[i] * points[corners[c], 1]
    mapping = np.empty((3, 3))
    mapping[0] = _solve(normal.copy(), right[:, 0].copy())
    mapping[1] = _solve(normal, right[:, 1].copy())
    mapping[2] = np.array([px, py, 1.0])
    squares = 0.0
    for c in range(len(corners)):
        if corners[c] >= 0:
            w = 1 + px * unit[c, 0] + py * unit[c, 1]
            for axis in range(2):
                at = (mapping[axis, 0] * unit[c, 0] + mapping[axis, 1] * unit[c, 1] + mapping[axis, 2]) / w
                squares += (points[corners[c], axis] - at) ** 2
    return squares, mapping


@compiled
def _solve(A: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Solve A x = b for a symmetric positive definite A, in place (Cholesky); compiles far sooner than LAPACK's."""
    size = len(b)
    for k in range(size):
        for i in range(k):
            A[k, k] -= A[k, i] * A[k, i]
        A[k, k] = np.sqrt(max(A[k, k], 1e-300))
        for row in range(k + 1, size):
            for i in range(k):
                A[row, k] -= A[row, i] * A[k, i]
            A[row, k] /= A[k, k]
    for k in range(size):
        for i in range(k):
            b[k] -= A[k, i] * b[i]
        b[k] /= A[k, k]
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            b[k] -= A[i, k] * b[i]
        b[k] /= A[k, k]
    return b


@compiled
def _stretch(mapping):  # type: ignore[no-untyped-def]
    """Singular values, larger first, of how the mapping stretches around the circle's middle."""
    a = mapping[0, 0] - mapping[0, 2] * mapping[2, 0]
    b = mapping[0, 1] - mapping[0, 2] * mapping[2, 1]
    c = mapping[1, 0] - mapping[1, 2] * mapping[2, 0]
    d = mapping[1, 1] - mapping[1, 2] * mapping[2, 1]
    mean, apart = (a * a + b * b + c * c + d * d) / 2, abs(a * d - b * c)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    return major, apart / max(major, 1e-9)
