import numpy as np
import pytest
from dockpose.paper import levels
from dockpose.paper.levels import Picture, are_the_lights, group_centres
from dockpose.paper.scenes import near_ring
from dockpose.simulate import truth_of
from dockpose.study.judge import is_right, pose_errors
from dockpose.thresholds import histogram_of


@pytest.fixture(scope="module")
def picture():
    return Picture(near_ring(7))


def centre_errors(picture, level):
    return levels.centre_errors_px(picture.at(level).found, picture.truth.centre_px)


def test_centres_are_off_by_what_the_geometry_says(picture):
    mass_moment, ellipse, by_pose = centre_errors(picture, picture.hats.level)
    truth = picture.truth
    # The exact lights' mean, and the exact centre of the circle's image; the pose's own centre is the reference.
    assert mass_moment == pytest.approx(np.linalg.norm(truth.lights_px.mean(axis=0) - truth.centre_px), abs=0.1)
    assert ellipse == pytest.approx(np.linalg.norm(np.subtract(truth.ellipse.centre_px, truth.centre_px)), abs=0.1)
    assert by_pose < 0.1
    assert ellipse > 5
    assert np.isnan(centre_errors(picture, 255)).all()  # too few lights reach saturation
    # A missing light moves the mass moment alone.
    lost = Picture(near_ring(7, (2, 3, 4)))
    after = centre_errors(lost, lost.hats.level)
    assert abs(after[0] - mass_moment) > 10
    assert after[1:] == pytest.approx((ellipse, by_pose), abs=0.1)


def test_a_picture_at_a_level(picture):
    level = picture.hats.level
    assert picture.groups[level] == picture.lights == 12
    high = picture.losing_level()
    assert picture.groups[high] <= 6 < picture.groups[high - 1]
    assert level < high
    one = picture.at(level)
    assert (one.groups, one.found.lights_on_ring, one.is_right) == (12, 12, True)
    assert one.off[0] < 5
    assert one.kept == pytest.approx((picture.image >= level).mean())


def test_the_ellipse_is_the_same_at_two_levels_but_for_a_fraction_of_a_pixel(picture):
    (low, high), lights, errors = levels.two_levels(picture, 4)
    assert low < high
    assert (lights[:, 0] == 12).all()
    assert (lights[:, 1] <= 9).all()
    assert errors.shape == (4, 2, 6)
    assert (np.abs(errors[:, :, :4]) < 0.5).all()
    assert (np.abs(np.diff(errors, axis=1).mean(axis=0)[0, :4]) < 0.5).all()


LIGHTS = np.array([[10.0, 10.0], [50.0, 10.0], [30.0, 40.0]])


@pytest.mark.parametrize(
    ("points", "wanted"),
    [(LIGHTS[::-1] + 2.0, True), (LIGHTS[:2], False), (LIGHTS + [0, 4.1], False), (LIGHTS[[0, 0, 2]], False)],
)
def test_points_are_the_lights_each_once_and_nothing_else(points, wanted):
    assert are_the_lights(points, LIGHTS) == wanted


def test_groups_of_a_level_and_whether_any_level_shows_the_lights():
    image = np.zeros((40, 60), np.uint8)
    image[9:12, 9:12] = 200  # centre (10, 10)
    image[9:12, 49:52] = 120  # centre (50, 10)
    image[30, 5] = 255
    histogram = histogram_of(image)
    np.testing.assert_allclose(group_centres(histogram, 100), [[10, 10], [50, 10]])
    np.testing.assert_allclose(group_centres(histogram, 130), [[10, 10]])
    assert [len(group_centres(histogram, level, 1)) for level in (130, 256)] == [2, 0]
    assert levels.any_level_shows_the_lights(histogram, LIGHTS[:2])
    assert levels.any_level_shows_the_lights(histogram, LIGHTS[:1])
    assert not levels.any_level_shows_the_lights(histogram, LIGHTS[1:2])  # never alone: the other is brighter


def test_the_ellipse_through_the_exact_lights_has_the_true_pose():
    scene = near_ring(0)
    truth = truth_of(scene)

    def poses(points_px):
        return levels.poses_of_all(points_px, scene.camera, scene.dock)

    assert sum(is_right(pose, truth) for pose in poses(truth.lights_px)) == 1
    assert min(pose_errors(pose, truth)[1] for pose in poses(truth.lights_px)) < 1e-3
    # A stray group pulls the ellipse away; four points have none.
    assert not any(is_right(pose, truth) for pose in poses(np.vstack([truth.lights_px, [600.0, 450.0]])))
    assert poses(truth.lights_px[:4]) == ()
