import numpy as np
import pytest
from dockpose.lights.chance import Near, cables_of, near_of, squares_apart_px2

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
        ([0, 1, 2, 3, 4, 5, 6, 7, 8], 12, [], 0),  # three quarters of a ring are no cable
        ([], 12, [], 0),
    ],
)
def test_the_lamps_of_open_arcs_hang_on_cables(lit, sides, steps, out):
    is_lit = np.zeros(sides, bool)
    is_lit[lit] = True
    cables = cables_of(is_lit)
    assert (cables.steps.tolist(), cables.out) == (steps, out)


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
