"""One Gauss-Newton step for the pose of a dock's lights: a shift along the camera's axes, a turn about the dock's."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_bare

_ROUNDS = 4  # of a pose's perspective and the affine part for it, in turn
_STEPS, _SETTLED_PX2, _DAMPING = 10, 1e-3, 1e-6  # of Gauss and Newton's method, at the most
_LONGEST_TURN = 0.3  # radians: as far as the linearisation holds
_NEAREST = 1e-3  # radii: a light nearer than this to the camera's plane has no image


class LightRays(NamedTuple):
    """The rays of N lights, in terms of a pinhole at the camera's centre."""

    tangents: np.ndarray  # (N, 2): x / z and y / z of the rays in the water
    starts_m: np.ndarray  # (N,): z where each ray, followed backwards, meets the camera's axis; 0 without a port
    slopes_px: np.ndarray  # (N, 2, 2), or (1, 2, 2) for all: how far the picture point moves per step of the tangents


class RingTemplate(NamedTuple):
    """A polygon of N lights that is sought among M points."""

    points: np.ndarray  # (M, 2): in pixels, from the principal point
    unit: np.ndarray  # (N, 2): its corners on the unit circle
    focal_px: float
    tolerance_px: float  # by which a light may be off its corner


@compiled_bare
def sum_products(
    products: np.ndarray, R: np.ndarray, t: np.ndarray, lights: np.ndarray, rays: LightRays, are_free: bool
) -> None:
    """J^T J of the lights' (N, 3) images in px, last column residuals; of free lights, across the circle.

    It is the first seven rows of ``products`` (9, 7); the others are the last light's J.
    """
    for row in range(7):
        for column in range(7):
            products[row, column] = 0.0
    J = products[7:]
    for light in range(len(lights)):
        x, y, z = lights[light, 0], lights[light, 1], lights[light, 2]
        X = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
        Y = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
        Z = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
        u, v = rays.tangents[light, 0], rays.tangents[light, 1]
        shift = rays.starts_m[light] / Z
        slope = rays.slopes_px[min(light, len(rays.slopes_px) - 1)]
        for row in range(2):
            a, b = slope[row, 0] / Z, slope[row, 1] / Z
            c = -a * (X / Z + u * shift) - b * (Y / Z + v * shift)
            J[row, 0], J[row, 1], J[row, 2] = a, b, c
            along_x = a * R[0, 0] + b * R[1, 0] + c * R[2, 0]
            along_y = a * R[0, 1] + b * R[1, 1] + c * R[2, 1]
            along_z = a * R[0, 2] + b * R[1, 2] + c * R[2, 2]
            J[row, 3], J[row, 4] = y * along_z - z * along_y, z * along_x - x * along_z
            J[row, 5] = x * along_y - y * along_x
            J[row, 6] = slope[row, 0] * (u * (1 - shift) - X / Z) + slope[row, 1] * (v * (1 - shift) - Y / Z)
        rows = 2
        if are_free:
            # A rotation about the dock's own axis moves a light along the circle.
            across_u, across_v = J[1, 5], J[0, 5]
            along = np.hypot(across_u, across_v)
            for column in range(7):
                J[0, column] = (J[1, column] * across_v - J[0, column] * across_u) / along
            J[0, 5] = 0.0
            rows = 1
        for row in range(rows):
            for one in range(7):
                for other in range(one, 7):
                    products[one, other] += J[row, one] * J[row, other]
    for one in range(7):
        for other in range(one):
            products[one, other] = products[other, one]


@compiled_bare
def turn(R: np.ndarray, x: float, y: float, z: float) -> None:
    """Rotate in place by a small vector in radians, about the dock's axes: the Cayley transform, of third order."""
    x, y, z = x / 2, y / 2, z / 2
    by = 2 / (1 + x * x + y * y + z * z)
    for row in range(3):
        a, b, c = R[row, 0], R[row, 1], R[row, 2]
        # a row times the cross-product matrix, twice
        p, q, r = b * z - c * y, c * x - a * z, a * y - b * x
        R[row, 0] = a + by * (p + q * z - r * y)
        R[row, 1] = b + by * (q + r * x - p * z)
        R[row, 2] = c + by * (r + p * y - q * x)


@compiled_bare
def solve(A: np.ndarray, B: np.ndarray) -> None:
    """Solve A X = B (n, m) for a symmetric positive definite A, in place (Cholesky); compiles sooner than LAPACK's."""
    size = len(B)
    for k in range(size):
        for i in range(k):
            A[k, k] -= A[k, i] * A[k, i]
        A[k, k] = np.sqrt(max(A[k, k], 1e-300))
        for row in range(k + 1, size):
            for i in range(k):
                A[row, k] -= A[row, i] * A[k, i]
            A[row, k] /= A[k, k]
    for column in range(B.shape[1]):
        for k in range(size):
            for i in range(k):
                B[k, column] -= A[k, i] * B[i, column]
            B[k, column] /= A[k, k]
        for k in range(size - 1, -1, -1):
            for i in range(k + 1, size):
                B[k, column] -= A[i, k] * B[i, column]
            B[k, column] /= A[k, k]


