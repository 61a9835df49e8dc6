"""How many rings chance alone would make: the measure by which a ring is accepted (a contrario).

Desolneux, Moisan and Morel 2000, "Meaningful alignments": what is seen is accepted where points strewn at random would
show it less than once in so many pictures. No constant depends on the number of lights, the picture's size or the focal
length; the one threshold is that number.
"""

from __future__ import annotations

import math

import numpy as np

# Expected number of chance rings below which a ring is one: where it is all that there is, and where it is picked out
# from among others, at two thresholds and from the brightest points first.
ACCEPTED, ACCEPTED_AMONG_OTHERS = 1e-2, 1e-3
_SIZES = 6.0  # octaves of radius that are searched
_BRIGHTNESSES = 8.0  # octaves of brightness down to the dimmest light, each another set of points
_LEAST_PX = 0.05  # no centre is known better, root mean square per coordinate
NUMBERS = range(4, 25)  # of lights that are tried where it is not known


def density_per_px2(
    points_px: np.ndarray,
    brightness: np.ndarray,
    members: np.ndarray,
    centre_px: tuple[float, float],
    radius_px: float,
    area_px2: float,
) -> float:
    """Density of points to reckon with around a ring: of those that are as bright as the dimmest on it.

    Parameters
    ----------
    points_px : (M, 2) float array
        All points of the picture.
    brightness : (M,) float array
        Of each.
    members : int array
        Numbers of those on the ring.
    centre_px, radius_px : tuple of float, float
        The ring's image: middle and major semi-axis.
    area_px2 : float
        Of the picture.

    Returns
    -------
    float
        Points per square pixel: one more than are off the ring within twice its radius, over that area. Elsewhere the
        picture may be crowded, as where it shows text, or empty: what counts is how likely points are just here.
    """
    as_bright = brightness >= brightness[members].min()
    every = np.ones(len(points_px), dtype=bool)
    # Leaving the dimmer ones out is another test for each octave of brightness.
    octaves = _BRIGHTNESSES ** (1 / len(members))
    return min(
        _density(points_px, every, members, centre_px, radius_px, area_px2),
        octaves * _density(points_px, as_bright, members, centre_px, radius_px, area_px2),
    )


def _density(
    points_px: np.ndarray,
    counted: np.ndarray,
    members: np.ndarray,
    centre_px: tuple[float, float],
    radius_px: float,
    area_px2: float,
) -> float:
    """Density of those points that are counted, (M,) bool, see :func:`density_per_px2`."""
    apart = counted.copy()
    apart[members] = False
    off = points_px[apart] - centre_px
    reach = 2 * radius_px
    beside = np.count_nonzero((off * off).sum(axis=1) < reach**2)
    return (1 + beside) / min(math.pi * reach**2, area_px2)


def log_chance_rings(
    count: int,
    sides: int,
    *,
    even: bool,
    squares_px2: float,
    radius_px: float,
    density: float,
    area_px2: float,
) -> float:
    """Natural logarithm of the expected number of rings as good among points strewn at random.

    Parameters
    ----------
    count : int
        Points on the ring, at least four.
    sides : int
        Lights of the dock.
    even : bool
        Whether they are evenly spaced.
    squares_px2 : float
        Sum of the squared distances between the points and where the ring has its lights, in pixels squared.
    radius_px : float
        Major semi-axis of the ring's image.
    density : float
        Points per square pixel, see :func:`density_per_px2`.
    area_px2 : float
        Of the picture.

    Notes
    -----
    The images of a ring's n lights form a surface in the 2n-dimensional space of n points; random points come within a
    distance rho of it, the root of the sum of squares, in a tube around it. The expected number of chance rings is the
    density to the power of n times the tube's volume (first order: that of the surface times that of a ball of radius
    rho in the remaining dimensions), times the number of ways to take n of the N lights. The surface: affine maps A of
    the unit circle, sum over n lights of |A u|^2 giving a volume element of n^3 / 4, over all places in the picture and
    all A up to this size (pi^2 R^4 / 3). Two poses give nearly one affine map. Sizes by octave and the number of lights
    that are missing are as many tests.
    """
    ways = math.lgamma(sides + 1) - math.lgamma(count + 1) - math.lgamma(sides - count + 1)
    if even:
        ways -= math.log(sides)
    squares_px2 = max(squares_px2, (2 * count - 6) * _LEAST_PX**2)
    surface = math.log(area_px2) + math.log(math.pi**2 * radius_px**4 / 3) + math.log(count**3 / 4)
    tube = _log_ball(2 * count - 6, squares_px2) + math.log(2)
    tests = math.log(_SIZES * max(1, sides - 3))
    return count * math.log(density) + surface + tube + ways + tests


def log_chance_ellipses(count: int, rms_px: float, radius_px: float, density: float, total: int) -> float:
    """Natural logarithm of the expected number of ellipses that run as close to as many points strewn at random.

    Parameters
    ----------
    count : int
        Points on the ellipse, at least six: any five lie on a conic.
    rms_px : float
        Root mean square distance of the points from the ellipse.
    radius_px : float
        Major semi-axis.
    density : float
        Points per square pixel.
    total : int
        Points in all.
    """
    width_px = 2 * 2.0 * max(rms_px, _LEAST_PX) * math.sqrt(count / (count - 5))
    beside = min(1.0, density * 2 * math.pi * radius_px * width_px)
    choose_five = math.log(math.comb(total, 5))
    others = math.log(math.comb(max(total - 5, count - 5), count - 5))
    return choose_five + others + (count - 5) * math.log(beside) + math.log(_SIZES)


def _log_ball(dimensions: int, squares: float) -> float:
    """Logarithm of the volume of a ball whose squared radius is ``squares``."""
    half = dimensions / 2
    return half * math.log(math.pi) - math.lgamma(half + 1) + half * math.log(squares) if dimensions else 0.0
