import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.number import choose_with_number
from dockpose.pose.solve import find_poses

from tests.support.docks import CAMERA

ROTATION = rotation_from_angles(0.35, -0.4, 0.2)


def seen(lights, which, noise_px=0.05, seed=0):
    dock = Dock(0.30, lights)
    points = CAMERA.project(np.array([0.1, -0.05, 1.2]) + dock.light_points()[list(which)] @ ROTATION.T)
    return points + np.random.default_rng(seed).normal(0, noise_px, points.shape)


@pytest.mark.parametrize(
    ("lights", "out"), [(10, ()), (10, (3,)), (8, (0, 5)), (16, (2, 9)), (24, (7,)), (12, (1, 2, 3))]
)
def test_number_and_pose_follow_from_the_lights_that_are_lit(lights, out):
    _, choice = find_poses(seen(lights, np.delete(np.arange(lights), out)), CAMERA, Dock(0.30))
    assert choice.number == lights
    assert choice.decided
    assert choice.candidates[0].normal @ -ROTATION[:, 2] > np.cos(np.radians(2))


def test_a_whole_ring_is_not_every_second_light_of_another():
    _, choice = find_poses(seen(16, range(0, 16, 2)), CAMERA, Dock(0.30))
    assert choice.number == 8


def test_a_number_that_was_told_is_none_that_spacing_tells():
    assert find_poses(seen(10, range(9)), CAMERA, Dock(0.30, 10))[1].number is None


def test_lights_anywhere_on_a_circle_have_no_number():
    angles = np.array([0.0, 0.3, 0.9, 2.0, 2.1, 3.9, 4.4, 5.6, 5.75])
    ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    _, choice = find_poses(CAMERA.project(np.array([0.1, 0, 1.0]) + ring @ ROTATION.T), CAMERA, Dock(0.30))
    assert (choice.number, choice.selected_by, choice.decided) == (None, "none", False)


def choice_by(first, probability, rms_px):
    """Two poses 60 degrees apart, of which the likelier has one of these normals."""
    normals = [np.array([s * 0.5, 0.0, -np.sqrt(0.75)]) for s in (first, -first)]
    return Choice(
        tuple(
            CirclePose.at(np.array([0.0, 0, 2.0]), normal, CAMERA, probability=p, rms_px=rms)
            for normal, p, rms in zip(normals, (probability, 1 - probability), rms_px, strict=True)
        ),
        0,
        "spacing",
        None,
    )


def test_probabilities_of_numbers_are_summed_by_what_their_squares_and_missing_lights_make_likely():
    # Of eight lights both numbers fit as well, but for one light that nobody sees: 15 in 100.
    of_number = {8: choice_by(1, 0.9, (0.1, 0.3)), 9: choice_by(-1, 0.8, (0.1, 0.3))}
    chosen = choose_with_number(lambda dock: of_number.get(dock.lights or 0), 8, CAMERA, Dock(0.30))
    assert chosen.number == 8
    assert chosen.candidates[0].probability == pytest.approx((0.9 + 0.15 * 0.2) / 1.15)
    assert chosen.candidates[0].normal[0] > 0
    assert choose_with_number(lambda dock: None, 8, CAMERA, Dock(0.30)) is None


def test_a_number_whose_lights_are_far_off_even_spacing_tells_nothing():
    # Eight lights of a ring of 15 cm, 2 m away, are spaced a fifth of which is some pixels.
    step_px = 2 * np.pi / 8 * CAMERA.fx * 0.15 / 2
    for share, number in ((0.19, 8), (0.21, None)):
        only = {8: choice_by(1, 0.9, (share * step_px, 2 * step_px))}
        chosen = choose_with_number(lambda dock, only=only: only.get(dock.lights or 0), 8, CAMERA, Dock(0.30))
        assert (None if chosen is None else chosen.number) == number
