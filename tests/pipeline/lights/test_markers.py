import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.lights.markers import find_markers, grey_centres
from dockpose.thresholds import fixed, histogram_of

from tests.pipeline.lights.test_likelihood import centres_of


def markers_at(image: np.ndarray, level: int, min_area_px: int = 1, centroid: str = "grey"):
    histogram = histogram_of(image)
    return find_markers(image, histogram, fixed(histogram, level), min_area_px, centroid)


def test_two_groups_by_hand():
    image = np.zeros((12, 20), np.uint8)
    image[2:4, 3:6] = 100
    image[8, 10] = image[9, 11] = 100  # touch at a corner: one group
    markers = markers_at(image, 100)
    np.testing.assert_allclose(markers.points_px, [[4, 2.5], [10.5, 8.5]])
    assert markers.areas_px.tolist() == [6, 2]
    larger = markers_at(image, 100, min_area_px=3)
    assert (larger.areas_px.tolist(), larger.dropped) == ([6], 1)


def test_mass_moment_and_grey_weighted_centre_by_hand():
    image = np.full((15, 19), 10, np.uint8)
    image[7, 8:11] = [60, 110, 90]
    image[7, 12] = 25  # outside the group, and less than a fifth of the light's height above the water
    (binary,) = markers_at(image, 60, centroid="binary").points_px
    (grey,) = markers_at(image, 60, centroid="grey").points_px
    assert binary == pytest.approx([9, 7])
    # The water is 10, the foot a fifth of 100 above it: weights 30, 80 and 60.
    assert grey == pytest.approx([(30 * 8 + 80 * 9 + 60 * 10) / 170, 7])


def test_light_below_the_threshold_weighs_but_a_neighbours_does_not():
    image = np.full((21, 40), 10, np.uint8)
    image[10, 10:13] = [50, 110, 50]
    image[10, 15:18] = [50, 110, 50]
    for level in (100, 45):  # the groups are one pixel, or three
        points = markers_at(image, level).points_px
        np.testing.assert_allclose(points, [[11, 10], [16, 10]], atol=1e-9)


def test_a_saturated_light_is_centred_by_its_flanks():
    # A Gaussian of height 1000 at (20.3, 15.6), clipped at 255.
    y, x = np.mgrid[:32, :40]
    light = 1000 * np.exp(-((x - 20.3) ** 2 + (y - 15.6) ** 2) / (2 * 1.8**2))
    image = np.clip(np.rint(light + 8), 0, 255).astype(np.uint8)
    (grey,) = markers_at(image, 255).points_px
    assert grey == pytest.approx([20.3, 15.6], abs=0.02)


@pytest.mark.parametrize("corner", [(0, 0), (0, 18), (14, 0), (14, 18)])
def test_a_light_at_the_edge_of_the_picture_is_no_fault(corner):
    image = np.full((15, 19), 10, np.uint8)
    image[corner] = 200
    np.testing.assert_allclose(markers_at(image, 100).points_px, [corner[::-1]])


def test_nothing_above_the_level_gives_no_markers_and_everything_one():
    assert markers_at(np.zeros((6, 6), np.uint8), 1).points_px.shape == (0, 2)
    np.testing.assert_allclose(markers_at(np.full((6, 8), 9, np.uint8), 0).points_px, [[3.5, 2.5]])


def test_a_16_bit_picture_weighs_by_its_own_grey_values():
    image = np.full((15, 19), 1000, np.uint16)
    image[7:9, 8:10] = [40000, 50000]  # two pixels alone would be taken for hot ones
    (grey,) = markers_at(image, 40000 >> 8).points_px
    weights = np.array([40000, 50000]) - (1000 + 0.2 * 49000)
    assert grey == pytest.approx([(8 * weights[0] + 9 * weights[1]) / weights.sum(), 7.5])


def test_two_lights_that_run_together_are_split():
    y, x = np.mgrid[:60, :200]
    image = np.full((60, 200), 10.0)
    for centre in ((30, 30), (60, 30), (90, 30), (120, 30), (127, 30)):
        image += 200 * np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / (2 * 2.0**2))
    image = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    level = 40
    assert histogram_of(image).bright(level).groups()[0] == 4
    markers = markers_at(image, level, min_area_px=2)
    assert len(markers) == 5
    distance = np.abs(markers.points_px[:, 0][:, None] - [30, 60, 90, 120, 127]).min(axis=0)
    assert distance.max() < 0.5


def test_more_than_400_groups_leave_the_largest():
    image = np.zeros((300, 300), np.uint8)
    image[::6, ::6] = 200
    image[100:104, 100:104] = 200
    markers = markers_at(image, 100)
    assert len(markers) == 400
    assert 16 in markers.areas_px


def saturated_discs(centres: list[tuple[float, float]], radius: float) -> np.ndarray:
    y, x = np.mgrid[:160, :240]
    apart = np.min([np.hypot(x - cx, y - cy) for cx, cy in centres], axis=0)
    return (20 + 235 * np.clip(radius + 0.5 - apart, 0, 1)).astype(np.uint8)


