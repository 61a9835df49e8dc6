import numpy as np
import pytest
from dockpose.lights.chance import (
    ALIKE,
    NO_STRINGS,
    NONE_NEAR,
    Near,
    Scene,
    Strings,
    log_background,
    log_chance_of,
    log_chance_of_all,
    log_tube,
    near_of,
    squares_apart_px2,
    strings_of,
)
from dockpose.lights.ellipse import Ellipse

from tests.pipeline.lights.test_ring import lights, ring_of

OTHERS = np.array([[60.0, 60.0], [580.0, 420.0]])


@pytest.mark.parametrize(
    ("off_px", "others", "found"), [(1.0, 2, True), (3.0, 1, True), (3.0, 2, False), (20.0, 1, False)]
)
def test_four_lights_beside_but_one_other_may_be_farther_off_their_places(off_px, others, found):
    ours = lights(4, z_m=2.0)
    ours[0, 0] += off_px
    assert ring_of(np.vstack([ours, OTHERS[:others]]), 4).found == found


@pytest.mark.parametrize(
    ("lit", "sides", "steps", "out"),
    [
        ([0, 1, 2, 4], 12, [3.0, 0.25, 0.5], 1),  # one arc, on which one lamp is out
        ([0, 1, 5, 6], 16, [3.0, 3.0], 0),  # two arcs of two lamps, of which only the second of each is near another
        ([11, 0, 1], 12, [3.0, 0.25], 0),  # an arc across the first light
        ([0, 3, 6, 9], 12, [], 0),  # no gap is larger than a quarter of the ring
        ([0, 1, 2, 3, 4, 5, 6, 7, 8], 12, [], 0),  # three quarters of a ring are no string
        ([], 12, [], 0),
    ],
)
def test_the_lamps_of_open_arcs_hang_on_cables(lit, sides, steps, out):
    is_lit = np.zeros(sides, bool)
    is_lit[lit] = True
    strings = strings_of(is_lit)
    assert (strings.steps.tolist(), strings.out) == (steps, out)


@pytest.mark.parametrize(
    ("minor", "others", "near"),
    [
        (10.0, [(0, 5, 2.0), (19, 0, 0.5), (25, 0, 2.0)], Near(2, 2, 1, 1)),
        (2.0, [(0, 15, 1.0)], Near(1, 0, 1, 0)),  # within twice the larger radius of a narrow ring, but not beside it
    ],
)
def test_others_near_a_ring_are_counted_around_it_and_beside_it(minor, others, near):
    ring = [(10, 0, 1.0), (-10, 0, 1.0), (0, minor, 1.0), (0, -minor, 1.0)]
    points = np.array([*others, *ring])
    members = np.arange(len(others), len(points))
    assert near_of(points[:, :2].copy(), points[:, 2].copy(), members, (0.0, 0.0), 10.0) == near


def test_squares_along_the_rim_and_across_it_do_not_depend_on_the_roll():
    places_rad = 2 * np.pi * np.arange(8) / 8
    seen = np.column_stack([np.full(8, 0.2), places_rad + 0.3 + np.tile([0.1, -0.1], 4)])
    seen[:, 1] = np.angle(np.exp(1j * seen[:, 1]))
    along, across = squares_apart_px2(seen, places_rad, (20.0, 10.0))
    assert along == pytest.approx(8 * 0.1**2 * 200)
    assert across == pytest.approx(8 * 0.2**2 * 200)


