import numpy as np
import pytest
from dockpose.pose.strokes import _as_bright_between, _beside, _goes_on_somewhere, _light_at

EVEN = np.full(8, 0.5)


def test_light_is_read_between_pixels_and_beyond_the_edge_as_at_it():
    light = np.array([[0, 10, 20], [40, 50, 60]], np.uint8)
    places = np.array([[[1.0, 0.0], [0.5, 0.5]], [[-7.0, 0.0], [5.0, 1.0]]])
    np.testing.assert_allclose(_light_at(light, places), [[10, 25], [0, 60]])


def pairs(between, count=8):
    """Lights of 100 at both ends of each pair, and so much in the middle."""
    return np.column_stack([np.full(count, 100.0), np.broadcast_to(between, count), np.full(count, 100.0)])


def test_what_is_as_bright_between_most_lights_is_a_hoop():
    assert _as_bright_between(pairs(96), EVEN)
    assert not _as_bright_between(pairs(94), EVEN)
    assert _as_bright_between(pairs([20, 20, 20, 99, 99, 99, 99, 99]), EVEN)
    # Brighter on one side: the middle is held against the mean of both.
    slope = np.column_stack([np.full(8, 60.0), np.full(8, 97.0), np.full(8, 140.0)])
    assert _as_bright_between(slope, EVEN)


def test_every_second_gap_that_is_nearly_as_bright_is_a_strip():
    assert _as_bright_between(pairs([85, 10] * 4), EVEN)
    assert _as_bright_between(pairs([10, 85] * 4), EVEN)
    assert not _as_bright_between(pairs([75, 10] * 4), EVEN)  # darker than a strip
    assert not _as_bright_between(pairs([90, 82] * 4), EVEN)  # gaps that are nearly as bright
    assert not _as_bright_between(pairs([85, 10] * 3, 6), EVEN[:6])  # six may do so by chance
    assert not _as_bright_between(pairs([85, 10] * 4 + [85], 9), np.full(9, 0.5))
    assert not _as_bright_between(pairs([85, 10] * 4), np.tile([0.2, 0.5], 4))  # lamps in pairs


def test_light_before_and_after_is_told_by_its_median_share():
    lights = np.array([[10.0, 100, 90], [50, 100, 80], [20, 50, 50]])
    assert _beside(lights) == pytest.approx((0.4, 0.9))


def test_places_go_on_where_most_are_as_bright_in_some_direction():
    y, x = np.mgrid[:80, :160]
    middles = np.array([[30.0, 40.0], [80.0, 40.0], [130.0, 40.0]])
    lamps = np.min([np.hypot(x - u, y - v) for u, v in middles], axis=0) <= 4
    assert not _goes_on_somewhere((200 * lamps + 20).astype(np.uint8), middles, 4.0)
    # A line through all of them, though not wider than they are.
    assert _goes_on_somewhere((200 * (np.abs(y - 40) <= 4) + 20).astype(np.uint8), middles, 4.0)
    # One of three on a line is not most.
    one = lamps | ((np.abs(y - 40) <= 4) & (x > 105))
    assert not _goes_on_somewhere((200 * one + 20).astype(np.uint8), middles, 4.0)
