import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.polygon import places_of


@pytest.mark.parametrize("angles_deg", [(0, 80, 200, 310), (310, 200, 0, 80)])
def test_the_places_of_lights_that_are_not_even_are_in_order_around_the_ring_in_radii(angles_deg):
    around = np.radians([0, 80, 200, 310])
    wanted = np.column_stack([np.cos(around), np.sin(around)])
    np.testing.assert_allclose(places_of(7, Dock(0.30, angles_deg=angles_deg)), wanted, atol=1e-9)
    learned = Dock(0.30, 4, offsets_m=((0.03, 0.0, 0.001), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(places_of(7, learned), [[1.2, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-9)


def test_even_lights_are_as_many_as_are_asked_for():
    np.testing.assert_allclose(places_of(4, Dock(0.30)), [[1, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-9)
