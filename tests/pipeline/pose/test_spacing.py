import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.spacing import place

TEN = Dock(0.3, 10)
UNEVEN = Dock(0.3, angles_deg=(0, 30, 100, 160, 200, 290))


def test_even_lights_are_numbered_in_turn():
    points = np.radians([5 + 36 * light for light in (0, 1, 3, 9)])
    placement = place(points[None], TEN)
    assert placement.fits == [True]
    steps = (placement.lights[0] - placement.lights[0, 0]) % 10
    assert steps.tolist() == [0, 1, 3, 9]
    assert placement.period_rad == pytest.approx(math.pi / 5)
    np.testing.assert_allclose(np.exp(1j * placement.angles_rad[0]), np.exp(1j * points), atol=1e-9)


def test_each_candidate_is_judged_by_itself():
    good = np.radians([5 + 36 * light for light in range(10)])
    bad = good + np.radians(20) * np.sin(good)
    assert place(np.array([good, bad]), TEN).fits == [True, False]


def test_two_points_at_one_light_do_not_fit():
    assert place(np.radians([[0, 36, 72, 74, 144]]), TEN).fits == [False]


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0, 5.5])
def test_uneven_lights_tell_their_numbers_and_the_whole_roll(turn):
    which = [5, 0, 1, 3]
    points = np.radians(UNEVEN.angles_deg)[which] + turn + np.array([0.01, -0.01, 0.005, 0.0])
    placement = place(points[None], UNEVEN)
    assert placement.fits == [True]
    assert placement.lights[0].tolist() == which
    assert placement.rolls_rad[0] % (2 * math.pi) == pytest.approx(turn, abs=0.01)
    assert placement.period_rad == pytest.approx(2 * math.pi)


def test_even_points_do_not_fit_an_uneven_dock():
    assert place(np.radians([[0, 60, 120, 180, 240, 300]]), UNEVEN).fits == [False]


def test_one_red_light_breaks_the_symmetry():
    dock = Dock(0.3, colours=("red", *["white"] * 9))
    points = np.radians([36.0 * light + 100 for light in range(10)])[None]
    labels = ["white"] * 10
    labels[4] = "red"
    placement = place(points, dock, labels)
    assert placement.lights[0].tolist() == [(light - 4) % 10 for light in range(10)]
    assert placement.rolls_rad[0] % (2 * math.pi) == pytest.approx(math.radians(100 + 144))


def test_colours_that_cannot_be_told_leave_the_roll_open():
    dock = Dock(0.3, colours=("red", *["white"] * 9))
    placement = place(np.radians([36.0 * light for light in range(10)])[None], dock, [None] * 10)
    assert placement.period_rad == pytest.approx(math.pi / 5)
