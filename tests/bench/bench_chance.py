"""Rings that chance makes: random points, uniform and in clusters, for each number of lights."""

from multiprocessing import Pool

import numpy as np
from dockpose import Dock
from dockpose.lights.markers import Markers
from dockpose.lights.ring import find_ring

from tests.support.scenes import CAMERA

PICTURES = 100  # a cell
POINTS = (20, 40, 80, 150)
AT_MOST = 0.01  # of the pictures of a cell; a single one is no evidence of more
AREA_PX2 = 640.0 * 480.0


def draw(seed: tuple[int, int, int, int], count: int, clustered: bool) -> np.ndarray:
    """Points (M, 2) all over the picture, or around five places with a standard deviation of 50 px."""
    rng = np.random.default_rng(seed)
    if not clustered:
        return rng.uniform(0, [640, 480], (count, 2))
    places = rng.uniform(0, [640, 480], (5, 2))
    return np.clip(places[rng.integers(0, 5, count)] + rng.normal(0, 50, (count, 2)), 0, [639, 479])


def is_found(job: tuple[int, int, bool, int]) -> bool:
    lights, count, clustered, picture = job
    points = draw((lights, count, int(clustered), picture), count, clustered)
    markers = Markers(points, np.full(count, 20), np.full(count, 200))
    return find_ring(points, markers, CAMERA, Dock(0.30, lights), AREA_PX2).found


def test_random_points_are_no_ring():
    print(f"\nrings found among random points, in % of {PICTURES} pictures (asked: at most 1 a cell)")
    print(f"{'lights':8}" + "".join(f"{kind} {count:<7}" for kind in ("uniform", "clusters") for count in POINTS))
    found: list[int] = []
    with Pool(2) as pool:
        for lights in range(4, 17):
            row = [
                sum(pool.map(is_found, [(lights, count, clustered, k) for k in range(PICTURES)], chunksize=10))
                for clustered in (False, True)
                for count in POINTS
            ]
            found += row
            print(f"{lights:<8}" + "".join(f"{100 * one / PICTURES:<15.0f}" for one in row), flush=True)
    assert max(found) <= AT_MOST * PICTURES + 1
    assert sum(found) <= AT_MOST * PICTURES * len(found)
