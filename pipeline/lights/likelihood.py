"""Centres of lights by maximum likelihood, with covariances: blurred discs on sloping water, compiled by numba."""

import math

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.centroids import beyond_noise, is_nearest, median_along_edge, nearest, window_at
from dockpose.lights.reprojection import solve

# Rounds of Gauss and Newton's method. A centre that moves by less than this share of its standard deviation, while the
# squares fall by less than that share, has settled: what is left adds 2 % to its error. A small lamp's radius and blur,
# of which each can stand for the other, settle far later.
_ROUNDS, _SETTLED, _FALLEN = 12, 0.2, 0.05
_LEAST_PIXELS, _NUMBERS = 16, 11  # of a window; numbers that a fit finds
_BLUR_PX, _LEAST_BLUR_PX = 0.85, 0.3  # of a lens, to begin with
# A white light is seen where its flank begins: so many times as bright, and smaller by so much, to begin with.
_OVER_WHITE, _WIDER_BY_PX = 2.5, 0.7
_FLAT = 4.0  # blurs beyond an edge, from which on a light is even to 3e-5 of its height
_LONGEST = 0.3  # share of a light's height, radius, blur or axes in one round
_DAMPED, _ROUND = 0.01, 0.05  # share of the diagonal; standard deviation that is expected of a light's two axes
# Lamps so large have a slope of their own; it is told as far as it exceeds so many variances.
_SLOPED_PX, _SURE = 5.0, 4.0
_FOOT = 0.2  # of a light's height, from which on its area is counted
_SHAPELESS = 0.05  # share of a light's height by which a pixel may be off, root mean square, or it is no such disc
_FARTHEST_PX, _FARTHEST = 0.5, 0.2  # from where it began, or a share of its radius: no light of this shape
# Logistic approximation of the normal distribution, to 1.4e-4 (Page 1977).
_LINEAR, _CUBIC = 1.5976, 0.07056


