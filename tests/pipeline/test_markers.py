import numpy as np
import pytest

from pipeline import Camera, Dock
from pipeline.markers import find_markers
from pipeline.simulate import Scene, render
from pipeline.thresholds import fixed, histogram_of


def markers_at(image: np.ndarray, level: int, min_area_px: int = 1, centroid: str = "grey"):
    histogram = histogram_of(image)
    return find_markers(image, histogram.levels, fixed(histogram, level), min_area_px, centroid)


def test_two_groups_by_hand():
    image = np.zeros((12, 20), np.uint8)
    image[2:4, 3:6] = 100
    image[8, 10] = image[9, 11] = 100  # touch at a corner: one group
    markers = markers_at(image, 100)
    np.testing.assert_allclose(markers.points_px, [[4, 2.5], [10.5, 8.5]])
    assert markers.areas_px.tolist() == [6, 2]


def test_mass_moment_and_grey_weighted_centre_by_hand():
    image = np.zeros((5, 9), np.uint8)
    image[2, 3:6] = [100, 110, 130]
    (binary,) = markers_at(image, 100, centroid="binary").points_px
    (grey,) = markers_at(image, 100, centroid="grey").points_px
    assert binary == pytest.approx([4, 2])
    # Weights are 0.5, 10.5 and 30.5: how far each pixel stands above the threshold, plus a half.
    assert grey == pytest.approx([(0.5 * 3 + 10.5 * 4 + 30.5 * 5) / 41.5, 2])


def test_small_groups_are_dropped_and_counted():
    image = np.zeros((12, 20), np.uint8)
    image[2:4, 3:6] = 100
    image[8, 10] = 100
    markers = markers_at(image, 50, min_area_px=2)
    assert len(markers) == 1
    assert markers.dropped == 1


def test_nothing_above_the_level_gives_no_markers():
    markers = markers_at(np.zeros((6, 6), np.uint8), 1)
    assert len(markers) == 0
    assert markers.points_px.shape == (0, 2)


def test_everything_above_the_level_is_one_group():
    markers = markers_at(np.full((6, 8), 9, np.uint8), 0)
    np.testing.assert_allclose(markers.points_px, [[3.5, 2.5]])


def test_a_16_bit_picture_weighs_by_its_own_grey_values():
    image = np.zeros((5, 9), np.uint16)
    image[2, 3:5] = [40000, 50000]
    (grey,) = markers_at(image, 40000 >> 8).points_px
    native_level = (40000 >> 8) << 8
    weights = np.array([40000, 50000]) - native_level + 0.5
    assert grey == pytest.approx([(3 * weights[0] + 4 * weights[1]) / weights.sum(), 2])


@pytest.mark.parametrize("seed", range(8))
def test_the_centre_of_a_quiet_light_is_true_to_a_fiftieth_of_a_pixel(seed):
    # 0.02 px is what the project asks of an isolated, unsaturated light without noise, at any subpixel position.
    rng = np.random.default_rng(seed)
    scene = Scene(
        camera=Camera(700, 700, 319.5 + rng.uniform(), 239.5 + rng.uniform(), 640, 480),
        dock=Dock(0.3, 8),
        position_m=(0.0, 0.0, 1.2),
        light_level=200.0,
        noise_levels=0.0,
        background_level=5.0,
        attenuation_per_m=0.0,
        scattered_per_m=0.0,
    )
    image, truth = render(scene)
    assert image.max() < 255
    found = markers_at(image, 20).points_px
    assert len(found) == 8
    distances = np.linalg.norm(found[:, None] - truth.lights_px[None], axis=2).min(axis=1)
    assert distances.max() < 0.02