@compiled
def as_pose(template: RingTemplate, corners: np.ndarray, mapping: np.ndarray) -> tuple[float, np.ndarray]:
    """Sum of squares and homography of the circle's pose nearest to a homography, which could bend any points."""
    least, best = np.inf, mapping
    for sign in (-1.0, 1.0):
        squares, trial = one_pose(template, corners, mapping, sign)
        if squares < least:
            least, best = squares, trial
    return least, best


@compiled
def one_pose(template: RingTemplate, corners: np.ndarray, mapping: np.ndarray, sign: float) -> tuple[float, np.ndarray]:
    """Sum of squares and homography of the one or the other of these two poses."""
    trial = mapping.copy()
    squares = near_pose(template, corners, sign, trial)
    refined, pose = _refined(template, corners, trial)
    # Few points can be nearer to an affine part of another pose than to any pose; that counts for nothing.
    return (refined, pose) if refined < np.inf else (squares, trial)


@compiled_bare
def near_pose(template: RingTemplate, corners: np.ndarray, sign: float, mapping: np.ndarray) -> float:
    """Turn a homography to one near one of these poses, by perspective and affine part in turn; its sum of squares."""
    squares, focal_px = np.inf, template.focal_px
    for _ in range(_ROUNDS):
        cx, cy = mapping[0, 2] / focal_px, mapping[1, 2] / focal_px
        a = (mapping[0, 0] - mapping[0, 2] * mapping[2, 0]) / focal_px
        b = (mapping[0, 1] - mapping[0, 2] * mapping[2, 1]) / focal_px
        c = (mapping[1, 0] - mapping[1, 2] * mapping[2, 0]) / focal_px
        d = (mapping[1, 1] - mapping[1, 2] * mapping[2, 1]) / focal_px
        k = 1 + cx * cx + cy * cy
        gx, gy = a * cx + c * cy, b * cx + d * cy
        hxx, hxy, hyy = a * a + c * c - gx * gx / k, a * b + c * d - gx * gy / k, b * b + d * d - gy * gy / k
        turn = np.arctan2(2 * hxy, hxx - hyy) / 2
        long = np.sqrt(np.sqrt((hxx - hyy) ** 2 + 4 * hxy**2) / k)
        px, py = -sign * long * np.sin(turn) - gx / k, sign * long * np.cos(turn) - gy / k
        squares = fit_affine(template, corners, px, py, mapping)
    return squares


@compiled
def _refined(template: RingTemplate, corners: np.ndarray, mapping: np.ndarray) -> tuple[float, np.ndarray]:
    """Sum of squares and homography of the pose near a homography with the least squares, by Gauss-Newton steps."""
    R, t, focal_px = np.empty((3, 3)), np.empty(3), template.focal_px
    for row in range(2):
        for k in range(2):
            R[row, k] = mapping[row, k] / focal_px
        t[row] = mapping[row, 2] / focal_px
    R[2, 0], R[2, 1], t[2] = mapping[2, 0], mapping[2, 1], 1.0
    t /= max(np.sqrt(R[0, 0] ** 2 + R[1, 0] ** 2 + R[2, 0] ** 2), 1e-12)
    _upright(R)
    lit = np.flatnonzero(corners >= 0)
    lights = np.zeros((len(lit), 3))
    lights[:, :2] = template.unit[lit]
    slopes = np.zeros((1, 2, 2))
    slopes[0, 0, 0] = slopes[0, 1, 1] = focal_px
    rays = LightRays(template.points[corners[lit]] / focal_px, np.zeros(len(lit)), slopes)
    least, best = np.inf, mapping
    products, step = np.empty((9, 7)), np.empty((6, 1))
    for _ in range(_STEPS):
        nearest = np.inf
        for light in range(len(lights)):
            nearest = min(nearest, R[2, 0] * lights[light, 0] + R[2, 1] * lights[light, 1] + t[2])
        if nearest < _NEAREST:
            break
        sum_products(products, R, t, lights, rays, False)
        squares = products[6, 6]
        if squares < least:
            settled = squares > least - _SETTLED_PX2
            least = squares
            best = np.empty((3, 3))
            for row in range(3):
                scale = focal_px if row < 2 else 1.0
                best[row, 0], best[row, 1], best[row, 2] = R[row, 0] * scale, R[row, 1] * scale, t[row] * scale
            best /= t[2]
            if settled:
                break
        for i in range(6):
            products[i, i] *= 1 + _DAMPING
            step[i, 0] = products[i, 6]
        solve(products, step)
        turned = np.sqrt(step[3, 0] ** 2 + step[4, 0] ** 2 + step[5, 0] ** 2)
        step *= min(1.0, _LONGEST_TURN / max(turned, 1e-12))
        t += step[:3, 0]
        turn(R, step[3, 0], step[4, 0], step[5, 0])
    return least, best


