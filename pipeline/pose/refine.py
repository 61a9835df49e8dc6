"""Refinement: the pose with the least reprojection error, and its covariance."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.reprojection import LightRays, solve, sum_products, turn

MAX_STEPS = 15  # at the most
# Stop after a step that lowers the sum of squares by less than this share or this much; what remains is far less.
_SETTLED, _SETTLED_PX2 = 1e-3, 1e-6
# A pose whose sum of squares exceeds this multiple of the best one's plus this much is certainly wrong.
HOPELESS, HOPELESS_PX2 = 30.0, 2.0
_LONGEST = 0.3  # radians, or a share of the range, in one step
# What all lights have at the least; halvings; weights that differ by less are alike.
_SAME_PX, _HALVED, _ALIKE = 0.01, 20, 1.5
_DAMPING = 1e-9  # share of the diagonal: what lights leave open gets a variance as good as infinite


@dataclass(frozen=True)
class Fit:
    """K refined poses."""

    rotations: np.ndarray  # (K, 3, 3): from the dock's frame to the camera's, roll included
    positions_m: np.ndarray  # (K, 3): the dock's centres
    squares_px2: np.ndarray  # (K,): sums of the squared reprojection errors
    # (K, 6, 6): (J^T J)^-1 for a step of the position (metres) and a rotation about the dock's axes (radians), for
    # lights known to one pixel
    covariances: np.ndarray
    numbers: int  # number of residuals
    points: int  # number of lights

    def taken(self, rows: np.ndarray) -> "Fit":
        """Those of the poses that have these numbers."""
        kept = (each[rows] for each in (self.rotations, self.positions_m, self.squares_px2, self.covariances))
        return Fit(*kept, numbers=self.numbers, points=self.points)


def light_rays(points_px: Any, camera: Camera, depth_m: float = 1.0) -> LightRays:
    """Trace picture points (N, 2) into the water; ``depth_m`` is roughly the depth of their lights."""
    points = as_points("points_px", points_px, 2)
    focal, centre = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    starts = np.zeros(len(points))
    if camera.port is not None:
        rays, starts = camera.rays(points), np.ascontiguousarray(camera.ray_starts(points)[:, 2])
        tangents = rays[:, :2] / rays[:, 2:]
    elif camera.fisheye or any(camera.distortion):
        tangents = (camera.undistort(points) - centre) / focal
    else:
        return LightRays((points - centre) / focal, starts, np.diag(focal)[None])
    return LightRays(tangents, starts, np.ascontiguousarray(camera.picture_slopes(points, depth_m) * focal))


def on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Where the rays meet the planes of K docks: (K, N, 2) in metres, along each dock's own x and y."""
    normals = rotations[:, :, 2]
    directions = np.ones((len(rays.tangents), 3))
    directions[:, :2] = rays.tangents
    ahead = (normals * positions_m).sum(axis=1)[:, None] - normals[:, 2:] * rays.starts_m
    reached = (ahead / (normals @ directions.T))[..., None] * directions
    reached[..., 2] += rays.starts_m
    return (reached - positions_m[:, None]) @ rotations[:, :, :2]


def angles_on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Angles (K, N) in radians of the lights around each of K docks, from its x axis towards its y axis."""
    flat = on_planes(rays, rotations, positions_m)
    return np.arctan2(flat[..., 1], flat[..., 0])


def _on_circle(angles_rad: np.ndarray, radius_m: float, offsets_m: np.ndarray | None) -> np.ndarray:
    """Places (..., N, 3) of lights at angles (..., N) on a dock's circle, each off by its offset."""
    places = np.zeros((*angles_rad.shape, 3))
    places[..., 0], places[..., 1] = radius_m * np.cos(angles_rad), radius_m * np.sin(angles_rad)
    return places if offsets_m is None else places + offsets_m


