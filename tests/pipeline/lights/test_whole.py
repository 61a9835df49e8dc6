import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import fit_ellipse
from dockpose.lights.whole import spaced_as

DENSITY = 12 / (640 * 480)


def on_ellipse(angles_deg, off_px=0.0):
    angles = np.radians(angles_deg)
    off = off_px * np.cos(5 * angles)
    return np.column_stack([320 + (80 + off) * np.cos(angles), 240 + (60 + off) * np.sin(angles)])


def number(angles_deg, dock, off_px=0.0):
    points = on_ellipse(angles_deg, off_px)
    return spaced_as(points, fit_ellipse(points), dock, DENSITY)


EVEN, BY_HAND = np.arange(0, 360, 36.0), [0, 60, 75, 135, 150, 200, 215, 270, 285, 335]


def test_even_lights_are_of_their_own_number_or_of_the_docks_but_not_of_every_second_of_it():
    assert [number(EVEN, Dock(0.3, told)) for told in (None, 10, 20)] == [10, 10, None]
    assert number(EVEN[:9], Dock(0.3, 10)) == 10


def test_of_an_unknown_number_lights_that_hands_have_spaced_stay_open_unless_chance_or_a_gap_explains_them():
    assert number(BY_HAND, Dock(0.3)) == 0
    assert number(BY_HAND, Dock(0.3), off_px=2.5) is None  # any ten points lie as near to an ellipse
    assert number([0, 20, 45, 70, 100, 125, 150, 170, 195, 215], Dock(0.3)) is None  # 145 degrees without one
    assert number([0, 50, 130, 190, 300], Dock(0.3)) is None  # five points always lie on one


@pytest.mark.parametrize(("count", "told"), [(10, 10), (9, None)])
def test_a_dock_whose_angles_are_given_has_all_of_its_lights(count, told):
    assert number(BY_HAND[:count], Dock(0.3, angles_deg=tuple(BY_HAND))) == told
