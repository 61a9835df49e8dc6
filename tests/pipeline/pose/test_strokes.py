import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.circle import CirclePose
from dockpose.pose.strokes import _as_bright_between, _beside, _goes_on_somewhere, _light_at, reason_not_lamps

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


# What is drawn at and between ten places on a circle of 70 px that is seen square on, in light of 220 on 20.
CAMERA, DOCK = Camera(280.0, 280.0, 160.0, 120.0, 321, 241), Dock(0.30, 10)
AT = 2 * np.pi * np.arange(10) / 10 + 0.1
OUT = np.column_stack([np.cos(AT), np.sin(AT)])
PLACES, LAMP_PX = 70 * OUT + [160, 120], 5


# From where to where along the radius something is drawn at each place, in pixels.
LINES = {"spokes": (-70, 0), "wheel": (-70, 30), "strips": (-30, 30), "bars": (-16, 16), "long lamps": (-8, 8)}


def painted(kind):
    image = np.full((241, 321), 20, np.uint8)
    if kind == "hoop":
        cv2.circle(image, (160, 120), 70, 220, 2 * LAMP_PX, cv2.LINE_AA)
    if kind == "plate":  # lit up to the lamps, as bright as they are
        cv2.circle(image, (160, 120), 68, 220, -1, cv2.LINE_AA)
    if kind == "thin hoop with lamps":
        cv2.circle(image, (160, 120), 70, 220, 3, cv2.LINE_AA)
    for place, out in zip(PLACES, OUT, strict=True):
        ends = LINES.get(kind, (0, 0))
        one, other = (tuple(np.rint(place + end * out).astype(int).tolist()) for end in ends)
        cv2.line(image, one, other, 220, 2 * LAMP_PX, cv2.LINE_AA)
    return cv2.GaussianBlur(image, (0, 0), 1)


@pytest.mark.parametrize(
    ("kind", "rms_px", "words"),
    [
        ("lamps", 0.1, None),
        ("lamps", 9.0, None),
        ("long lamps", 9.0, None),
        ("thin hoop with lamps", 9.0, None),
        ("plate", 0.1, None),
        ("hoop", 0.1, "a hoop or strips, not lights"),
        ("spokes", 0.1, "the ends of lines, not lights"),
        ("wheel", 0.1, "spokes, not lights"),
        ("strips", 0.1, None),  # they end before half way to the middle
        ("bars", 1.6, "parts of lines, not lights"),
        ("bars", 1.2, None),  # in their places, to a fiftieth of the radius, where parts of lines are by chance alone
    ],
)
def test_lamps_are_told_from_hoops_spokes_and_bars(kind, rms_px, words):
    pose = CirclePose(np.array([0.0, 0.0, 0.6]), np.array([0.0, 0.0, -1.0]), np.array([160.0, 120.0]), rms_px=rms_px)
    markers = Markers(PLACES, np.full(10, round(np.pi * LAMP_PX**2)), np.full(10, 220))
    reason = reason_not_lamps(painted(kind), (0, 0), Ring(np.ones(10, dtype=bool), ""), markers, pose, CAMERA, DOCK)
    assert reason is None if words is None else words in str(reason)
