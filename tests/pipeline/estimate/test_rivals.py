"""Other rings in a picture, as the tracker asks for them."""

import numpy as np
from dockpose import estimate
from dockpose.estimate.rivals import rings_of

from tests.support.scenes import CAMERA, DOCK
from tests.support.two_docks import drawn, lights_m

FIRST_M, SECOND_M = np.array([-0.35, 0.05, 1.8]), np.array([0.4, -0.05, 2.1])


def picture(*places_m):
    return drawn([(lights_m(place_m, (0.1, -0.2)), 130, 0.004) for place_m in places_m], 3)


def test_of_two_docks_in_view_each_is_a_ring_and_the_other_its_rival():
    rings = list(rings_of(estimate(picture(FIRST_M, SECOND_M), CAMERA, DOCK)))
    assert len(rings) == 2
    for ring, rival, place_m in zip(rings, reversed(rings), (FIRST_M, SECOND_M), strict=True):
        assert ring.selected is not None
        assert ring.ring is not None
        assert rival.ring is not None
        np.testing.assert_allclose(ring.selected.position_m, place_m, atol=0.02)
        assert [each.tolist() for each in ring.ring.rivals] == [rival.ring.on_ring.tolist()]
        assert (ring.lights_on_ring, ring.dock) == (10, DOCK)


def test_a_dock_alone_has_no_rivals_and_nothing_has_no_rings():
    found = estimate(picture(FIRST_M), CAMERA, DOCK)
    assert list(rings_of(found)) == [found]
    assert list(rings_of(estimate(picture(), CAMERA, DOCK))) == []
