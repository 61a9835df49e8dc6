import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.placement import place

EVEN = Dock(1.0, lights=8)
STEP = np.pi / 4
KNOWN = Dock(1.0, lights=5, angles_deg=(0.0, 40.0, 110.0, 200.0, 290.0))


def test_points_of_an_even_ring_are_numbered_from_their_common_roll():
    points = 0.2 + STEP * np.array([0, 3, 5, -2])
    placement = place(points[None], EVEN)
    assert placement.lights.tolist() == [[0, 3, 5, 6]]
    assert placement.rolls_rad == pytest.approx([0.2])
    np.testing.assert_allclose(placement.angles_rad, [points], atol=1e-12)
    assert placement.fits == [True]
    assert placement.period_rad == pytest.approx(STEP)


def test_the_roll_is_the_mean_of_what_points_are_off_and_each_may_be_off_by_a_quarter_of_the_spacing():
    off = np.array([0.02, -0.02, 0.03, -0.03])
    placement = place((0.1 + STEP * np.arange(4) + off)[None], EVEN)
    assert placement.rolls_rad == pytest.approx([0.1], abs=1e-3)
    np.testing.assert_allclose(placement.angles_rad, [0.1 + STEP * np.arange(4)], atol=1e-3)
    for share, fits in ((0.2, True), (0.35, False)):
        points = STEP * np.arange(7)
        points[3] += share * STEP * 7 / 6  # the roll follows by a sixth of it or so
        assert place(points[None], EVEN).fits == [fits]


def test_two_points_that_are_one_light_do_not_fit():
    assert place(np.array([[0, 0.02, STEP, 2 * STEP]]), EVEN).fits == [False]
    assert place(np.array([[0, 8 * STEP, STEP, 2 * STEP]]), EVEN).fits == [False]
    assert place(np.radians([[0.0, 2.0, 40.0, 110.0, 200.0]]), KNOWN).fits == [False]


def test_candidates_are_placed_each_by_itself():
    good, bad = STEP * np.arange(5) - 0.1, STEP * np.arange(5) * 1.13
    placement = place(np.array([good, bad]), EVEN)
    assert placement.fits == [True, False]
    assert placement.rolls_rad[0] == pytest.approx(-0.1)


def test_all_lights_of_a_ring_are_known_by_their_order_also_where_hands_have_put_them():
    # Neighbours a third of a spacing off one way and the other: farther than a quarter, .24 root mean square.
    off = STEP * np.array([0.34, -0.34, 0, 0.34, -0.34, 0, 0, 0])
    points = np.roll(STEP * np.arange(8) + off + 0.05, 3)
    placement = place(points[None], EVEN)
    assert placement.fits == [True]
    assert placement.rolls_rad == pytest.approx([0.05])
    assert placement.lights.tolist() == [np.roll(np.arange(8), 3).tolist()]
    np.testing.assert_allclose(placement.angles_rad, [np.roll(STEP * np.arange(8) + 0.05, 3)])
    # Of so many that are so far off nothing tells, nor of a part of the ring.
    assert place(STEP * (np.arange(8) + 0.45 * np.tile([-1, 1], 4))[None], EVEN).fits == [False]
    assert place(points[None, :7], EVEN).fits == [False]


def test_lights_at_known_angles_are_found_at_any_roll():
    known = np.radians(KNOWN.angles_deg)
    for roll in (-2.0, 0.3, 3.0):
        which = [4, 1, 2, 0]
        placement = place((known[which] + roll)[None], KNOWN)
        assert placement.lights.tolist() == [which]
        assert np.angle(np.exp(1j * (placement.rolls_rad[0] - roll))) == pytest.approx(0, abs=1e-9)
        np.testing.assert_allclose(np.exp(1j * placement.angles_rad), np.exp(1j * (known[which] + roll))[None])
        assert placement.fits == [True]
        assert placement.period_rad == pytest.approx(2 * np.pi)


def test_a_known_light_may_be_off_by_a_quarter_of_the_mean_spacing_beside_the_mean():
    known, step = np.radians(KNOWN.angles_deg), 2 * np.pi / 5
    for share, fits in ((0.28, True), (0.4, False)):
        points = known.copy()
        points[2] += share * step  # of which the roll takes a fifth
        placement = place(points[None], KNOWN)
        assert placement.lights.tolist() == [[0, 1, 2, 3, 4]]
        assert placement.fits == [fits]
        assert placement.rolls_rad == pytest.approx([share * step / 5])
