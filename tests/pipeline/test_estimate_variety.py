"""Rings under trouble of many kinds, drawn without the project's simulator: found, and refused where there is none."""

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock, estimate

from tests.bench.variety import KINDS, draw
from tests.support.judged import judged

SEEDS = range(4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_ring_is_found_whatever_befalls_the_picture(kind):
    for seed in SEEDS:
        drawn, told = draw(kind, seed, sizes=2)
        found = estimate(drawn.image, drawn.camera, Dock(drawn.dock.diameter, told))
        assert judged(found, drawn.position_m, drawn.normal).right, (seed, found.status, found.message)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_same_lamps_strewn_are_no_ring(kind):
    for seed in SEEDS:
        drawn, told = draw(kind, seed, ring=False, sizes=2)
        found = estimate(drawn.image, drawn.camera, Dock(drawn.dock.diameter, told))
        assert found.status != "ok", (seed, found.message)


def letters(text: str, scale: float, y: int) -> np.ndarray:
    image = np.random.default_rng(5).normal(20, 1.5, (480, 640)).clip(0, 255).astype(np.uint8)
    cv2.putText(image, text, (60, y), cv2.FONT_HERSHEY_SIMPLEX, scale, 230, 2, cv2.LINE_AA)
    return image


@pytest.mark.slow
@pytest.mark.parametrize("lights", [*range(4, 13), None])
def test_the_letters_of_a_clock_alone_are_no_dock(lights):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    texts = ("2026-11-20 15:24:59", "10:00:08", "CAM 07", "REC 00:01:37", "2024/03/18 09:08:05 IPC")
    for text in texts:
        for scale in (0.6, 0.9, 1.3):
            found = estimate(letters(text, scale, 60), camera, Dock(0.30, lights))
            assert found.status != "ok", (text, scale, found.message)


def test_of_lights_that_the_edge_cuts_the_rest_does_not_count():
    # The rest of a lamp's glow lies at the edge, four pixels inside of where its lamp is.
    drawn, told = draw("cut by the edge", 97)
    found = estimate(drawn.image, drawn.camera, Dock(drawn.dock.diameter, told))
    assert found.markers is not None
    assert found.ring is not None
    at_edge = (found.markers.boxes_px[:, 1] == 0) | (found.markers.boxes_px[:, 0] == 0)
    assert at_edge.any()
    assert not found.ring.on_ring[at_edge].any()
    assert judged(found, drawn.position_m, drawn.normal).right


def on_yellow(places_px: np.ndarray, level: int = 190, patch_px: int = 16) -> np.ndarray:
    """White lamps at (N, 2) before a patchwork of yellow and red, as bright to the eye as the lamps."""
    rng = np.random.default_rng(3)
    yellow = cv2.resize(
        rng.uniform(150, 255, (480 // patch_px, 640 // patch_px)), (640, 480), interpolation=cv2.INTER_NEAREST
    )
    image = np.dstack([np.zeros((480, 640)), yellow, yellow])
    for x, y in places_px.tolist():
        cv2.circle(image, (round(x * 16), round(y * 16)), 5 * 16, 3 * (level,), -1, cv2.LINE_AA, shift=4)
    return np.rint(image + rng.normal(0, 1.5, image.shape)).clip(0, 255).astype(np.uint8)


def test_white_lamps_before_a_colour_as_bright_are_found_in_the_darkest_channel():
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    turns = 2 * np.pi * np.arange(8) / 8
    ring = np.array([330.0, 230.0]) + 140 * np.column_stack([np.cos(turns), np.sin(turns)])
    found = estimate(on_yellow(ring), camera, Dock(0.30, 8))
    assert found.status == "ok", found.message
    assert "darkest of its colour channels" in found.message
    # A ring of 0.15 m that is seen with a radius of 140 px, square on.
    assert found.selected is not None
    assert np.linalg.norm(found.selected.position_m) == pytest.approx(0.15 * 700 / 140, rel=0.01)
    assert estimate(cv2.cvtColor(on_yellow(ring), cv2.COLOR_BGR2GRAY), camera, Dock(0.30, 8)).status != "ok"


@pytest.mark.parametrize("level", [200, 215, 230, 245])
def test_white_lamps_about_as_bright_as_the_brightest_colour_are_found_in_a_small_picture(level):
    turns = 2 * np.pi * np.arange(8) / 8
    ring = np.array([330.0, 230.0]) + 110 * np.column_stack([np.cos(turns), np.sin(turns)])
    small = cv2.resize(on_yellow(ring, level, patch_px=4), (320, 240), interpolation=cv2.INTER_AREA)
    found = estimate(small, Camera(350.0, 350.0, 159.5, 119.5, 320, 240), Dock(0.30, 8))
    assert found.status == "ok", found.message


@pytest.mark.parametrize("lights", [8, None])
def test_white_lamps_anywhere_before_a_colour_are_no_ring(lights):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    strewn = np.random.default_rng(4).uniform([40, 40], [600, 440], (8, 2))
    assert estimate(on_yellow(strewn), camera, Dock(0.30, lights)).status != "ok"


def shining(off_px: np.ndarray, half_px: float) -> np.ndarray:
    """A picture of what is white up to some distance (480, 640) from a line or middles, blurred, in noise."""
    light = 15 + 300 / (1 + np.exp(np.clip(2 * (off_px - half_px), -30, 30)))
    return (light + np.random.default_rng(6).normal(0, 2, off_px.shape)).clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("half_px", [0.5, 2])
@pytest.mark.parametrize("lights", [8, None])
def test_a_hoop_is_no_ring_of_lights(lights, half_px):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    y, x = np.mgrid[0:480, 0:640]
    found = estimate(shining(np.abs(np.hypot(x - 300, (y - 250) / 0.8) - 50), half_px), camera, Dock(0.30, lights))
    assert found.status != "ok", found.message


def lines_px(lights: int, begin_px: float, end_px: float) -> np.ndarray:
    """Distances (480, 640) in pixels from lines that point away from a middle."""
    y, x = np.mgrid[0:480, 0:640]
    along_off = []
    for turn in 2 * np.pi * np.arange(lights) / lights:
        along = np.cos(turn) * (x - 300) + np.sin(turn) * (y - 250)
        across = np.cos(turn) * (y - 250) - np.sin(turn) * (x - 300)
        along_off.append(np.hypot(along - along.clip(begin_px, end_px), across))
    return np.min(along_off, axis=0)


@pytest.mark.parametrize("half_px", [1, 3, 6])
@pytest.mark.parametrize(("lights", "begin_px", "end_px"), [(8, 0, 100), (10, 0, 150), (9, 0, 60)])
def test_ends_of_spokes_are_no_lights(lights, begin_px, end_px, half_px):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    found = estimate(shining(lines_px(lights, begin_px, end_px), half_px), camera, Dock(0.30, lights))
    assert found.status != "ok", found.message


@pytest.mark.parametrize(("begin_px", "end_px"), [(95, 105), (80, 120), (50, 150)])
@pytest.mark.parametrize("lights", [8, None])
def test_strips_that_point_to_the_middle_are_lights(lights, begin_px, end_px):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    found = estimate(shining(lines_px(8, begin_px, end_px), 3), camera, Dock(0.30, lights))
    assert found.status == "ok", found.message
    assert found.selected is not None
    # The middles are 100 px from the ring's, square on: a strip's place is its middle.
    assert np.linalg.norm(found.selected.position_m) == pytest.approx(0.15 * 700 / 100, rel=0.02)


@pytest.mark.parametrize("lights", [8, 12])
def test_lamps_at_the_edge_of_a_plate_as_bright_as_they_are_a_ring(lights):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    y, x = np.mgrid[0:480, 0:640]
    plate_px = np.hypot(x - 300, y - 250) - 95
    found = estimate(shining(np.minimum(lines_px(lights, 100, 100) - 8, plate_px), 0), camera, Dock(0.30, lights))
    assert found.status == "ok", found.message


def bars_px(lights: int) -> np.ndarray:
    """Distances (480, 640) in pixels from lines between the corners of a regular polygon, two and two."""
    y, x = np.mgrid[0:480, 0:640]
    turns = 2 * np.pi * np.arange(lights) / lights
    corners = [300, 250] + 100 * np.column_stack([np.cos(turns), np.sin(turns)])
    off_px = []
    for one, other in zip(corners[::2], corners[1::2], strict=True):
        long_px = np.linalg.norm(other - one)
        ahead = (other - one) / long_px
        along = (x - one[0]) * ahead[0] + (y - one[1]) * ahead[1]
        across = (y - one[1]) * ahead[0] - (x - one[0]) * ahead[1]
        off_px.append(np.hypot(along - along.clip(0, long_px), across))
    return np.min(off_px, axis=0)


@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("lights", [12, 16])
def test_ends_of_strips_along_a_ring_are_no_lights(lights, share):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    half_px = share * 200 * np.sin(np.pi / lights)  # a share of their length
    found = estimate(shining(bars_px(lights), half_px), camera, Dock(0.30, lights))
    assert found.status != "ok", found.message


@pytest.mark.parametrize("of_spacing", [0.8, 1.4])
@pytest.mark.parametrize("lights", [6, 12])
def test_lights_that_run_together_are_a_ring_all_the_same(lights, of_spacing):
    camera = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)
    y, x = np.mgrid[0:480, 0:640]
    turns = 2 * np.pi * np.arange(lights) / lights
    off_px = np.min([np.hypot(x - 300 - 100 * np.cos(t), y - 250 - 100 * np.sin(t)) for t in turns], axis=0)
    found = estimate(shining(off_px, of_spacing * 100 * np.sin(np.pi / lights)), camera, Dock(0.30, lights))
    assert found.status == "ok", found.message
    assert found.selected is not None
    # A ring of 0.15 m that is seen with a radius of 100 px, square on.
    assert np.linalg.norm(found.selected.position_m) == pytest.approx(0.15 * 700 / 100, rel=0.02)