def refine(
    rotations: np.ndarray,
    positions_m: np.ndarray,
    angles_rad: np.ndarray | None,
    radius_m: float,
    rays: LightRays,
    offsets_m: np.ndarray | None = None,
) -> Fit:
    """Least reprojection error for K poses, of lights at angles (K, N), else free on the circle, and offsets."""
    points = len(rays.tangents)
    if angles_rad is None:
        lights, free_m, numbers = np.zeros((len(rotations), points, 3)), radius_m, points
    else:
        lights, free_m, numbers = _on_circle(angles_rad, radius_m, offsets_m), 0.0, 2 * points
    turns, places_m, squares = rotations.copy(), positions_m.copy(), np.empty(len(rotations))
    covariances = np.empty((len(rotations), 6, 6))
    _minimise(turns, places_m, squares, covariances, lights, float(free_m), rays)
    return Fit(turns, places_m, squares, covariances, numbers, points)


def squares_at(
    R: np.ndarray, t: np.ndarray, angles_rad: np.ndarray, radius_m: float, rays: LightRays, offsets_m: np.ndarray | None
) -> float:
    """Sum of the squared reprojection errors, in pixels squared, of lights at angles (N,) on one dock at R and t."""
    products = np.empty((9, 7))
    sum_products(products, R, t, _on_circle(angles_rad, radius_m, offsets_m), rays, False)
    return float(products[6, 6])


def weigh(
    rays: LightRays,
    covariances_px2: np.ndarray,
    fit: Fit,
    best: int,
    angles_rad: np.ndarray,
    radius_m: float,
    offsets_m: np.ndarray | None = None,
) -> tuple[LightRays, float]:
    """Rays that weigh each light by its covariance (N, 2, 2), the same where that is nothing new; the picture's noise.

    What a fit's residuals have beyond these covariances, as of lights that are out of place, is added to all alike
    (Paule and Mandel 1982). The noise is that of a centre, root mean square, as far as the picture tells.
    """
    offsets = None if offsets_m is None else offsets_m[best]
    lights = _on_circle(angles_rad, radius_m, offsets)
    R, t = fit.rotations[best], fit.positions_m[best]
    roots = covariances_px2.copy()
    least_px, ratio = _turn_to_roots(roots, R, t, lights, rays, max(1, fit.numbers - 6))
    return (rays._replace(slopes_px=roots @ rays.slopes_px) if ratio > _ALIKE else rays), least_px


@compiled
def _turn_to_roots(
    covariances: np.ndarray, R: np.ndarray, t: np.ndarray, lights: np.ndarray, rays: LightRays, freedom: int
) -> tuple[float, float]:
    """Turn covariances (N, 2, 2) to roots of weights of 1 on average; picture's noise, largest weight over least."""
    count = len(lights)
    squares, known = np.empty((count, 3)), np.empty((count, 3))
    for light in range(count):
        known[light, 0], known[light, 1] = covariances[light, 0, 0], covariances[light, 0, 1]
        known[light, 2] = covariances[light, 1, 1]
        x, y, z = lights[light, 0], lights[light, 1], lights[light, 2]
        X = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
        Y = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
        Z = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
        shift = rays.starts_m[light] / Z
        across = rays.tangents[light, 0] * (1 - shift) - X / Z
        down = rays.tangents[light, 1] * (1 - shift) - Y / Z
        slope = rays.slopes_px[min(light, len(rays.slopes_px) - 1)]
        u, v = slope[0, 0] * across + slope[0, 1] * down, slope[1, 0] * across + slope[1, 1] * down
        squares[light, 0], squares[light, 1], squares[light, 2] = u * u, u * v, v * v
    low, high = _SAME_PX**2, _SAME_PX**2
    while _explained(squares, known, high) > freedom:
        low, high = high, 2 * high
    for _ in range(_HALVED):
        middle = (low + high) / 2
        if _explained(squares, known, middle) > freedom:
            low = middle
        else:
            high = middle
    mean, own, least, most = 0.0, 0.0, np.inf, 0.0
    for light in range(count):
        a, b, c = known[light, 0], known[light, 1], known[light, 2]
        own += (a + c) / (2 * count * (a * c - b * b))
        a, c = a + high, c + high
        weight = (a + c) / (2 * (a * c - b * b))
        mean += weight / count
        least, most = min(least, weight), max(most, weight)
    for light in range(count):
        a, b, c = known[light, 0] + high, known[light, 1], known[light, 2] + high
        # Upper triangle whose product with its transpose, before it, is the inverse.
        over = 1 / (mean * (a * c - b * b))
        root = np.sqrt(c * over)
        covariances[light, 0, 0], covariances[light, 0, 1] = root, -b * over / root
        covariances[light, 1, 0], covariances[light, 1, 1] = 0.0, np.sqrt(1 / (mean * c))
    return np.sqrt(1 / own), most / least


