"""From three corners of a dock's polygon of lights to the whole: fit, look for the next corners, and fit again."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.chance import Scene, score_ring
from dockpose.lights.reprojection import RingTemplate, as_pose, fit_affine, inverse_of, near_pose, stretch, times

NARROWEST = 0.12  # minor to major axis: a dock seen at 83 degrees
SMALLEST_RADIUS_PX = 3.0  # of a smaller ring the lights are not apart
# Glow and lamp housings move a centre by a pixel or so, on a large ring by a share of it.
TOLERANCE_PX, TOLERANCE_OF_RADIUS = 1.5, 0.025
TOLERANCE_OF_AXIS = 0.02  # of the major semi-axis: how far off the ellipse a light's centre may lie
_GROWING_TOLERANCE, _STRICT_TOLERANCE = 0.22, 0.2  # of the spacing
_STRICT_ROUNDS = 3  # of looking for all corners where the last fit puts them
_PERSPECTIVE_MARGIN = 1.5  # focal lengths are not always well known
_NOISE_PX = 1.0  # of a centre, for what of a perspective may be feigned
_PERSPECTIVE_PRIOR = 0.03  # weight of the guess, beside a light's: weak, but it decides for three points


def distances(points_px: np.ndarray, others_px: np.ndarray) -> np.ndarray:
    """How far (N, M) each of some points (N, 2) is from each of others (M, 2)."""
    (x, y), (others_x, others_y) = points_px.T, others_px.T
    across, down = x[:, None] - others_x, y[:, None] - others_y
    return np.sqrt(across * across + down * down)


class _Growth(NamedTuple):
    """What growing writes to, made once for all triples."""

    corners: np.ndarray  # (N,): of the polygon that has grown
    mapping: np.ndarray  # (3, 3): of it
    start: np.ndarray  # (N,): the three corners it is grown from
    guesses: np.ndarray  # (3, 2): perspectives to grow it with
    places: np.ndarray  # (N, 2): where the mapping puts the corners
    spacing: np.ndarray  # (N,): how far apart
    off: np.ndarray  # (N,): how far the nearest point is from each, inf where none is near
    nearest: np.ndarray  # (N,): which that is
    right: np.ndarray  # (3, 6): of the normal equations
    affine: np.ndarray  # (3, 6): what solves them


@compiled
def _growth(sides: int) -> _Growth:
    """What a polygon of so many corners is grown in."""
    corners, start, nearest = np.empty(sides, np.int64), np.empty(sides, np.int64), np.empty(sides, np.int64)
    mapping, guesses, places = np.empty((3, 3)), np.empty((3, 2)), np.empty((sides, 2))
    spacing, off, right, affine = np.empty(sides), np.empty(sides), np.empty((3, 6)), np.empty((3, 6))
    return _Growth(corners, mapping, start, guesses, places, spacing, off, nearest, right, affine)


@compiled
def grow_all(
    template: RingTemplate, triples: np.ndarray, scene: Scene
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rings beyond chance that triples grow to: corners (K, N), squares (K,), homographies (K, 3, 3), chances (K,)."""
    sides, most = len(template.unit), len(triples)
    known, seen = np.full((most, sides), -1), 0
    corners, squares, mappings, chances = known.copy(), np.empty(most), np.empty((most, 3, 3)), np.empty(most)
    found, grown = 0, _growth(sides)
    order = np.argsort(template.points[:, 0])
    across = template.points[order, 0]
    for t in range(len(triples)):
        grown.start[:] = -1
        for k in range(3):
            grown.start[triples[t, 3 + k]] = triples[t, k]
        if _is_known(known, seen, grown.start):
            continue
        members, best = 0, np.inf
        for guess in range(_perspectives(template, grown)):
            square, count = _grow(template, order, across, guess, grown)
            if square < 0 or count <= members or _is_known(known, seen, grown.corners):
                continue
            square, mapping = as_pose(template, grown.corners, grown.mapping)
            exact = max(template.tolerance_px, TOLERANCE_OF_RADIUS * stretch(mapping)[1])
            if square > count * exact**2:
                continue
            members, known[seen] = count, grown.corners
            ring = score_ring(template, grown.corners, square, mapping, scene, True, False, True)
            best, corners[found], squares[found], mappings[found] = ring
        seen += members > 0
        if best < np.inf:
            chances[found] = best
            found += 1
    return corners[:found], squares[:found], mappings[:found], chances[:found]