@compiled
def fitted_centres(
    grey: np.ndarray, points: np.ndarray, reach: np.ndarray, white: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (N, 2) and covariances (N, 2, 2) of lights near points (N, 2), NaN where none is fitted."""
    centres, covariances = points.copy(), np.full((len(points), 2, 2), np.nan)
    for light in range(len(points)):
        if reach[light] == 0:
            continue
        pixels, water = _pixels(grey, points, light, reach[light])
        if len(pixels) >= _LEAST_PIXELS:
            _fit(pixels, white - water, centres[light], covariances[light])
    return centres, covariances


@compiled
def _pixels(grey: np.ndarray, points: np.ndarray, light: int, far: int) -> tuple[np.ndarray, float]:
    """x, y and level above the water (K, 3) of a light's pixels, whose mirrored ones are its own too; the water."""
    x0, y0 = points[light]
    row, column = int(np.rint(y0)), int(np.rint(x0))
    top, bottom, left, right = window_at(grey, row, column, far)
    water = median_along_edge(grey, top, bottom, left, right)
    beside = nearest(points, light, 3.0 * far)
    pixels, count = np.empty(((bottom - top + 1) * (right - left + 1), 3)), 0
    for y in range(top, bottom + 1):
        mirrored_y = int(np.rint(2 * y0 - y))
        for x in range(left, right + 1):
            mirrored_x = int(np.rint(2 * x0 - x))
            if not (top <= mirrored_y <= bottom and left <= mirrored_x <= right):
                continue
            is_own = is_nearest(points, light, beside, x, y)
            if is_own and is_nearest(points, light, beside, mirrored_x, mirrored_y):
                pixels[count, 0], pixels[count, 1], pixels[count, 2] = x, y, grey[y, x] - water
                count += 1
    return pixels[:count], water


@compiled
def _fit(pixels: np.ndarray, white: float, centre: np.ndarray, covariance: np.ndarray) -> None:
    """Fit a light of any height, radius, blur and axes by Gauss and Newton's method; NaN where there is none.

    Its centre and the water's slope are odd about the centre and all else is even, so that neither depends on the
    other (Kay 1993, section 7.8). Pixels that are white, or that the light makes so, say nothing.
    """
    shape, odd, even = _first_shape(pixels, white, centre), np.zeros(4), np.zeros((6, 1))
    if shape[0] <= 0:
        return
    x0, y0, radius = centre[0], centre[1], shape[1]
    odd[0], odd[1] = x0, y0
    A, right, E = np.empty((6, 6)), np.empty((6, 1)), np.empty((6, 6))
    is_sloped = radius > _SLOPED_PX and shape[0] < white
    step, noise, before = np.zeros((4, 3)), 0.0, math.inf
    for _ in range(_ROUNDS):
        squares, used = _sums(pixels, white, shape, odd, 6 if is_sloped else 4, A, right, E, even)
        if used < _LEAST_PIXELS or A[0, 0] <= 0 or A[1, 1] <= 0:
            return
        noise = squares / max(1, used - _NUMBERS)
        for number in range(6):
            E[number, number] = E[number, number] * (1 + _DAMPED) + 1e-9
        for number in (4, 5):
            E[number, number] += max(noise, 1e-3) / _ROUND**2
            even[number, 0] -= max(noise, 1e-3) / _ROUND**2 * shape[number]
        solve(E, even)
        _reshape(shape, even)
        step = _step(A, right, noise, is_sloped)
        shift = min(1.0, _FARTHEST_PX / max(1e-12, math.hypot(step[0, 0], step[1, 0])))
        for number in range(4):
            odd[number] += shift * step[number, 0]
        sigma = math.sqrt(noise * (step[0, 1] + step[1, 2]))
        if math.hypot(step[0, 0], step[1, 0]) < _SETTLED * sigma and noise > (1 - _FALLEN) * before:
            break
        before = noise
    if noise > (_SHAPELESS * min(shape[0], white)) ** 2:
        return
    if not math.hypot(odd[0] - x0, odd[1] - y0) < max(_FARTHEST_PX, _FARTHEST * radius):
        return
    centre[0], centre[1] = odd[0], odd[1]
    for row in range(2):
        for column in range(2):
            covariance[row, column] = step[row, 1 + column] * noise


@compiled
def _first_shape(pixels: np.ndarray, white: float, centre: np.ndarray) -> np.ndarray:
    """Height above the water, radius, blur, level of the water, and how much longer than wide along x and askew."""
    height = 0.0
    for x, y, level in pixels:
        if abs(x - centre[0]) <= 1 and abs(y - centre[1]) <= 1:
            height = max(height, level)
    total = 0.0
    for _, _, level in pixels:
        total += max(0.0, level - _FOOT * height)
    radius = math.sqrt(total / max((1 - _FOOT) * height, 1e-9) / math.pi)
    if height >= white:
        height, radius = _OVER_WHITE * white, radius - _WIDER_BY_PX
    return np.array([height, max(radius, _LEAST_BLUR_PX), _BLUR_PX, 0.0, 0.0, 0.0])


@compiled
def _sums(
    pixels: np.ndarray,
    white: float,
    shape: np.ndarray,
    odd: np.ndarray,
    numbers: int,
    A: np.ndarray,
    right: np.ndarray,
    E: np.ndarray,
    even: np.ndarray,
) -> tuple[float, int]:
    """Normal equations of 4 odd numbers, 6 with the own slope, and of the even ones; squares; pixels that count."""
    height, radius, blur, water, longer, askew = shape
    A[:], right[:], E[:], even[:] = 0.0, 0.0, 0.0, 0.0
    a, b = np.zeros(6), np.zeros(6)
    squares, used = 0.0, 0
    for x, y, level in pixels:
        dx, dy = x - odd[0], y - odd[1]
        off = math.sqrt(max((1 - longer) * dx * dx + (1 + longer) * dy * dy - 2 * askew * dx * dy, 1e-9))
        inner, inner_slope = _normal((radius - off) / blur)
        outer, outer_slope = _normal((radius + off) / blur)
        share = inner + outer - 1
        expected = height * share + water + odd[2] * dx + odd[3] * dy
        if expected >= white:
            continue
        rest = level - expected
        squares, used = squares + rest * rest, used + 1
        if inner == 0:  # water alone
            right[2, 0], right[3, 0], even[3, 0] = right[2, 0] + dx * rest, right[3, 0] + dy * rest, even[3, 0] + rest
            A[2, 2], A[3, 2], A[3, 3], E[3, 3] = A[2, 2] + dx * dx, A[3, 2] + dx * dy, A[3, 3] + dy * dy, E[3, 3] + 1
            continue
        steep = height * (inner_slope - outer_slope) / (blur * off)  # of the flank, over the distance
        a[0], a[1] = steep * ((1 - longer) * dx - askew * dy), steep * ((1 + longer) * dy - askew * dx)
        a[2], a[3], a[4], a[5] = dx, dy, height * share * dx, height * share * dy
        wider = inner_slope + outer_slope
        b[0], b[1], b[3] = share, height * wider / blur, 1.0
        b[2] = -height * (radius * wider + off * (outer_slope - inner_slope)) / (blur * blur)
        b[4], b[5] = steep * (dx * dx - dy * dy) / 2, steep * dx * dy
        for one in range(numbers):
            right[one, 0] += a[one] * rest
            for other in range(one + 1):
                A[one, other] += a[one] * a[other]
        for one in range(6):
            even[one, 0] += b[one] * rest
            for other in range(one + 1):
                E[one, other] += b[one] * b[other]
    for one in range(6):
        for other in range(one):
            A[other, one], E[other, one] = A[one, other], E[one, other]
    return squares, used


@compiled
def _normal(x: float) -> tuple[float, float]:
    """The normal distribution, and its slope."""
    if x > _FLAT:
        return 1.0, 0.0
    if x < -_FLAT:
        return 0.0, 0.0
    value = 1 / (1 + math.exp(-x * (_LINEAR + _CUBIC * x * x)))
    return value, value * (1 - value) * (_LINEAR + 3 * _CUBIC * x * x)


@compiled
def _reshape(shape: np.ndarray, step: np.ndarray) -> None:
    """Change a light's shape by no more than a step may."""
    for number in range(3):
        most = _LONGEST * shape[number] + (_LEAST_BLUR_PX if number == 1 else 0.0)
        shape[number] += min(max(step[number, 0], -most), most)
    shape[1], shape[2] = max(shape[1], 0.05), max(shape[2], _LEAST_BLUR_PX)
    shape[3] += step[3, 0]
    for number in (4, 5):
        shape[number] = min(max(shape[number] + step[number, 0], -2 * _LONGEST), 2 * _LONGEST)


@compiled
def _step(A: np.ndarray, right: np.ndarray, noise: float, is_sloped: bool) -> np.ndarray:
    """Step (4, 3) of centre and slope of the water, and the inverse's first two columns."""
    for number in range(6):
        A[number, number] *= 1 + 1e-9
    slope_x, slope_y = 0.0, 0.0
    if is_sloped:
        whole, found = A.copy(), np.zeros((6, 3))
        found[:, 0] = right[:, 0]
        found[4, 1], found[5, 2] = 1.0, 1.0
        solve(whole, found)
        slope_x = beyond_noise(found[4, 0], _SURE * noise * found[4, 1])
        slope_y = beyond_noise(found[5, 0], _SURE * noise * found[5, 2])
    four, step = A[:4, :4].copy(), np.zeros((4, 3))
    for number in range(4):
        step[number, 0] = right[number, 0] - A[number, 4] * slope_x - A[number, 5] * slope_y
    step[0, 1], step[1, 2] = 1.0, 1.0
    solve(four, step)
    return step
