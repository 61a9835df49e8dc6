"""Centres of lights by maximum likelihood, with covariances: blurred discs on sloping water, compiled by numba."""

import math

import numpy as np
from dockpose.compiled import compiled, compiled_bare, compiled_sum, compiled_within
from dockpose.lights.centroids import is_nearest, median_along_edge, nearest, window_at
from dockpose.lights.reprojection import solve
from dockpose.lights.vignetting import undo_slopes

# Rounds of Gauss and Newton's method. A centre that moves by less than this share of its standard deviation, while the
# squares should fall by less than that share, has settled: what is left adds 2 % to its error. A small lamp's radius
# and blur, of which each can stand for the other, settle far later.
_ROUNDS, _SETTLED, _FALLEN = 12, 0.2, 0.05
_FINE_PX = 40  # from the middle to the edge of a window, beyond which squares do, for time
_LEAST_PIXELS, _NUMBERS = 16, 11  # of a window; numbers that a fit finds
_BLUR_PX, _LEAST_BLUR_PX = 0.85, 0.3  # of a lens, to begin with
# A white light is seen where its flank begins: so many times as bright, and smaller by so much, to begin with.
_OVER_WHITE, _WIDER_BY_PX = 2.5, 0.7
_FLAT = 4.0  # blurs beyond an edge, from which on a light is even to 3e-5 of its height
_LONGEST = 0.3  # share of a light's height, radius, blur or axes in one round
_DAMPED, _ROUND = 0.01, 0.05  # share of the diagonal; standard deviation that is expected of a light's two axes
_FOOT = 0.2  # of a light's height, from which on its area is counted
# Share of a light's height by which a pixel may be off beyond its noise, root mean square, or it is no such disc. The
# noise is what neighbours differ by, known to one over the root of their number (von Neumann 1941). So many standard
# deviations are left to chance.
_SHAPELESS, _CHANCE = 0.05, 3.0
_ANYWHERE = 0.25  # variance along an axis of what may be anywhere in a disc, over the square of its radius
_FARTHEST_PX, _FARTHEST = 0.5, 0.2  # from where it began, or a share of its radius: no light of this shape
# The normal distribution and its density from -_FLAT to _FLAT, in steps so small that lines between them are 1e-5 off.
_PER_BLUR = 64
_STEPS = np.arange(2 * int(_FLAT) * _PER_BLUR + 2) / _PER_BLUR - _FLAT
_BELOW = np.array([(1 + math.erf(step / math.sqrt(2))) / 2 for step in _STEPS])
_DENSITY = np.exp(-_STEPS * _STEPS / 2) / math.sqrt(2 * math.pi)


