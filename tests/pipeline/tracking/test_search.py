# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.simulate import Approach, FilmPlan, film
from dockpose.tracking.search import BLOCK, Search

from tests.support.scenes import CAMERA, DOCK, random_scene

FRAMES = 2 * BLOCK + 5


@pytest.fixture(scope="module")
def course():
    scene = random_scene(3, position_m=(0.05, 0.0, 3.6))
    motion = Approach(frames=FRAMES, start_m=4.4, end_m=3.6, drift_m=0.02)
    return list(film(FilmPlan(scene=scene, motion=motion)))


def searched(course, start=0, stop=FRAMES, whole_first=0, search=None):
    search = search or Search(CAMERA, DOCK, Settings(), whole_first=whole_first)
    return [search.see(frame.image, frame.number - 1, frame.time_s, Settings()) for frame in course[start:stop]]


def plain(found):
    return found.to_dict() | {"elapsed_ms": 0}


@pytest.mark.slow
def test_a_region_finds_what_the_whole_picture_shows(course):
    found = searched(course)
    assert [index for index, each in enumerate(found) if each.region is None] == [0, BLOCK, 2 * BLOCK]
    for frame, each in zip(course, found, strict=True):
        whole = estimate(frame.image, CAMERA, DOCK)
        np.testing.assert_allclose(each.selected.position_m, whole.selected.position_m, atol=1e-3)
        assert each.lights_on_ring == whole.lights_on_ring


def test_blocks_are_searched_alike_in_any_order(course):
    one_by_one = [plain(found) for found in searched(course)]
    second = [plain(found) for found in searched(course, BLOCK)]
    assert [plain(found) for found in searched(course, 0, BLOCK)] + second == one_by_one


def test_within_a_block_it_goes_on_from_the_frame_before(course):
    found = searched(course, 0, 12)
    search = Search(CAMERA, DOCK, Settings())
    search.remember(found[6], 6, course[6].time_s)
    assert [plain(each) for each in searched(course, 7, 12, search=search)] == [plain(each) for each in found[7:]]


def test_the_first_frames_are_searched_as_a_whole_where_that_is_asked(course):
    found = searched(course, 0, 8, whole_first=5)
    assert [each.region is None for each in found] == [True] * 5 + [False] * 3


def test_the_whole_picture_is_searched_where_a_region_shows_no_dock(course):
    search = Search(CAMERA, DOCK, Settings())
    searched(course, 0, 3, search=search)
    dark = search.see(np.full((480, 640), 20, np.uint8), 3, course[3].time_s, Settings())
    assert (dark.status, dark.region) == ("no_lights", None)
    assert search.see(course[4].image, 4, course[4].time_s, Settings()).region is None
