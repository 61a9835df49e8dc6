# pyright: reportGeneralTypeIssues=false

import numpy as np
import pytest
from dockpose.tracking.association import mapped, moved, shifted

ANGLES = np.linspace(0, 2 * np.pi, 10, endpoint=False)
RING = np.column_stack([100 + 40 * np.cos(ANGLES), 80 + 30 * np.sin(ANGLES)])
TURN = np.array([[1.1 * np.cos(0.2), -1.1 * np.sin(0.2), 5.0], [1.1 * np.sin(0.2), 1.1 * np.cos(0.2), -9.0]])


def test_a_map_is_found_though_four_of_ten_are_elsewhere_and_one_is_unknown():
    now = moved(TURN, RING)
    now[[1, 4, 7, 8]] += [[20, 0], [0, 25], [-18, 3], [9, -30]]
    now[2] = np.nan
    by, near = mapped(RING, now, 1.5)
    np.testing.assert_allclose(by[:, :2], TURN[:, :2], atol=1e-9)
    np.testing.assert_allclose(moved(by, RING)[2], moved(TURN, RING)[2], atol=1e-6)
    assert np.flatnonzero(~near).tolist() == [1, 2, 4, 7, 8]


def test_one_point_tells_no_map():
    now = np.full((10, 2), np.nan)
    now[3] = RING[3]
    assert mapped(RING, now, 1.5) is None


@pytest.mark.parametrize("shift", [(15, -12), (0, 0), (-31, 22)])
def test_all_lights_are_shifted_together_though_one_place_is_brighter(shift):
    light = np.full((200, 240), 20, np.uint8)
    light[20:40, 20:40] = 255  # a lamp
    for x, y in np.rint(RING + shift).astype(int):
        light[y - 1 : y + 2, x - 1 : x + 2] = 120
    found = shifted(light, [RING], np.full(10, 100.0), 45.0, 2)
    np.testing.assert_allclose(found, RING + shift, atol=3)
