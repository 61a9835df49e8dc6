"""From three corners of a dock's polygon of lights to the whole: fit, look for the next corners, and fit again."""

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.reprojection import Sought, as_pose, fit_affine, one_pose, solve

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
        _, mapping = one_pose(sought, start, affine, sign)
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
    points, unit, sides = sought.points, sought.unit, len(sought.unit)
    corners = start.copy()
    places, off, nearest, spacing = np.empty((sides, 2)), np.empty(sides), np.empty(sides, np.int64), np.empty(sides)
    strict = 0
    mapping = np.eye(3)
    while True:
        ok, mapping = _fit(sought, corners, guess)
        if not ok:
            return corners, -1.0, mapping
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
        if strict == _STRICT_ROUNDS:
            break
        exact = max(sought.tolerance_px, TOLERANCE_OF_RADIUS * stretch(mapping)[1])
        known = 0
        grown = np.full(sides, -1)
        for c in range(sides):
            known += corners[c] >= 0
            within = min(_STRICT_TOLERANCE * spacing[c], exact) if strict else _GROWING_TOLERANCE * spacing[c]
            next_one, next_two = corners[(c + 1) % sides], corners[(c + 2) % sides]
            beside = max(corners[c - 2], corners[c - 1], corners[c], next_one, next_two) >= 0
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
    normal, right = np.zeros((8, 8)), np.zeros((8, 1))
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
                right[a, 0] += row[a] * seen
                for b in range(8):
                    normal[a, b] += row[a] * row[b]
    normal[6, 6] += _PERSPECTIVE_PRIOR**2
    normal[7, 7] += _PERSPECTIVE_PRIOR**2
    right[6, 0] += _PERSPECTIVE_PRIOR**2 * guess[0]
    right[7, 0] += _PERSPECTIVE_PRIOR**2 * guess[1]
    for a in range(8):
        normal[a, a] += 1e-12
    h = solve(normal, right)[:, 0]
    mapping = np.empty((3, 3))
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = h[6], h[7], 1.0
    for k in range(3):
        mapping[0, k] = size * h[k] + x0 * mapping[2, k]
        mapping[1, k] = size * h[3 + k] + y0 * mapping[2, k]
    major, minor = stretch(mapping)
    # The scale changes across a dock by its radius over its range, which is its radius in the picture over the focal
    # length, times the sine of its tilt; what the lights' own noise feigns comes on top.
    most = _PERSPECTIVE_MARGIN * major / sought.focal_px + _NOISE_PX / max(minor, 1e-9)
    plausible = (
        minor >= max(SMALLEST_RADIUS_PX / 3, NARROWEST * major)
        and major >= SMALLEST_RADIUS_PX
        and np.hypot(h[6], h[7]) <= most
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