def fitted_centres(
    grey: np.ndarray,
    points: np.ndarray,
    reach: np.ndarray,
    white: float,
    middle: np.ndarray,
    far_px: float,
    shapes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (N, 2) and covariances (N, 2, 2) of lights near points (N, 2).

    Where a light has no such shape the centre is the point and the covariance large, or NaN where nothing is known.
    ``middle`` (2,) is the lens's, and ``far_px`` how far a corner of the whole picture is from it. ``shapes`` (N, 6)
    are those to begin with, in pixels, of a height of 0 where none is known, and become those that are found.
    """
    covariances, slopes = np.full((len(points), 2, 2), np.nan), np.full((len(points), 2, 5), np.nan)
    found = points.copy(), covariances, slopes, np.zeros(len(points))
    _fit_all(grey, points, reach, white, shapes, found)
    undo_slopes(*found, (points - middle) / far_px**2)
    return found[:2]


@compiled
def _fit_all(
    grey: np.ndarray,
    points: np.ndarray,
    reach: np.ndarray,
    white: float,
    shapes: np.ndarray,
    found: tuple[np.ndarray, ...],
) -> None:
    """Fill in what the fit of each light finds: centres, covariances, slopes (N, 2, 5) and radii (N,); and shapes."""
    centres, covariances, slopes, radii = found
    height, width = grey.shape
    for light in range(len(points)):
        if reach[light] == 0 or not (0 <= points[light, 0] < width and 0 <= points[light, 1] < height):
            continue
        side = 1 + 2 * ((reach[light] + _FINE_PX - 1) // (2 * _FINE_PX))
        pixels, water = _pixels(grey, points, light, reach[light], side)
        if len(pixels) >= _LEAST_PIXELS:
            shapes[light, 1], shapes[light, 2] = shapes[light, 1] / side, shapes[light, 2] / side
            x, y, radius = _fit(pixels, white - water, covariances[light], slopes[light], shapes[light])
            shapes[light, 1], shapes[light, 2] = shapes[light, 1] * side, shapes[light, 2] * side
            centres[light, 0], centres[light, 1] = centres[light, 0] + side * x, centres[light, 1] + side * y
            radii[light] = side * radius
            for row in range(2):
                slopes[light, row, 0] /= side
                for column in range(2):
                    covariances[light, row, column] *= side**2
                    slopes[light, row, 1 + column] /= side**2
                    slopes[light, row, 3 + column] *= side**2


@compiled_within
def _pixels(grey: np.ndarray, points: np.ndarray, light: int, far: int, side: int) -> tuple[np.ndarray, float]:
    """x, y from the light and level above the water (K, 3) of its pixels whose mirrored ones are its own; the water.

    Of a large light they are squares, of an odd number of pixels a side so that their middles are pixels, and the unit.
    """
    x0, y0 = points[light, 0], points[light, 1]
    row, column = round(y0), round(x0)
    top, bottom, left, right = window_at(grey, row, column, far)
    water = median_along_edge(grey, top, bottom, left, right)
    beside = nearest(points, light, 3.0 * far)
    half, most = side // 2, 2 * far // side + 1
    pixels, count = np.empty(((most + 1) ** 2, 3)), 0
    across, down = round(2 * x0), round(2 * y0)  # of a pixel and the one that mirrors it, together
    for y_step in range(-most + (most + down) % 2, most + 1, 2):
        y = (down + side * y_step) // 2
        mirrored_y = down - y
        if min(y, mirrored_y) - half < top or max(y, mirrored_y) + half > bottom:
            continue
        for x_step in range(-most + (most + across) % 2, most + 1, 2):
            x = (across + side * x_step) // 2
            mirrored_x = across - x
            if min(x, mirrored_x) - half < left or max(x, mirrored_x) + half > right:
                continue
            if is_nearest(points, light, beside, x, y) and is_nearest(points, light, beside, mirrored_x, mirrored_y):
                pixels[count, 0], pixels[count, 1] = (x - x0) / side, (y - y0) / side
                pixels[count, 2] = _mean(grey, x, y, half) - water
                count += 1
    return pixels[:count], water


@compiled_bare
def _mean(grey: np.ndarray, x: int, y: int, half: int) -> float:
    """Mean of the square that goes so many pixels to each side of one."""
    total = 0.0
    for row in range(y - half, y + half + 1):
        for column in range(x - half, x + half + 1):
            total += grey[row, column]
    return total / (2 * half + 1) ** 2


@compiled_within
def _fit(
    pixels: np.ndarray, white: float, covariance: np.ndarray, slope: np.ndarray, start: np.ndarray
) -> tuple[float, float, float]:
    """Centre x, y of a light of any height, radius, blur and axes by Gauss and Newton's method, and its radius.

    All are 0 where there is none, and the radius where the light is white. Its centre and the water's slope are odd
    about the centre and all else is even, so that neither depends on the other (Kay 1993, section 7.8). Pixels that are
    white, or that the light makes so, say nothing. What is off the shape by a share of its height, and longer than
    wide, may be off its place by such a share of its radius.
    """
    odd, none = np.zeros(4), (0.0, 0.0, 0.0)
    shape = start.copy() if start[0] > 0 else _first_shape(pixels, white)
    shape[3], start[0] = 0.0, 0.0
    if shape[0] <= 0:
        return none
    reach = max(_FARTHEST_PX, _FARTHEST * shape[1])
    odd_rows, even_rows = np.empty((7, len(pixels))), np.empty((7, len(pixels)))
    A, step, noise, sigma, used = np.zeros((7, 7)), np.zeros((4, 3)), 0.0, 0.0, 0
    for _ in range(_ROUNDS):
        used = _rows(pixels, white, shape, odd, odd_rows, even_rows)
        A, E = _products(odd_rows, used), _products(even_rows, used)
        if used < _LEAST_PIXELS or A[0, 0] <= 0 or A[1, 1] <= 0:
            return none
        squares, freedom = A[6, 6], max(1, used - _NUMBERS)
        noise = squares / freedom
        fallen = _change_shape(shape, E, max(noise, 1e-3) / _ROUND**2)
        step = _step(A)
        shift = min(1.0, _FARTHEST_PX / max(1e-12, math.hypot(step[0, 0], step[1, 0])))
        for number in range(4):
            odd[number] += shift * step[number, 0]
            fallen += step[number, 0] * A[number, 6]
        sigma = math.sqrt(noise * (step[0, 1] + step[1, 2]))
        if math.hypot(step[0, 0], step[1, 0]) < _SETTLED * sigma and fallen < _FALLEN * squares:
            noise = (squares - fallen) / freedom
            break
    wrong = (noise * (1 - _CHANCE / math.sqrt(used)) - _rough(odd_rows[6], used)) / min(shape[0], white) ** 2
    if wrong > _SHAPELESS**2:
        anywhere = min(wrong + shape[4] ** 2 + shape[5] ** 2, _ANYWHERE) * shape[1] ** 2
        covariance[0, 0], covariance[0, 1], covariance[1, 0], covariance[1, 1] = anywhere, 0.0, 0.0, anywhere
        return none
    if not math.hypot(odd[0], odd[1]) < reach + _CHANCE * sigma:
        return none
    covariance[0, 0], covariance[0, 1] = step[0, 1] * noise, step[0, 2] * noise
    covariance[1, 0], covariance[1, 1] = step[1, 1] * noise, step[1, 2] * noise
    _find_slope(A, noise, slope)
    for number in range(len(shape)):
        start[number] = shape[number]
    return odd[0], odd[1], shape[1] if shape[0] < white else 0.0


@compiled_within
def _first_shape(pixels: np.ndarray, white: float) -> np.ndarray:
    """Height above the water, radius, blur, level of the water, and how much longer than wide along x and askew."""
    height = 0.0
    for pixel in range(len(pixels)):
        if abs(pixels[pixel, 0]) <= 1 and abs(pixels[pixel, 1]) <= 1:
            height = max(height, pixels[pixel, 2])
    total = 0.0
    for pixel in range(len(pixels)):
        total += max(0.0, pixels[pixel, 2] - _FOOT * height)
    radius = math.sqrt(total / max((1 - _FOOT) * height, 1e-9) / math.pi)
    if height >= white:
        height, radius = _OVER_WHITE * white, radius - _WIDER_BY_PX
    shape = np.zeros(6)
    shape[0], shape[1], shape[2] = height, max(radius, _LEAST_BLUR_PX), _BLUR_PX
    return shape


@compiled_bare
def _rows(
    pixels: np.ndarray, white: float, shape: np.ndarray, odd: np.ndarray, odd_rows: np.ndarray, even_rows: np.ndarray
) -> int:
    """Fill rows (7, K): slopes of the levels by the odd and the even numbers, and residuals; how many pixels count."""
    height, radius, blur, water, longer, askew = shape[0], shape[1], shape[2], shape[3], shape[4], shape[5]
    over_blur, x0, y0, slope_x, slope_y = 1 / blur, odd[0], odd[1], odd[2], odd[3]
    used = 0
    for pixel in range(len(pixels)):
        dx, dy, level = pixels[pixel, 0] - x0, pixels[pixel, 1] - y0, pixels[pixel, 2]
        off = math.sqrt(max((1 - longer) * dx * dx + (1 + longer) * dy * dy - 2 * askew * dx * dy, 1e-9))
        inner, inner_slope = _normal((radius - off) * over_blur)
        outer, outer_slope = _normal((radius + off) * over_blur)
        share = inner + outer - 1
        expected = height * share + water + slope_x * dx + slope_y * dy
        if expected >= white:
            continue
        steep = height * (inner_slope - outer_slope) * over_blur / off  # of the flank, over the distance
        wider = height * (inner_slope + outer_slope) * over_blur
        odd_rows[0, used] = steep * ((1 - longer) * dx - askew * dy)
        odd_rows[1, used] = steep * ((1 + longer) * dy - askew * dx)
        odd_rows[2, used], odd_rows[3, used] = dx, dy
        odd_rows[4, used], odd_rows[5, used] = height * share * dx, height * share * dy
        even_rows[0, used], even_rows[1, used], even_rows[3, used] = share, wider, 1.0
        even_rows[2, used] = (off * off * steep - radius * wider) * over_blur
        even_rows[4, used], even_rows[5, used] = steep * (dx * dx - dy * dy) / 2, steep * dx * dy
        odd_rows[6, used] = even_rows[6, used] = level - expected
        used += 1
    return used


@compiled
def _products(rows: np.ndarray, used: int) -> np.ndarray:
    """Sums (7, 7) of the products of each two rows (7, K), of their first so many pixels."""
    products = np.empty((7, 7))
    for one in range(7):
        for other in range(one + 1):
            products[one, other] = products[other, one] = _dot(rows, one, other, used)
    return products


@compiled_sum
def _dot(rows: np.ndarray, one: int, other: int, used: int) -> float:
    """Sum of the products of two of rows (7, K), of their first so many pixels."""
    total = 0.0
    for pixel in range(used):
        total += rows[one, pixel] * rows[other, pixel]
    return total


@compiled_bare
def _rough(residuals: np.ndarray, used: int) -> float:
    """Variance of the noise of neighbouring pixels, the first of (K,), which a wrong shape moves together."""
    squares = 0.0
    for pixel in range(1, used):
        squares += (residuals[pixel] - residuals[pixel - 1]) ** 2
    return squares / (2 * (used - 1))


@compiled_bare
def _normal(x: float) -> tuple[float, float]:
    """The normal distribution, and its slope."""
    if x >= _FLAT:
        return 1.0, 0.0
    if x <= -_FLAT:
        return 0.0, 0.0
    place = int((x + _FLAT) * _PER_BLUR)
    beyond = (x + _FLAT) * _PER_BLUR - place
    below = _BELOW[place] + beyond * (_BELOW[place + 1] - _BELOW[place])
    return below, _DENSITY[place] + beyond * (_DENSITY[place + 1] - _DENSITY[place])


@compiled_within
def _change_shape(shape: np.ndarray, E: np.ndarray, stiffness: float) -> float:
    """Change a light's shape by a step, no more than a step may; by how much the squares should fall."""
    for number in range(6):
        E[number, number] = E[number, number] * (1 + _DAMPED) + 1e-9
    for number in (4, 5):
        E[number, number] += stiffness
        E[number, 6] -= stiffness * shape[number]
    step, fallen = np.empty((6, 1)), 0.0
    for number in range(6):
        step[number, 0] = E[number, 6]
    solve(E, step)
    for number in range(6):
        fallen += step[number, 0] * E[number, 6]
    for number in range(3):
        most = _LONGEST * shape[number] + (_LEAST_BLUR_PX if number == 1 else 0.0)
        shape[number] += min(max(step[number, 0], -most), most)
    shape[1], shape[2] = max(shape[1], 0.05), max(shape[2], _LEAST_BLUR_PX)
    shape[3] += step[3, 0]
    for number in (4, 5):
        shape[number] = min(max(shape[number] + step[number, 0], -2 * _LONGEST), 2 * _LONGEST)
    return fallen


@compiled_within
def _step(A: np.ndarray) -> np.ndarray:
    """Step (4, 3) of centre and slope of the water, and the inverse's first two columns."""
    scaled, step = A.copy(), np.zeros((4, 3))
    for number in range(4):
        scaled[number, number] *= 1 + 1e-9
        step[number, 0] = A[number, 6]
    step[0, 1], step[1, 2] = 1.0, 1.0
    solve(scaled, step)
    return step


@compiled_within
def _find_slope(A: np.ndarray, noise: float, slope: np.ndarray) -> None:
    """Fill in (2, 5) the slope of a light's own brightness, its covariance, and how the slope moves the centre."""
    scaled, found, moved = A.copy(), np.zeros((6, 3)), np.empty((4, 2))
    for number in range(6):
        scaled[number, number] *= 1 + 1e-9
        found[number, 0] = A[number, 6]
        if number < 4:
            moved[number, 0], moved[number, 1] = -A[number, 4], -A[number, 5]
    found[4, 1], found[5, 2] = 1.0, 1.0
    solve(scaled, found)
    solve(A, moved)
    for row in range(2):
        slope[row, 0] = found[4 + row, 0]
        for column in range(2):
            slope[row, 1 + column] = noise * found[4 + row, 1 + column]
            slope[row, 3 + column] = moved[row, column]
