import numpy as np
import pytest
from dockpose.lights.ellipse import fit_ellipse
from dockpose.paper.lights.levels import (
    PARAMETERS,
    at_level,
    centre_sweep,
    ellipse_values,
    flooded_level,
    losing_level,
    merged_level,
    picture_of,
    two_levels,
)
from dockpose.paper.lights.tank_scenes import near_ring


@pytest.fixture(scope="module")
def picture():
    return picture_of(near_ring(7))


def test_centres_are_off_by_what_the_geometry_says(picture):
    level = picture.hats.level
    (mass_moment, ellipse, by_pose), nothing = centre_sweep(picture, [level, 255])
    truth = picture.truth
    # The exact lights' mean, and the exact centre of the circle's image; the pose's own centre is the reference.
    assert mass_moment == pytest.approx(np.linalg.norm(truth.lights_px.mean(axis=0) - truth.centre_px), abs=0.1)
    assert ellipse == pytest.approx(np.linalg.norm(np.subtract(truth.ellipse.centre_px, truth.centre_px)), abs=0.1)
    assert by_pose < 0.1
    assert ellipse > 5
    assert np.isnan(nothing).all()  # too few lights reach saturation


def test_a_missing_light_moves_the_mass_moment_alone(picture):
    lost = picture_of(near_ring(7, (2, 3, 4)))
    before, after = (centre_sweep(one, [one.hats.level])[0] for one in (picture, lost))
    assert abs(after[0] - before[0]) > 10
    assert after[1:] == pytest.approx(before[1:], abs=0.1)


def test_levels_by_their_rules(picture):
    level = picture.hats.level
    assert picture.groups[level] == picture.lights == 12
    low, high = merged_level(picture), losing_level(picture)
    assert picture.groups[low] <= 6 < picture.groups[low + 1]
    assert picture.groups[high] <= 6 < picture.groups[high - 1]
    assert low < level < high
    flooded = at_level(picture, flooded_level(picture))
    assert 0.1 < flooded.kept < 0.6
    assert flooded.groups > 1000


def test_the_parameters_of_an_ellipse_by_hand():
    turn = np.radians(30)
    t = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    along, across = 50 * np.cos(t), 30 * np.sin(t)
    x, y = (
        100 + along * np.cos(turn) - across * np.sin(turn),
        80 + along * np.sin(turn) + across * np.cos(turn),
    )
    values = ellipse_values(fit_ellipse(np.column_stack([x, y])))
    assert dict(zip(PARAMETERS, values, strict=True)) == pytest.approx(
        {
            "centre x": 100,
            "centre y": 80,
            "semi-major axis": 50,
            "semi-minor axis": 30,
            "angle": 30,
            "eccentricity": 0.8,
        }
    )


def test_the_ellipse_is_the_same_at_two_levels_but_for_a_fraction_of_a_pixel():
    found = two_levels(near_ring(7), 4)
    assert found.levels[0] < found.levels[1]
    assert (found.lights[:, 0] == 12).all()
    assert (found.lights[:, 1] <= 9).all()
    assert (np.abs(found.mean_difference[:4]) < 0.5).all()
    assert found.errors.shape == (4, 2, 6)
    assert (np.abs(found.errors[:, :, :4]) < 0.5).all()
    # Its own arithmetic: the mean's standard error is the scatter over the root of the number.
    scatter = (found.errors[:, 1] - found.errors[:, 0]).std(axis=0, ddof=1)
    np.testing.assert_allclose(found.standard_error, scatter / 2)
