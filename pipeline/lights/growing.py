"""From three corners of a dock's polygon of lights to the whole: fit, look for the next corners, and fit again."""

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.reprojection import Sought, as_pose, fit_affine, near_pose, solve

NARROWEST = 0.12  # minor to major axis: a dock seen at 83 degrees
SMALLEST_RADIUS_PX = 3.0  # of a smaller ring the lights are not apart
# Glow and lamp housings move a centre by a pixel or so, on a large ring by a share of it.
TOLERANCE_PX, TOLERANCE_OF_RADIUS = 1.5, 0.025
_GROWING_TOLERANCE, _STRICT_TOLERANCE = 0.22, 0.2  # of the spacing
_STRICT_ROUNDS = 3  # of looking for all corners where the last fit puts them
_PERSPECTIVE_MARGIN = 1.5  # focal lengths are not always well known
_NOISE_PX = 1.0  # of a centre, for what of a perspective may be feigned
_PERSPECTIVE_PRIOR = 0.03  # weak, see _fit


def distances(points_px: np.ndarray, others_px: np.ndarray) -> np.ndarray:
    """How far (N, M) each of some points (N, 2) is from each of others (M, 2)."""
    return np.hypot(*(points_px[:, None] - others_px).transpose(2, 0, 1))


@compiled
def grow_all(sought: Sought, triples: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (K, N), sums of squares (K,) and homographies (K, 3, 3) of the polygons that triples grow to."""
    sides, points = len(sought.unit), sought.points
    corners = np.full((len(triples), sides), -1)
    squares = np.empty(len(triples))
    mappings = np.empty((len(triples), 3, 3))
    found = 0
    order = np.argsort(points[:, 0])
    across = points[order, 0]
    for t in range(len(triples)):
        start = np.full(sides, -1)
        for k in range(3):
            start[triples[t, 3 + k]] = triples[t, k]
        if _is_known(corners[:found], start):
            continue
        most = 0
        for guess in _perspectives(sought, start):
            grown, square, mapping = _grow(sought, order, across, start, guess)
            members = np.count_nonzero(grown >= 0)
            if square < 0 or members <= most or _is_known(corners[:found], grown):
                continue
            square, mapping = as_pose(sought, grown, mapping)
            exact = max(sought.tolerance_px, TOLERANCE_OF_RADIUS * stretch(mapping)[1])
            if square <= members * exact**2:
                most = members
                corners[found], squares[found], mappings[found] = grown, square, mapping
        found += most > 0
    return corners[:found], squares[:found], mappings[:found]


@compiled
def _perspectives(sought: Sought, start: np.ndarray) -> np.ndarray:
    """Perspectives (K, 2) to grow three corners with: none, and those of the two poses that have it in full."""
    guesses = np.zeros((3, 2))
    count = 1
    _, affine = fit_affine(sought, start, 0.0, 0.0)
    if stretch(affine)[0] / sought.focal_px < _GROWING_TOLERANCE / 2:
        return guesses[:1]
    for sign in (-1.0, 1.0):
        _, mapping = near_pose(sought, start, affine, sign)
        if np.hypot(mapping[2, 0], mapping[2, 1]) > _GROWING_TOLERANCE / 2:
            guesses[count] = mapping[2, :2]
            count += 1
    return guesses[:count]


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
def _grow(
    sought: Sought, order: np.ndarray, across: np.ndarray, start: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, float, np.ndarray]:
    """Grow a polygon from three corners and a guess at the perspective, from near corners to far ones."""
    points, sides = sought.points, len(sought.unit)
    corners = start.copy()
    places, off, nearest, spacing = np.empty((sides, 2)), np.empty(sides), np.empty(sides, np.int64), np.empty(sides)
    strict, is_new = 0, True
    mapping = np.eye(3)
    while True:
        if is_new:
            ok, mapping = _fit(sought, corners, guess)
            if not ok:
                return corners, -1.0, mapping
            _look(sought, order, across, mapping, places, spacing, off, nearest)
        if strict == _STRICT_ROUNDS:
            break
        exact = max(sought.tolerance_px, TOLERANCE_OF_RADIUS * stretch(mapping)[1])
        known, members, is_new = 0, 0, False
        grown = np.full(sides, -1)
        for c in range(sides):
            known += corners[c] >= 0
            within = min(_STRICT_TOLERANCE * spacing[c], exact) if strict else _GROWING_TOLERANCE * spacing[c]
            next_one, next_two = corners[(c + 1) % sides], corners[(c + 2) % sides]
            beside = max(corners[c - 2], corners[c - 1], corners[c], next_one, next_two) >= 0
            if off[c] < within and (strict > 0 or beside):
                grown[c] = nearest[c]
                members += 1
            is_new |= grown[c] != corners[c]
        if strict > 0 and not is_new:
            break
        if strict > 0 or members <= known:
            strict += 1
        corners = grown
        if members < 3:
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
def _look(
    sought: Sought,
    order: np.ndarray,
    across: np.ndarray,
    mapping: np.ndarray,
    places: np.ndarray,
    spacing: np.ndarray,
    off: np.ndarray,
    nearest: np.ndarray,
) -> None:
    """Set where a mapping puts the corners (N, 2), how far apart, and how far the nearest points are, and which."""
    points, unit, sides = sought.points, sought.unit, len(sought.unit)
    for c in range(sides):
        w = mapping[2, 0] * unit[c, 0] + mapping[2, 1] * unit[c, 1] + 1.0
        places[c, 0] = (mapping[0, 0] * unit[c, 0] + mapping[0, 1] * unit[c, 1] + mapping[0, 2]) / w
        places[c, 1] = (mapping[1, 0] * unit[c, 0] + mapping[1, 1] * unit[c, 1] + mapping[1, 2]) / w
    for c in range(sides):
        before, after = places[c - 1], places[(c + 1) % sides]
        spacing[c] = min(
            np.hypot(places[c, 0] - before[0], places[c, 1] - before[1]),
            np.hypot(places[c, 0] - after[0], places[c, 1] - after[1]),
        )
        # Only what is so near can become this corner: the points are looked through from left to right.
        reach, number = _GROWING_TOLERANCE * spacing[c], -1
        best = reach * reach
        for k in range(np.searchsorted(across, places[c, 0] - reach), len(across)):
            if across[k] > places[c, 0] + reach:
                break
            square = (across[k] - places[c, 0]) ** 2 + (points[order[k], 1] - places[c, 1]) ** 2
            if square < best:
                best, number = square, order[k]
        off[c], nearest[c] = np.sqrt(best) if number >= 0 else np.inf, number


@compiled
def _fit(sought: Sought, corners: np.ndarray, guess: np.ndarray) -> tuple[bool, np.ndarray]:
    """Homography (3, 3) of the unit circle's corners to the points, as near to a guess in perspective as they allow."""
    points, unit = sought.points, sought.unit
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
    # Both rows of the affine part have the same normal equations, and are eliminated: what is left is the perspective.
    normal, right, left = np.zeros((3, 3)), np.zeros((3, 6)), np.zeros((2, 2))
    p = np.empty((2, 1))
    for k in range(2):
        left[k, k] = _PERSPECTIVE_PRIOR**2 + 1e-12
        p[k, 0] = _PERSPECTIVE_PRIOR**2 * guess[k]
    for k in range(3):
        normal[k, k] = 1e-12
    for c in range(len(corners)):
        if corners[c] < 0:
            continue
        u, v = unit[c, 0], unit[c, 1]
        x, y = (points[corners[c], 0] - x0) / size, (points[corners[c], 1] - y0) / size
        far = x * x + y * y
        seen = (x, y, -u * x, -v * x, -u * y, -v * y)
        for i, place in enumerate((u, v, 1.0)):
            normal[i, 0] += place * u
            normal[i, 1] += place * v
            normal[i, 2] += place
            for j in range(6):
                right[i, j] += place * seen[j]
        p[0, 0] -= u * far
        p[1, 0] -= v * far
        left[0, 0] += u * u * far
        left[0, 1] += u * v * far
        left[1, 1] += v * v * far
    left[1, 0] = left[0, 1]
    affine = solve(normal, right.copy())
    for i in range(3):
        for j in range(2):
            x, y = right[i, 2 + j], right[i, 4 + j]
            p[j, 0] -= x * affine[i, 0] + y * affine[i, 1]
            for k in range(2):
                left[j, k] -= x * affine[i, 2 + k] + y * affine[i, 4 + k]
    solve(left, p)
    px, py = p[0, 0], p[1, 0]
    mapping = np.empty((3, 3))
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = px, py, 1.0
    for k in range(3):
        mapping[0, k] = size * (affine[k, 0] - affine[k, 2] * px - affine[k, 3] * py) + x0 * mapping[2, k]
        mapping[1, k] = size * (affine[k, 1] - affine[k, 4] * px - affine[k, 5] * py) + y0 * mapping[2, k]
    major, minor = stretch(mapping)
    # The scale changes across a dock by its radius over its range, which is its radius in the picture over the focal
    # length, times the sine of its tilt; what the lights' own noise feigns comes on top.
    most = _PERSPECTIVE_MARGIN * major / sought.focal_px + _NOISE_PX / max(minor, 1e-9)
    plausible = (
        minor >= max(SMALLEST_RADIUS_PX / 3, NARROWEST * major)
        and major >= SMALLEST_RADIUS_PX
        and np.hypot(px, py) <= most
    )
    return plausible, mapping


@compiled
def stretch(mapping: np.ndarray) -> tuple[float, float]:
    """Singular values, larger first, of how the mapping stretches around the circle's middle."""
    a = mapping[0, 0] - mapping[0, 2] * mapping[2, 0]
    b = mapping[0, 1] - mapping[0, 2] * mapping[2, 1]
    c = mapping[1, 0] - mapping[1, 2] * mapping[2, 0]
    d = mapping[1, 1] - mapping[1, 2] * mapping[2, 1]
    mean, apart = (a * a + b * b + c * c + d * d) / 2, abs(a * d - b * c)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    return major, apart / max(major, 1e-9)
