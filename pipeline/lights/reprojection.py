"""One Gauss-Newton step for the pose of a dock's lights: a shift along the camera's axes, a turn about the dock's."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled


class LightRays(NamedTuple):
    """The rays of N lights, in terms of a pinhole at the camera's centre."""

    tangents: np.ndarray  # (N, 2): x / z and y / z of the rays in the water
    starts_m: np.ndarray  # (N,): z where each ray, followed backwards, meets the camera's axis; 0 without a port
    slopes_px: np.ndarray  # (N, 2, 2), or (1, 2, 2) for all: how far the picture point moves per step of the tangents


@compiled
def sum_products(
    products: np.ndarray, R: np.ndarray, t: np.ndarray, lights: np.ndarray, rays: LightRays, are_free: bool
) -> None:
    """J^T J (7, 7) of the lights' (N, 3) images in px, last column residuals; of free lights, across the circle."""
    products[:] = 0.0
    J = np.zeros((2, 7))
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


@compiled
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


@compiled
def solve(A: np.ndarray, B: np.ndarray) -> np.ndarray:
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
    return B