@compiled_bare
def _upright(R: np.ndarray) -> None:
    """Make the first two columns of a matrix perpendicular unit vectors, alike turned, and add the third; in place."""
    for _ in range(2):
        for k in range(2):
            long = max(np.sqrt(R[0, k] ** 2 + R[1, k] ** 2 + R[2, k] ** 2), 1e-12)
            for row in range(3):
                R[row, k] /= long
        lean = (R[0, 0] * R[0, 1] + R[1, 0] * R[1, 1] + R[2, 0] * R[2, 1]) / 2
        for row in range(3):
            x = R[row, 0]
            R[row, 0] -= lean * R[row, 1]
            R[row, 1] -= lean * x
    for row in range(3):
        one, two = (row + 1) % 3, (row + 2) % 3
        R[row, 2] = R[one, 0] * R[two, 1] - R[two, 0] * R[one, 1]


@compiled_bare
def fit_affine(template: RingTemplate, corners: np.ndarray, px: float, py: float, mapping: np.ndarray) -> float:
    """Fill in the homography (3, 3) of the best affine part for a given perspective; its sum of squares."""
    points, unit = template.points, template.unit
    uu, uv, u1, vv, v1, ones = 1e-12, 0.0, 0.0, 1e-12, 0.0, 1e-12
    ux, vx, x1, uy, vy, y1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(len(corners)):
        if corners[c] >= 0:
            one = 1 / (1 + px * unit[c, 0] + py * unit[c, 1])
            u, v = one * unit[c, 0], one * unit[c, 1]
            x, y = points[corners[c], 0], points[corners[c], 1]
            uu, uv, u1, vv, v1, ones = uu + u * u, uv + u * v, u1 + u * one, vv + v * v, v1 + v * one, ones + one * one
            ux, vx, x1, uy, vy, y1 = ux + u * x, vx + v * x, x1 + one * x, uy + u * y, vy + v * y, y1 + one * y
    uu, uv, u1, vv, v1, ones = inverse_of(uu, uv, u1, vv, v1, ones)
    mapping[0, 0], mapping[0, 1], mapping[0, 2] = times(uu, uv, u1, vv, v1, ones, ux, vx, x1)
    mapping[1, 0], mapping[1, 1], mapping[1, 2] = times(uu, uv, u1, vv, v1, ones, uy, vy, y1)
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = px, py, 1.0
    squares = 0.0
    for c in range(len(corners)):
        if corners[c] >= 0:
            w = 1 + px * unit[c, 0] + py * unit[c, 1]
            for axis in range(2):
                at = (mapping[axis, 0] * unit[c, 0] + mapping[axis, 1] * unit[c, 1] + mapping[axis, 2]) / w
                squares += (points[corners[c], axis] - at) ** 2
    return squares


@compiled_bare
def inverse_of(
    xx: float, xy: float, xz: float, yy: float, yz: float, zz: float
) -> tuple[float, float, float, float, float, float]:
    """Inverse of a symmetric matrix (3, 3), by the upper halves of both."""
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    by = 1 / max(xx * a + xy * b + xz * c, 1e-300)
    return by * a, by * b, by * c, by * (xx * zz - xz * xz), by * (xy * xz - xx * yz), by * (xx * yy - xy * xy)


@compiled_bare
def times(
    xx: float, xy: float, xz: float, yy: float, yz: float, zz: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """A symmetric matrix (3, 3), by its upper half, times a vector."""
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@compiled_bare
def farthest_off(template: RingTemplate, corners: np.ndarray, mapping: np.ndarray) -> int:
    """The corner whose point is farthest off it."""
    points, unit, worst, whose = template.points, template.unit, -1.0, -1
    for c in range(len(corners)):
        if corners[c] >= 0:
            w = mapping[2, 0] * unit[c, 0] + mapping[2, 1] * unit[c, 1] + mapping[2, 2]
            x = (mapping[0, 0] * unit[c, 0] + mapping[0, 1] * unit[c, 1] + mapping[0, 2]) / w
            y = (mapping[1, 0] * unit[c, 0] + mapping[1, 1] * unit[c, 1] + mapping[1, 2]) / w
            square = (points[corners[c], 0] - x) ** 2 + (points[corners[c], 1] - y) ** 2
            if square > worst:
                worst, whose = square, c
    return whose


@compiled_bare
def stretch(mapping: np.ndarray) -> tuple[float, float]:
    """Singular values, larger first, of how the mapping stretches around the circle's middle."""
    a = mapping[0, 0] - mapping[0, 2] * mapping[2, 0]
    b = mapping[0, 1] - mapping[0, 2] * mapping[2, 1]
    c = mapping[1, 0] - mapping[1, 2] * mapping[2, 0]
    d = mapping[1, 1] - mapping[1, 2] * mapping[2, 1]
    mean, apart = (a * a + b * b + c * c + d * d) / 2, abs(a * d - b * c)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    return major, apart / max(major, 1e-9)


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


@compiled
def turned(mapping: np.ndarray, roll: float) -> np.ndarray:
    """A map (3, 3) of a plane that is turned by an angle before."""
    cos, sin, result = np.cos(roll), np.sin(roll), mapping.copy()
    for row in range(3):
        result[row, 0] = cos * mapping[row, 0] + sin * mapping[row, 1]
        result[row, 1] = cos * mapping[row, 1] - sin * mapping[row, 0]
    return result