def test_a_tube_is_as_large_as_the_ball_of_errors_and_the_ways_to_choose_its_lights():
    alike = (-1.0, -1.0)
    # Of four lights two errors are left: a disc, of twice the squares twice as large. Of six lights they are six.
    assert tube(4, 4, squares=9.0) - tube(4, 4, squares=4.5) == pytest.approx(np.log(2))
    assert tube(6, 6, squares=9.0) - tube(6, 6, squares=4.5) == pytest.approx(3 * np.log(2))
    # A disc of 1 px is pi; and a ball in six dimensions pi^3 / 6.
    places = [np.log(2 * np.pi**2 / 3 * count**3 / 4 * 6 * (count - 3)) for count in (4, 6)]
    assert tube(4, 4, squares=1.0) == pytest.approx(places[0] + np.log(np.pi))
    assert tube(6, 6, squares=1.0) == pytest.approx(places[1] + np.log(np.pi**3 / 6))
    # Nobody knows a centre to better than .05 px.
    assert tube(6, 6, squares=0.0) == pytest.approx(tube(6, 6, squares=6 * 0.05**2))
    # Six of eight: 28 ways, by eight turns of an even ring; and sizes by the corners beside three.
    missing = log_tube(6, 8, False, 1.0, alike) - log_tube(6, 6, False, 1.0, alike)
    assert missing == pytest.approx(np.log(28 * 5 / 3))
    assert log_tube(6, 8, False, 1.0, alike) - log_tube(6, 8, True, 1.0, alike) == pytest.approx(np.log(8))


def tube(count, sides, squares):
    """Of uneven rings."""
    return log_tube(count, sides, False, squares, (-1.0, -1.0))


def test_lights_off_along_the_rim_but_not_across_it_are_less_likely_to_be_chance():
    alike = tube(6, 6, 100.0)
    assert log_tube(6, 6, False, 100.0, (1e4, 1e4)) == pytest.approx(alike)
    # A ball in five dimensions of squares 100 is 8 pi^2 / 15 x 100^2.5, a line of 2 x .05 px is the least.
    apart = log_tube(6, 6, False, 100.0, (100.0, 0.0)) - (alike - np.log(np.pi**3 / 6 * 100**3))
    assert apart == pytest.approx(np.log(2 * 8 * np.pi**2 / 15 * 100**2.5 * 2 * 0.05))
    # Of four lights no such two kinds can be told.
    assert log_tube(4, 4, False, 9.0, (9.0, 0.0)) == pytest.approx(tube(4, 4, 9.0))


def test_a_background_of_strewn_points_is_as_dense_as_those_around():
    def four(around=0, bright=0, radius=10.0):
        return log_background(4, 4, (radius, radius), 1e6, Near(around, 0, bright, 0), NO_STRINGS)

    # One point on a disc of twice the radius, four times: (1 / 400 pi)^4, at a million places of the size 10^4.
    assert four() == pytest.approx(4 * np.log(1 / (400 * np.pi)) + np.log(1e6 * 10**4))
    assert four(around=2, bright=2) - four() == pytest.approx(4 * np.log(3))
    # As bright ones are fewer, but are one of eight choices.
    assert four(around=9, bright=0) - four() == pytest.approx(np.log(8))
    # No disc is larger than the picture.
    assert four(radius=1000.0) == pytest.approx(4 * np.log(1e-6) + np.log(1e6 * 1000.0**4))
    assert log_background(4, 4, (10.0, 0.0), 1e6, NONE_NEAR, NO_STRINGS) == np.inf


def test_a_crowd_counts_beside_a_narrow_ring_and_a_string_along_it():
    # Six lights on an ellipse of 100 x 10: the crowd beside it has 40 000 pi / 10 pixels, with 14 others.
    beside = log_background(6, 6, (100.0, 10.0), 1e6, Near(14, 14, 14, 14), NO_STRINGS)
    area = 4 * np.pi * 1000
    expected = 6 * np.log(20 / area) + np.log(area) + 2 * np.log(1000) - np.log(10)
    assert beside == pytest.approx(expected)
    # Of six lights of twelve, five hang within a quarter of a step of their places: a step is of pi 4 a b / 12^2 px^2.
    round_ring = (50.0, 50.0)
    free = log_background(6, 12, round_ring, 1e6, NONE_NEAR, NO_STRINGS)
    hung = log_background(6, 12, round_ring, 1e6, NONE_NEAR, Strings(np.full(5, 0.25), 1))
    step = 4 * np.pi * 2500 / 144
    one = np.log(1 / (4 * np.pi * 2500))
    assert hung == pytest.approx(
        one + np.log(0.05) - 5 * np.log(np.pi * 0.25**2 * step) + np.log(1e6 * 50.0**4) - np.log(1e4)
    )
    assert hung > free


