import numpy as np
import pytest

from tests.pipeline.lights.test_ring import lights, ring_of

OTHERS = np.array([[60.0, 60.0], [580.0, 420.0]])


@pytest.mark.parametrize(
    ("off_px", "others", "found"), [(1.0, 2, True), (3.0, 1, True), (3.0, 2, False), (20.0, 1, False)]
)
def test_four_lights_beside_but_one_other_may_be_farther_off_their_places(off_px, others, found):
    ours = lights(4, z_m=2.0)
    ours[0, 0] += off_px
    assert ring_of(np.vstack([ours, OTHERS[:others]]), 4).found == found