@compiled_bare
def _perspectives(template: RingTemplate, grown: _Growth) -> int:
    """Set the perspectives to grow three corners with: none, and those of the two poses that have it in full."""
    guesses, count, mapping = grown.guesses, 1, grown.mapping
    guesses[0, 0], guesses[0, 1] = 0.0, 0.0
    fit_affine(template, grown.start, 0.0, 0.0, mapping)
    if stretch(mapping)[0] / template.focal_px < _GROWING_TOLERANCE / 2:
        return count
    for sign in (-1.0, 1.0):
        fit_affine(template, grown.start, 0.0, 0.0, mapping)
        near_pose(template, grown.start, sign, mapping)
        if mapping[2, 0] ** 2 + mapping[2, 1] ** 2 > (_GROWING_TOLERANCE / 2) ** 2:
            guesses[count, 0], guesses[count, 1] = mapping[2, 0], mapping[2, 1]
            count += 1
    return count


@compiled_bare
def _is_known(known: np.ndarray, seen: int, corners: np.ndarray) -> bool:
    """Whether the points of ``corners`` are part of one of the first polygons (K, N), in the same order around it."""
    sides = len(corners)
    for row in range(seen):
        shift, same, mirrored = -1, True, True
        flip = -1
        for corner in range(sides):
            if corners[corner] < 0:
                continue
            place = -1
            for other in range(sides):
                if known[row, other] == corners[corner]:
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


@compiled_bare
def _grow(
    template: RingTemplate, order: np.ndarray, across: np.ndarray, guess: int, grown: _Growth
) -> tuple[float, int]:
    """Grow a polygon from three corners and a guess at the perspective, from near corners to far ones.

    The squares, below 0 where there is no polygon, and how many points it has.
    """
    points, corners, sides = template.points, grown.corners, len(template.unit)
    places, spacing, off, nearest = grown.places, grown.spacing, grown.off, grown.nearest
    for c in range(sides):
        corners[c] = grown.start[c]
    strict, is_new, members = 0, True, 3
    while True:
        if is_new:
            if not _fit(template, guess, grown):
                return -1.0, members
            _look(template, order, across, grown)
        if strict == _STRICT_ROUNDS:
            break
        exact = max(template.tolerance_px, TOLERANCE_OF_RADIUS * stretch(grown.mapping)[1])
        known, members, is_new = members, 0, False
        # Corners change as they are looked at, and the first two are neighbours of the last.
        first, second, before, one_before = corners[0], corners[1], corners[sides - 2], corners[sides - 1]
        for c in range(sides):
            own = corners[c]
            next_one = corners[c + 1] if c + 1 < sides else first
            next_two = corners[c + 2] if c + 2 < sides else (first if c + 2 == sides else second)
            within = min(_STRICT_TOLERANCE * spacing[c], exact) if strict else _GROWING_TOLERANCE * spacing[c]
            beside = max(before, one_before, own, next_one, next_two) >= 0
            is_in = off[c] < within and (strict > 0 or beside)
            corners[c] = nearest[c] if is_in else -1
            members += is_in
            is_new |= corners[c] != own
            before, one_before = one_before, own
        if strict > 0 and not is_new:
            break
        if strict > 0 or members <= known:
            strict += 1
        if members < 3:
            return -1.0, members
    squares, members = 0.0, 0
    for c in range(sides):
        if corners[c] < 0:
            continue
        members += 1
        squares += (points[corners[c], 0] - places[c, 0]) ** 2 + (points[corners[c], 1] - places[c, 1]) ** 2
        for other in range(c):
            if corners[other] == corners[c]:
                return -1.0, members
    return (squares if members >= 4 else -1.0), members