@compiled
def _explained(squares: np.ndarray, known: np.ndarray, more: float) -> float:
    """Sum of squares of residuals, each over a light's variance and so much more."""
    total = 0.0
    for light in range(len(squares)):
        a, b, c = known[light, 0] + more, known[light, 1], known[light, 2] + more
        total += (squares[light, 0] * c - 2 * squares[light, 1] * b + squares[light, 2] * a) / (a * c - b * b)
    return total


@compiled
def _minimise(
    R: np.ndarray,
    t: np.ndarray,
    squares: np.ndarray,
    covariances: np.ndarray,
    lights: np.ndarray,
    free: float,
    rays: LightRays,
) -> None:
    """Move K poses and free lights, in place, and fill in squares and covariances; ``free``: radius, 0 for fixed."""
    count = len(R)
    gains, steps = np.empty(count), np.empty((count, 6))
    products, gradient = np.empty((9, 7)), np.empty(6)
    for _ in range(MAX_STEPS):
        longest = 0.0
        for k in range(count):
            if free > 0:
                _move_along(lights[k], free, R[k], t[k], rays)
            sum_products(products, R[k], t[k], lights[k], rays, free > 0)
            for number in range(6):
                for other in range(6):
                    covariances[k, number, other] = 0.0
                products[number, number] *= 1 + _DAMPING
                gradient[number], covariances[k, number, number] = products[number, 6], 1.0
            if free > 0:
                products[5, 5] = 1.0
            solve(products, covariances[k])
            gains[k] = 0.0
            for one in range(6):
                step = 0.0
                for other in range(6):
                    step += covariances[k, one, other] * gradient[other]
                steps[k, one] = step
                gains[k] += step * gradient[one]
                longest = max(longest, abs(step) / t[k, 2] if one < 3 else abs(step))
            squares[k] = products[6, 6] - gains[k]
        # No step exceeds what the linearisation can be trusted for.
        share = min(1.0, _LONGEST / longest) if longest > 0 else 1.0
        for k in range(count):
            for axis in range(3):
                t[k, axis] += share * steps[k, axis]
            turn(R[k], share * steps[k, 3], share * steps[k, 4], share * steps[k, 5])
        # A pose has converged, or is so much worse than the best one that it need not.
        least = squares[0]
        for k in range(1, count):
            least = min(least, squares[k])
        hopeless = HOPELESS * least + HOPELESS_PX2
        settled = True
        for k in range(count):
            enough = _SETTLED * abs(squares[k]) + _SETTLED_PX2
            settled = settled and (gains[k] <= enough or squares[k] > hopeless)
        if settled:
            break
    for k in range(count):
        squares[k] = max(squares[k], 0.0)


@compiled_bare
def _move_along(lights: np.ndarray, radius: float, R: np.ndarray, t: np.ndarray, rays: LightRays) -> None:
    """Put the lights (N, 3), in place, where on the circle their rays meet the dock's plane."""
    for light in range(len(lights)):
        u, v = rays.tangents[light, 0], rays.tangents[light, 1]
        ahead = R[0, 2] * t[0] + R[1, 2] * t[1] + R[2, 2] * (t[2] - rays.starts_m[light])
        depth = ahead / (R[0, 2] * u + R[1, 2] * v + R[2, 2])
        x, y, z = depth * u - t[0], depth * v - t[1], depth + rays.starts_m[light] - t[2]
        along_x = x * R[0, 0] + y * R[1, 0] + z * R[2, 0]
        along_y = x * R[0, 1] + y * R[1, 1] + z * R[2, 1]
        angle = np.arctan2(along_y, along_x)
        lights[light, 0], lights[light, 1] = radius * np.cos(angle), radius * np.sin(angle)