def test_saturated_lights_that_touch_are_parted_and_centred_by_their_outlines():
    centres = [(50.3, 60.2), (84.1, 72.6), (118.4, 80.3), (190.2, 90.7)]
    markers = markers_at(saturated_discs(centres, 20.0), 128)
    assert len(markers) == 4
    apart = np.linalg.norm(markers.points_px[:, None] - np.array(centres)[None], axis=2).min(axis=0)
    assert apart.max() < 0.3


def test_a_saturated_light_that_the_edge_cuts_is_centred_by_what_is_left_of_its_outline():
    centres = [(10.4, 70.3), (150.2, 80.6)]
    markers = markers_at(saturated_discs(centres, 20.0), 128)
    np.testing.assert_allclose(markers.points_px, centres, atol=0.3)
    assert not markers.cut.any()


def test_what_the_edge_cuts_is_known_only_by_an_outline():
    image = saturated_discs([(150.2, 80.6)], 20.0)
    image[60:100, :20] = 255  # a bar's outline is no ellipse's
    image[2:6, 60:64] = image[:4, 120:124] = 200  # lamps of four pixels, of which one touches the edge
    markers = markers_at(image, 128)
    touches = (markers.boxes_px[:, :2] == 0).any(axis=1)
    assert markers.cut.tolist() == touches.tolist()
    assert touches.sum() == 2


def test_large_lamps_that_the_edge_cuts_are_lights_of_a_ring():
    camera, dock = Camera(800.0, 800.0, 119.5, 79.5, 240, 160), Dock(0.4, 8)
    around = np.radians(3 + 45 * np.arange(8))
    image = saturated_discs((np.column_stack([np.cos(around), np.sin(around)]) * 80 + [119.5, 79.5]).tolist(), 18.0)
    found = estimate(image, camera, dock)
    assert found.lights_on_ring == 8  # of which the edges cut two
    assert found.selected.position_m[2] == pytest.approx(800 * 0.2 / 80, rel=0.01)


def test_a_large_light_is_one():
    assert len(markers_at(saturated_discs([(120.0, 80.0)], 60.0), 128)) == 1


@pytest.mark.parametrize("size", [1, 4])
def test_peaks_are_the_brightest_levels(size):
    image = np.zeros((40, 60), np.uint8)
    image[10 : 10 + size, 10 : 10 + size] = 90
    image[10, 10] = 140
    image[20 : 20 + size, 30 : 30 + size] = 200
    assert markers_at(image, 80).peaks.tolist() == [140, 200]


@pytest.mark.parametrize(("step", "depth"), [(1, np.uint8), (16, np.uint16), (256, np.uint16)])
def test_a_lamp_that_is_brighter_on_one_side_is_centred_by_its_outline_at_every_depth(step, depth):
    # By its light a lamp of radius r whose level rises by g of it a pixel would be off by g r^2 / 4, here 0.32 pixels.
    y, x = np.mgrid[:81, :81].astype(float)
    lamp = 120 * (1 + 0.01 * (x - 40.3)) / (1 + np.exp(3 * (np.hypot(x - 40.3, y - 39.8) - 11.3)))
    grey = np.rint(step * (20 + lamp)).astype(depth)
    found, _ = centres_of(grey, np.array([[40.0, 40.0]]), np.array([25]), 250.0 * step, np.array([40.0, 40.0]), 57.0)
    np.testing.assert_allclose(found, [[40.3, 39.8]], atol=0.02)


def test_a_lamp_that_is_dark_inside_is_centred_by_its_rim():
    y, x = np.mgrid[:81, :81].astype(float)
    rim = 120 * np.exp(-((np.hypot(x - 40.3, y - 39.8) - 12.0) ** 2) / 2)
    found = grey_centres(np.rint(20 + rim).astype(np.uint8), np.array([[26, 26, 54, 54]]), np.array([[52.0, 40.0]]))
    np.testing.assert_allclose(found, [[40.3, 39.8]], atol=0.5)


@pytest.mark.parametrize("slope", [0.2, 1.0, 2.0])
def test_halos_that_rise_steeply_are_taken_off(slope):
    # Across the window of 24 pixels the water rises by up to 48 of the lamp's 160 levels: a pull of 0.5 pixels.
    y, x = np.mgrid[:61, :61].astype(float)
    lamp = 160 * np.exp(-((x - 30.3) ** 2 + (y - 29.8) ** 2) / (2 * 2.5**2))
    grey = np.rint(256 * (90 + slope * (x - 30) + lamp)).clip(0, 65535).astype(np.uint16)
    found = grey_centres(grey, np.array([[25, 25, 35, 35]]), np.array([[30.0, 30.0]]))
    np.testing.assert_allclose(found, [[30.3, 29.8]], atol=0.02)
