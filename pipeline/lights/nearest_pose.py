"""The pose of a circle of lights that is nearest to a homography of them, in compiled loops for a few lights."""

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.reprojection import LightRays, solve, sum_products, turn

_ROUNDS = 4  # of a pose's perspective and the affine part for it, in turn
_STEPS, _SETTLED_PX2, _DAMPING = 10, 1e-3, 1e-6  # of Gauss and Newton's method, at the most
_LONGEST_TURN = 0.3  # radians: as far as the linearisation holds
_NEAREST = 1e-3  # radii: a light nearer than this to the camera's plane has no image


@compiled
def as_pose(points, corners, unit, mapping, focal_px):  # type: ignore[no-untyped-def]
    """Sum of squares and homography of the circle's pose nearest to a homography, which could bend any points."""
    least, best = np.inf, mapping
    for sign in (-1.0, 1.0):
        squares, trial = one_pose(points, corners, unit, mapping, focal_px, sign)
        if squares < least:
            least, best = squares, trial
    return least, best


@compiled
def one_pose(points, corners, unit, mapping, focal_px, sign):  # type: ignore[no-untyped-def]
    """Sum of squares and homography of the one or the other of these two poses."""
    squares, trial = np.inf, mapping
    for _ in range(_ROUNDS):
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
        squares, trial = fit_affine(points, corners, unit, px, py)
    refined, pose = _refined(points, corners, unit, trial, focal_px)
    # Few points can be nearer to an affine part of another pose than to any pose; that counts for nothing.
    return (refined, pose) if refined < np.inf else (squares, trial)


@compiled
def _refined(points, corners, unit, mapping, focal_px):  # type: ignore[no-untyped-def]
    """Sum of squares and homography of the pose near a homography with the least squares, by Gauss-Newton steps."""
    R, t = np.empty((3, 3)), np.empty(3)
    for row in range(2):
        for k in range(2):
            R[row, k] = mapping[row, k] / focal_px
        t[row] = mapping[row, 2] / focal_px
    R[2, 0], R[2, 1], t[2] = mapping[2, 0], mapping[2, 1], 1.0
    t /= max(np.sqrt(R[0, 0] ** 2 + R[1, 0] ** 2 + R[2, 0] ** 2), 1e-12)
    _upright(R)
    lit = np.flatnonzero(corners >= 0)
    lights = np.zeros((len(lit), 3))
    lights[:, :2] = unit[lit]
    slopes = np.zeros((1, 2, 2))
    slopes[0, 0, 0] = slopes[0, 1, 1] = focal_px
    rays = LightRays(points[corners[lit]] / focal_px, np.zeros(len(lit)), slopes)
    least, best = np.inf, mapping
    products, step = np.empty((7, 7)), np.empty((6, 1))
    for _ in range(_STEPS):
        if (R[2, 0] * lights[:, 0] + R[2, 1] * lights[:, 1] + t[2]).min() < _NEAREST:
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


@compiled
def _upright(R):  # type: ignore[no-untyped-def]
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


@compiled
def fit_affine(points, corners, unit, px, py):  # type: ignore[no-untyped-def]
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
    mapping[:2] = solve(normal, right).T
    mapping[2] = np.array([px, py, 1.0])
    squares = 0.0
    for c in range(len(corners)):
        if corners[c] >= 0:
            w = 1 + px * unit[c, 0] + py * unit[c, 1]
            for axis in range(2):
                at = (mapping[axis, 0] * unit[c, 0] + mapping[axis, 1] * unit[c, 1] + mapping[axis, 2]) / w
                squares += (points[corners[c], axis] - at) ** 2
    return squares, mapping
