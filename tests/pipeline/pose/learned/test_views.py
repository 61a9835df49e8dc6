import math

import cv2
import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.learned.views import aligned, is_same, place_view

from tests.support.docks import CAMERA, dock_views, nominal

TRUE = Dock(0.30, 5, offsets_m=((0, 0, 0), (0.003, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)))


@pytest.mark.parametrize("rolls", [0.05, None])
@pytest.mark.parametrize("count", [3, 8])
def test_one_light_off_its_place_has_the_same_number_in_every_exact_picture(count, rolls):
    for seed in range(4):
        views = dock_views(TRUE, seed, count=count, noise_px=0.0, rolls=rolls)
        placed = [place_view(view, CAMERA, nominal(TRUE)) for view in views]
        numbered = aligned([each for each in placed if each is not None], nominal(TRUE))
        assert numbered is not None
        assert len(numbered) == count
        assert {tuple(each.lights.tolist()) for each in numbered} == {tuple(numbered[0].lights.tolist())}


@pytest.mark.parametrize("seed", range(2))
def test_even_lights_in_single_pictures_are_not_numbered(seed):
    """Noise has no likeness from one half of the views to the other."""
    even = Dock(0.30, 10)
    placed = [place_view(view, CAMERA, even) for view in dock_views(even, seed, count=30, rolls=None)]
    assert aligned([each for each in placed if each is not None], even) is None


def test_a_light_more_or_less_is_a_turn_of_the_dock_by_the_angle_between_two():
    placed = place_view(dock_views(nominal(TRUE), 1, count=1, noise_px=0.0)[0], CAMERA, nominal(TRUE))
    assert placed is not None
    turned = placed.turned(2, 5)
    assert turned.lights.tolist() == ((placed.lights + 2) % 5).tolist()
    # The same lamps are seen in the same places.
    points = nominal(TRUE).light_points()
    np.testing.assert_allclose(turned.residuals_px(points), placed.residuals_px(points), atol=1e-9)
    assert np.trace(turned.rotation.T @ placed.rotation) == pytest.approx(1 + 2 * math.cos(4 * math.pi / 5))


def test_four_lights_are_too_few_for_a_view():
    view = dock_views(nominal(TRUE), 1, count=1, noise_px=0.0)[0]
    less = type(view)(view.name, view.points_px[:4], view.poses)
    assert place_view(less, CAMERA, nominal(TRUE)) is None


@pytest.mark.parametrize(("turn_deg", "same"), [(0.0, True), (3.0, True), (10.0, False), (60.0, False), (180.0, False)])
def test_rotations_a_few_degrees_apart_are_the_same(turn_deg, same):
    one = rotation_from_angles(0.3, -0.2, 1.0)
    for axis in np.eye(3):
        turn = cv2.Rodrigues(math.radians(turn_deg) * axis)[0]
        assert is_same(one, one @ turn) == same


@pytest.mark.parametrize("seed", range(3))
def test_lights_that_some_pictures_do_not_show_are_numbered_by_the_others(seed):
    """Of eight lights, of which the third is off its place, every picture lacks another one."""
    true = Dock(0.30, 8, offsets_m=((0, 0, 0), (0, 0, 0), (0.003, 0, 0), *[(0, 0, 0)] * 5))
    placed, kept = [], []
    for number, view in enumerate(dock_views(true, seed, count=9, noise_px=0.0, rolls=None)):
        shown = np.delete(np.arange(8), (3 * number + 4) % 8 if number % 8 != 2 else 0)
        one = place_view(type(view)(view.name, view.points_px[shown], view.poses), CAMERA, nominal(true))
        assert one is not None
        placed.append(one)
        kept.append(shown)
    numbered = aligned(placed, nominal(true))
    assert numbered is not None
    assert len({int(turn) for one, shown in zip(numbered, kept, strict=True) for turn in (one.lights - shown) % 8}) == 1
