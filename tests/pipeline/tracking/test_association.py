# pyright: reportGeneralTypeIssues=false, reportOptionalSubscript=false

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


@pytest.mark.parametrize(
    ("size", "turned_deg", "is_found"),
    [(1.5, 30, True), (1 / 1.5, -30, True), (1.7, 0, False), (1 / 1.7, 0, False), (1, 45, False), (1, -45, False)],
)
def test_between_two_frames_lights_grow_and_turn_by_so_much_and_no_more(size, turned_deg, is_found):
    turn = size * np.exp(1j * np.radians(turned_deg))
    by = np.array([[turn.real, -turn.imag, 5.0], [turn.imag, turn.real, -9.0]])
    found = mapped(RING, moved(by, RING), 0.5)
    assert (found is not None) == is_found
    if found is not None:
        np.testing.assert_allclose(found[0], by, atol=1e-9)
        assert found[1].all()


def test_of_six_points_a_map_may_shear_and_of_five_it_may_not():
    sheared = np.array([[1.0, 0.1, 3.0], [0.0, 0.9, 2.0]])
    of_six, of_five = (mapped(RING[:count], moved(sheared, RING[:count]), 9.0) for count in (6, 5))
    np.testing.assert_allclose(of_six[0], sheared, atol=1e-9)
    (a, b, _), (c, d, _) = of_five[0]
    assert (a, b) == pytest.approx((d, -c))


def test_the_map_is_the_least_squares_of_all_that_are_near():
    for seed in range(60):
        now = moved(TURN, RING) + np.random.default_rng(seed).normal(0, 0.6, RING.shape)
        by, near = mapped(RING, now, 1.5)
        best = np.linalg.lstsq(np.column_stack([RING, np.ones(10)])[near], now[near])[0]
        np.testing.assert_allclose(by, best.T, atol=1e-9)


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


def test_one_light_is_followed_though_it_fell_to_half_its_height_and_another_guess_is_out_of_the_picture():
    light = np.full((200, 240), 20, np.uint8)
    light[50:52, 70:72] = 90
    found = shifted(light, [np.array([[240.0, 50.0]]), np.array([[60.0, 50.0]])], np.array([100.0]), 20.0, 2)
    np.testing.assert_allclose(found, [[70.5, 50.5]], atol=3)