def test_chance_counts_what_there_is_and_what_is_tried():
    points = np.column_stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)]) * 100

    def chance(count=8, *, numbers=1, squares=1.0, others=0, apart=(-1.0, -1.0)):
        corners = np.where(np.arange(8) < count, np.arange(8), -1)
        all_points = np.vstack([points[:count], 1000 + 100 * points[:others]])
        scene = Scene(all_points, np.ones(len(all_points)), 1e6, 700.0, True, numbers, np.array([np.inf]))
        return log_chance_of(corners, squares, apart, np.diag([100.0, 100.0, 1.0]), scene, False)

    plain = log_tube(8, 8, True, 1.0, ALIKE) + log_background(8, 8, (100.0, 100.0), 1e6, NONE_NEAR, NO_STRINGS)
    assert chance() == pytest.approx(plain)
    # Where nothing else is in view and no light missing, a number is one of two, else one of all that are tried.
    assert chance(numbers=21) - chance() == pytest.approx(np.log(2))
    assert chance(others=1, numbers=21) - chance(others=1) == pytest.approx(np.log(21))
    # Lights off by a tenth of the radius are a dock's only where nothing else is in view.
    far = 8 * 0.08**2 * 100**2
    assert chance(squares=far, apart=(far, 0.0)) < np.inf
    assert chance(squares=far, apart=(far, 0.0), others=1) == np.inf
    near = 8 * 0.03**2 * 100**2
    assert chance(squares=near, apart=(near, 0.0), others=1) < np.inf
    # Inexact lights of an unknown number must be three quarters of a ring.
    some = 100.0
    assert chance(5, squares=some / 10, apart=(some / 10, 0.0), numbers=21) == np.inf
    assert chance(6, squares=some / 10, apart=(some / 10, 0.0), numbers=21) < np.inf
    assert chance(5, squares=some / 10, apart=(some / 10, 0.0)) < np.inf  # but of a known one not
    assert chance(squares=1e6) == np.inf


def test_ellipses_through_points_strewn_at_random():
    # Six points of six: one choice of five, and one more within two rms both ways of an ellipse 2 pi 50 px long.
    expected = np.log(6) + np.log(1e-4 * 2 * np.pi * 50 * 4 * 1.0 * np.sqrt(6)) + np.log(6.0)
    assert log_chance_of_all(ellipse(1.0), 6, 1e-4) == pytest.approx(expected)
    beside = 1e-4 * 2 * np.pi * 50 * 4 * np.sqrt(8 / 3)
    assert log_chance_of_all(ellipse(1.0), 8, 1e-4) == pytest.approx(np.log(56 * 6) + 3 * np.log(beside))
    assert log_chance_of_all(ellipse(0.0), 6, 1e-4) == log_chance_of_all(ellipse(0.05), 6, 1e-4)
    assert log_chance_of_all(ellipse(0.0), 5, 1e-4) == np.inf


def ellipse(rms_px):
    return Ellipse(np.array([1.0, 0, 4, 0, 0, -2500]), (0.0, 0.0), (50.0, 25.0), 0.0, rms_px)


def test_what_is_near_a_ring_is_so_wherever_the_ring_is():
    at = np.arange(8) * np.pi / 4
    ring = np.column_stack([30 * np.cos(at) - 10 * np.sin(at), 12 * np.sin(at) + 5 * np.cos(at)])
    others = np.random.default_rng(2).uniform(-80, 80, (200, 2))
    brightness = np.concatenate([np.full(8, 2.0), np.linspace(1, 3, 200)])
    counts = []
    for shift in ([0.0, 0.0], [100.0, -50.0]):
        centre = (shift[0], shift[1])
        counts.append(near_of(np.vstack([ring, others]) + shift, brightness, np.arange(8), centre, 33.0))
    assert counts[0] == counts[1]
    # Beside it is within twice the ellipse of x = A (cos, sin).
    A = np.array([[30.0, -10.0], [5.0, 12.0]])
    beside = np.linalg.norm(np.linalg.solve(A, others.T), axis=0) < 2
    around = np.hypot(*others.T) < 66
    bright = brightness[8:] >= 2
    assert counts[0] == Near(around.sum(), beside.sum(), (around & bright).sum(), (beside & bright).sum())
