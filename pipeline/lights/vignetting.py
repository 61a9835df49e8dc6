"""Take off centres of lights what a lens that darkens the corners pulls them inwards by."""

import math

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.centroids import beyond_noise

# Standard deviation of the share of light that a lens keeps from the corners. So large a light has a slope of its own,
# which is told as far as it exceeds so many variances.
_VIGNETTING, _SLOPED_PX, _SURE = 0.3, 5.0, 4.0


@compiled
def undo_slopes(
    centres: np.ndarray, covariances: np.ndarray, slopes: np.ndarray, radii: np.ndarray, off: np.ndarray
) -> None:
    """Move centres by what darkens the picture from its middle on, as far as the slopes of all lights tell.

    At a distance r from the middle the lens lets 1 - v r^2 of the light through, r = 1 in the corner. ``off`` (N, 2)
    are the distances over the square of the corner's. What is not known of v is added to the covariances. Large lights
    have slopes of their own as well. White ones, of a radius of 0, do not show theirs.
    """
    information, seen = 1 / _VIGNETTING**2, 0.0
    for light in range(len(centres)):
        if radii[light] > 0:
            x, y = -2 * off[light, 0], -2 * off[light, 1]
            a, b, c = slopes[light, 0, 1], slopes[light, 0, 2], slopes[light, 1, 2]
            over = 1 / max(a * c - b * b, 1e-300)
            information += (x * x * c - 2 * x * y * b + y * y * a) * over
            seen += ((x * c - y * b) * slopes[light, 0, 0] + (y * a - x * b) * slopes[light, 1, 0]) * over
    vignetting, by_lens = max(0.0, seen / information), np.empty(2)
    for light in range(len(centres)):
        if math.isfinite(slopes[light, 0, 0]):
            by_lens[0] = by_lens[1] = 0.0
            for axis in range(2):
                of_lens = -2 * off[light, axis]
                slope = vignetting * of_lens
                if radii[light] > _SLOPED_PX:
                    slope += beyond_noise(slopes[light, axis, 0] - slope, _SURE * slopes[light, axis, 1 + axis])
                for row in range(2):
                    by_lens[row] += slopes[light, row, 3 + axis] * of_lens
                    centres[light, row] += slopes[light, row, 3 + axis] * slope
            for row in range(2):
                for column in range(2):
                    covariances[light, row, column] += by_lens[row] * by_lens[column] / information
