import math

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera import FlatPort
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.learned.views import DockView, Placed, aligned, is_same, place_view
from dockpose.pose.refine import light_rays
from dockpose.pose.solve import find_poses

from tests.support.docks import CAMERA, dock_views, nominal

TRUE = Dock(0.30, 5, offsets_m=((0, 0, 0), (0.003, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)))


@pytest.mark.parametrize("rolls", [0.05, None])
@pytest.mark.parametrize("count", [3, 8])
def test_one_light_off_its_place_has_the_same_number_in_every_exact_picture(count, rolls):
    for seed in range(4):
        views = dock_views(TRUE, seed, count=count, noise_px=0.0, rolls=rolls)
        placed = [place_view(view, CAMERA, nominal(TRUE)) for view in views]
        numbered = aligned([each for each in placed if each is not None], nominal(TRUE))[0]
        assert len(numbered) == count
        assert {tuple(each.lights.tolist()) for each in numbered} == {tuple(numbered[0].lights.tolist())}


def test_a_light_more_or_less_is_a_turn_of_the_dock_by_the_angle_between_two():
    placed = place_view(dock_views(nominal(TRUE), 1, count=1, noise_px=0.0)[0], CAMERA, nominal(TRUE))
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
        placed.append(one)
        kept.append(shown)
    numbered = aligned(placed, nominal(true))[0]
    assert len({int(turn) for one, shown in zip(numbered, kept, strict=True) for turn in (one.lights - shown) % 8}) == 1


@pytest.mark.parametrize("port", [None, FlatPort(0.2, 0.01)])
def test_lights_of_an_exact_view_have_no_residuals_and_move_as_the_derivatives_say(port):
    """The port is as far off as a long housing's, so that where the rays begin matters."""
    camera, points_m = Camera(700, 650, 319.5, 239.5, 640, 480, port=port), TRUE.light_points()
    rotation, place_m = rotation_from_angles(0.4, -0.3, 0.7), np.array([0.1, -0.05, 0.9])
    points_px = camera.project(points_m @ rotation.T + place_m)
    seen = Placed(light_rays(points_px, camera, 0.9), rotation, place_m, np.arange(5), points_px, follows=False)
    np.testing.assert_allclose(seen.residuals_px(points_m), 0, atol=1e-6)
    by_pose, by_place = seen.derivatives(points_m)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        moved = Placed(seen.rays, rotation, place_m + step, seen.lights, points_px, follows=False)
        turn = cv2.Rodrigues(step)[0]
        turned = Placed(seen.rays, rotation @ turn, place_m, seen.lights, points_px, follows=False)
        for after, told in (
            (moved.residuals_px(points_m), by_pose[:, axis]),
            (turned.residuals_px(points_m), by_pose[:, 3 + axis]),
            (seen.residuals_px(points_m + step), by_place[:, :, axis].ravel()),
        ):
            np.testing.assert_allclose(after / 1e-6, told, rtol=1e-3, atol=0.2)
    moved_px = light_rays(points_px + [1.0, 0.0], camera, 0.9)
    off = Placed(moved_px, rotation, place_m, np.arange(5), points_px, follows=False).residuals_px(points_m)
    np.testing.assert_allclose(off.reshape(-1, 2), np.tile([-1.0, 0.0], (5, 1)), atol=0.01)


def rolled(steps):
    """Exact views of an even dock of ten that rolls by these parts of the spacing from one to the next."""
    dock = Dock(0.30, 10)
    for number, roll in enumerate(np.cumsum(steps) * 2 * math.pi / 10):
        place_m = dock.light_points() @ rotation_from_angles(0.3, 0.2, roll).T + [0.0, 0.0, 1.0]
        points_px = CAMERA.project(place_m)
        _, choice = find_poses(points_px, CAMERA, dock)
        view = place_view(DockView("", points_px, choice.candidates, number > 0), CAMERA, dock)
        assert view is not None
        yield view


@pytest.mark.parametrize("step", [0.2, -0.2])
def test_a_light_keeps_its_number_while_the_dock_that_is_followed_rolls_by_more_than_its_spacing(step):
    numbered = aligned(list(rolled([0.1, *[step] * 30])), Dock(0.30, 10))[0]
    assert {tuple(each.lights.tolist()) for each in numbered} == {tuple(numbered[0].lights.tolist())}
    assert all(each.follows for each in numbered[1:])


@pytest.mark.parametrize(("step", "follows"), [(0.1, True), (0.2, True), (0.3, False), (-0.45, False), (1.2, True)])
def test_a_roll_about_half_way_between_two_lights_leaves_open_which_follows_which(step, follows):
    numbered = aligned(list(rolled([0.1, step])), Dock(0.30, 10))[0]
    assert [each.follows for each in numbered] == [False, follows]