@compiled_bare
def _look(template: RingTemplate, order: np.ndarray, across: np.ndarray, grown: _Growth) -> None:
    """Set where the mapping puts the corners, how far apart, how far the nearest points are, and which."""
    points, unit, sides, mapping = template.points, template.unit, len(template.unit), grown.mapping
    places, spacing, off, nearest = grown.places, grown.spacing, grown.off, grown.nearest
    for c in range(sides):
        w = mapping[2, 0] * unit[c, 0] + mapping[2, 1] * unit[c, 1] + 1.0
        places[c, 0] = (mapping[0, 0] * unit[c, 0] + mapping[0, 1] * unit[c, 1] + mapping[0, 2]) / w
        places[c, 1] = (mapping[1, 0] * unit[c, 0] + mapping[1, 1] * unit[c, 1] + mapping[1, 2]) / w
    for c in range(sides):
        last, further = c - 1 if c else sides - 1, c + 1 if c < sides - 1 else 0
        before = (places[c, 0] - places[last, 0]) ** 2 + (places[c, 1] - places[last, 1]) ** 2
        after = (places[c, 0] - places[further, 0]) ** 2 + (places[c, 1] - places[further, 1]) ** 2
        spacing[c] = np.sqrt(min(before, after))
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


@compiled_bare
def _fit(template: RingTemplate, guess: int, grown: _Growth) -> bool:
    """Set the homography of the unit circle's corners to the points, as near to a guess in perspective as they allow.

    Whether that may be a dock's.
    """
    points, unit, corners, mapping = template.points, template.unit, grown.corners, grown.mapping
    right, affine = grown.right, grown.affine
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
    uu, uv, u1, vv, v1, ones = 1e-12, 0.0, 0.0, 1e-12, 0.0, 1e-12
    prior = _PERSPECTIVE_PRIOR**2
    pa, pb = prior * grown.guesses[guess, 0], prior * grown.guesses[guess, 1]
    aa, ab, bb = prior + 1e-12, 0.0, prior + 1e-12
    right[:] = 0.0
    for c in range(len(corners)):
        if corners[c] < 0:
            continue
        u, v = unit[c, 0], unit[c, 1]
        x, y = (points[corners[c], 0] - x0) / size, (points[corners[c], 1] - y0) / size
        uu, uv, u1, vv, v1, ones = uu + u * u, uv + u * v, u1 + u, vv + v * v, v1 + v, ones + 1
        for column, seen in enumerate((x, y, -u * x, -v * x, -u * y, -v * y)):
            right[0, column] += u * seen
            right[1, column] += v * seen
            right[2, column] += seen
        far = x * x + y * y
        aa, ab, bb, pa, pb = aa + u * u * far, ab + u * v * far, bb + v * v * far, pa - u * far, pb - v * far
    uu, uv, u1, vv, v1, ones = inverse_of(uu, uv, u1, vv, v1, ones)
    for column in range(6):
        u, v, one = right[0, column], right[1, column], right[2, column]
        affine[0, column], affine[1, column], affine[2, column] = times(uu, uv, u1, vv, v1, ones, u, v, one)
    for i in range(3):
        pa -= right[i, 2] * affine[i, 0] + right[i, 4] * affine[i, 1]
        pb -= right[i, 3] * affine[i, 0] + right[i, 5] * affine[i, 1]
        aa -= right[i, 2] * affine[i, 2] + right[i, 4] * affine[i, 4]
        ab -= right[i, 2] * affine[i, 3] + right[i, 4] * affine[i, 5]
        bb -= right[i, 3] * affine[i, 3] + right[i, 5] * affine[i, 5]
    by = 1 / max(aa * bb - ab * ab, 1e-300)
    px, py = by * (bb * pa - ab * pb), by * (aa * pb - ab * pa)
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = px, py, 1.0
    for k in range(3):
        mapping[0, k] = size * (affine[k, 0] - affine[k, 2] * px - affine[k, 3] * py) + x0 * mapping[2, k]
        mapping[1, k] = size * (affine[k, 1] - affine[k, 4] * px - affine[k, 5] * py) + y0 * mapping[2, k]
    major, minor = stretch(mapping)
    # The scale changes across a dock by its radius over its range, which is its radius in the picture over the focal
    # length, times the sine of its tilt; what the lights' own noise feigns comes on top.
    most = _PERSPECTIVE_MARGIN * major / template.focal_px + _NOISE_PX / max(minor, 1e-9)
    is_wide = minor >= max(SMALLEST_RADIUS_PX / 3, NARROWEST * major) and major >= SMALLEST_RADIUS_PX
    return is_wide and px * px + py * py <= most * most
