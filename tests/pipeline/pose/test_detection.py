import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.lights.ring import Ring
from dockpose.pose.detection import detection_of

from tests.support.scenes import CAMERA, DOCK
from tests.support.two_docks import drawn, lights_m


def test_each_ring_that_could_as_well_be_the_dock_counts_against_it():
    for alike, probability in ((0, 1.0), (1, 1 / 2), (3, 1 / 4)):
        ring = Ring(np.ones(10, dtype=bool), "", lights=10, alike=alike)
        assert detection_of(-50.0, ring, DOCK) == pytest.approx(probability)
    docks = [(lights_m(np.array([x, 0.0, 2.0]), (0.2, 0.3)), 150, 0.004) for x in (-0.35, 0.35)]
    one, both = (estimate(drawn(those, 0), CAMERA, DOCK).detection for those in (docks[:1], docks))
    assert one is not None
    assert both is not None
    assert one > 0.99
    assert both < 0.6


@pytest.mark.parametrize(("lights", "most"), [(19, 0.5), (7, 1.0), (10, 1.0)])
def test_a_ring_of_an_unknown_number_with_few_of_its_places_filled_is_never_sure(lights, most):
    ring = Ring(np.ones(7, dtype=bool), "", lights=lights)
    assert detection_of(-50.0, ring, Dock(0.30)) == pytest.approx(most)
    assert detection_of(-50.0, ring, Dock(0.30, lights)) == pytest.approx(1.0)
