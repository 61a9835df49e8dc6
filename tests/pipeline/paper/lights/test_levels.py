import numpy as np
import pytest
from dockpose.paper.lights import levels
from dockpose.paper.lights.scenes import near_ring
from dockpose.simulate import truth_of
from dockpose.thresholds import histogram_of


@pytest.fixture(scope="module")
def picture():
    return levels.picture_of(near_ring(7))


def test_centres_are_off_by_what_the_geometry_says(picture):
    level = picture.hats.level
    (mass_moment, ellipse, by_pose), nothing = levels.centre_sweep(picture, [level, 255])
    truth = picture.truth
    # The exact lights' mean, and the exact centre of the circle's image; the pose's own centre is the reference.
    assert mass_moment == pytest.approx(np.linalg.norm(truth.lights_px.mean(axis=0) - truth.centre_px), abs=0.1)
    assert ellipse == pytest.approx(np.linalg.norm(np.subtract(truth.ellipse.centre_px, truth.centre_px)), abs=0.1)
    assert by_pose < 0.1
    assert ellipse > 5
    assert np.isnan(nothing).all()  # too few lights reach saturation


def test_a_missing_light_moves_the_mass_moment_alone(picture):
    lost = levels.picture_of(near_ring(7, (2, 3, 4)))
    before, after = (levels.centre_sweep(one, [one.hats.level])[0] for one in (picture, lost))
    assert abs(after[0] - before[0]) > 10
    assert after[1:] == pytest.approx(before[1:], abs=0.1)


def test_levels_by_their_rules(picture):
    level = picture.hats.level
    assert picture.groups[level] == picture.lights == 12
    low, high = levels.merged_level(picture), levels.losing_level(picture)
    assert picture.groups[low] <= 6 < picture.groups[low + 1]
    assert picture.groups[high] <= 6 < picture.groups[high - 1]
    assert low < level < high
    flooded = levels.at_level(picture, levels.flooded_level(picture))
    assert 0.1 < flooded.kept < 0.6
    assert flooded.groups > 1000


def test_the_ellipse_is_the_same_at_two_levels_but_for_a_fraction_of_a_pixel():
    found = levels.two_levels(near_ring(7), 4)
    assert found.levels[0] < found.levels[1]
    assert (found.lights[:, 0] == 12).all()
    assert (found.lights[:, 1] <= 9).all()
    assert (np.abs(found.mean_difference[:4]) < 0.5).all()
    assert found.errors.shape == (4, 2, 6)
    assert (np.abs(found.errors[:, :, :4]) < 0.5).all()
    # Its own arithmetic: the mean's standard error is the scatter over the root of the number.
    scatter = (found.errors[:, 1] - found.errors[:, 0]).std(axis=0, ddof=1)
    np.testing.assert_allclose(found.standard_error, scatter / 2)


LIGHTS = np.array([[10.0, 10.0], [50.0, 10.0], [30.0, 40.0]])


def picture_with_groups():
    picture = np.zeros((40, 60), np.uint8)
    picture[9:12, 9:12] = 200  # centre (10, 10)
    picture[9:12, 49:52] = 120  # centre (50, 10)
    picture[30, 5] = 255
    return histogram_of(picture)


def test_points_are_the_lights_each_once_and_nothing_else():
    assert levels.are_the_lights(LIGHTS[::-1] + 2.0, LIGHTS)
    assert not levels.are_the_lights(LIGHTS[:2], LIGHTS)
    assert not levels.are_the_lights(LIGHTS + [0, 4.1], LIGHTS)
    assert not levels.are_the_lights(LIGHTS[[0, 0, 2]], LIGHTS)


def test_centres_of_groups_by_hand():
    histogram = picture_with_groups()
    np.testing.assert_allclose(levels.group_centres(histogram, 100, 2), [[10, 10], [50, 10]])
    np.testing.assert_allclose(levels.group_centres(histogram, 130, 2), [[10, 10]])
    assert len(levels.group_centres(histogram, 130, 1)) == 2
    assert len(levels.group_centres(histogram, 256, 1)) == 0


def test_some_level_shows_the_lights_or_none():
    histogram = picture_with_groups()
    assert levels.any_level_shows_the_lights(histogram, LIGHTS[:2], 2)
    assert levels.any_level_shows_the_lights(histogram, LIGHTS[:1], 2)
    assert not levels.any_level_shows_the_lights(histogram, LIGHTS[1:2], 2)  # never alone: the other is brighter


def test_the_ellipse_through_the_exact_lights_has_the_true_pose():
    scene = near_ring(0)
    truth = truth_of(scene)
    poses = levels.poses_of_all(truth.lights_px, scene.camera, scene.dock)
    assert sum(levels.is_right(pose, truth) for pose in poses) == 1
    assert min(levels.pose_errors(pose, truth)[1] for pose in poses) < 1e-3
    # A stray group pulls the ellipse away; four points have none.
    stray = np.vstack([truth.lights_px, [600.0, 450.0]])
    assert not any(levels.is_right(pose, truth) for pose in levels.poses_of_all(stray, scene.camera, scene.dock))
    assert levels.poses_of_all(truth.lights_px[:4], scene.camera, scene.dock) == ()
