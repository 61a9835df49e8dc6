"""That the other ways see what they should: each finds a near target in clear water (``make peers`` compares them)."""

import numpy as np
import pytest

from tests.bench.peers.methods import METHODS, OF_LIGHTS
from tests.bench.peers.scenes import AUTOMATIC, FIXED, WHITE_LEVELS, drawn_by_lamps, prints, seen
from tests.bench.peers.thresholds import angle_deg

POSES = 6
FIRST_OF_TWO = "WhyCon's ring, first pose"  # which may be the other one, so that its angle is not asked for


@pytest.mark.parametrize("name", METHODS)
def test_each_way_finds_what_is_near_and_clear(name):
    offs = []
    for number in range(POSES):
        one = seen(1, 0.0, 4.0, number)[AUTOMATIC]
        answer = METHODS[name](one)
        if answer is not None:
            off = np.linalg.norm(answer.position_m - one.position_m) / np.linalg.norm(one.position_m)
            offs.append((float(off), angle_deg(answer.normal, one.normal)))
    assert len(offs) >= POSES / 2
    off, turned = np.median(offs, axis=0)
    print(f"\n{name}: {len(offs)} of {POSES}, {100 * off:.2f} % of the range, {turned:.2f} degrees")
    assert off < 0.02
    assert turned < 2 or name == FIRST_OF_TWO


@pytest.mark.parametrize("name", OF_LIGHTS[:2])
def test_the_other_drawer_shows_the_same(name):
    one = drawn_by_lamps(1, 4.0, 0)
    answer = METHODS[name](one)
    assert answer is not None
    assert np.linalg.norm(answer.position_m - one.position_m) < 0.005 * np.linalg.norm(one.position_m)
    assert angle_deg(answer.normal, one.normal) < 1


def test_one_exposure_dims_lamps_and_plates_and_automatic_exposure_neither():
    near, far = (seen(1, 0.6, diameters, 0) for diameters in (4.0, 14.0))
    for target in ("ring", *prints()):
        brightest = [
            float(np.percentile(one[rule].images[target], 99.9)) for rule in (FIXED, AUTOMATIC) for one in (near, far)
        ]
        assert brightest[1] < brightest[0] - 25, (target, brightest)
        assert brightest[3] > brightest[1] + 10, (target, brightest)
    assert abs(np.percentile(near[AUTOMATIC].images["aruco"], 99) - WHITE_LEVELS) < 25
