import numpy as np
import pytest
from dockpose.lights.markers import Markers
from dockpose.lights.region import part_of, ring_in

from tests.support.scenes import CAMERA, DOCK


@pytest.mark.parametrize(
    ("region", "part"),
    [
        (None, (0, 0, 640, 480)),
        ((10, 20, 30, 40), (10, 20, 40, 60)),
        ((-10, -20, 30, 40), (0, 0, 20, 20)),
        ((600, 470, 100, 100), (600, 470, 640, 480)),
        ((9.5, 20.0, 1.0, 0.5), (10, 20, 11, 21)),  # pixel centres within
        ((11, 21, 5, 5), (10, 20, 16, 26)),  # even, so that half pixels are rounded as in the whole picture
    ],
)
def test_a_region_is_clipped_to_the_picture(region, part):
    assert part_of(region, 640, 480) == part


def flat_ring(middle_px, count=10, radius_px=40.0):
    around = 2 * np.pi * np.arange(count) / count
    return np.array(middle_px) + radius_px * np.column_stack([np.cos(around), np.sin(around)])


@pytest.mark.parametrize("others", [0, 1])
def test_another_ring_that_the_pictures_edge_cuts_is_a_rival(others):
    """Its lights at the edge count for it, and only the whole ones for the dock; without it there is none."""
    points = np.vstack([flat_ring((200, 200)), flat_ring((600, 240), 10)][: others + 1])
    cut = np.zeros(len(points), dtype=bool)
    cut[10:] = points[10:, 0] > 580
    markers = Markers(
        points, np.full(len(points), 20), np.full(len(points), 200), boxes_px=np.zeros((len(points), 4), int), cut=cut
    )
    ring = ring_in(points, markers, CAMERA, DOCK, 640.0 * 480)
    assert ring.on_ring.tolist() == [True] * 10 + [False] * (10 * others)
    assert [rival.tolist() for rival in ring.rivals] == [[False] * 10 + [True] * 10] * others
