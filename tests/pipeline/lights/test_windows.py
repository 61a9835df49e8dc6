import numpy as np
import pytest
from dockpose.lights.windows import spots_in_windows
from skimage.measure import label


def drawn(*lights):
    y, x = np.mgrid[:60, :80]
    picture = np.full((60, 80), 20.0)
    for u, v, height, sigma in lights:
        picture += height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * sigma**2))
    return np.rint(picture).astype(np.uint8)


def spots(picture, *points, far=6, reach=9):
    far, reach = (np.full(len(points), value) for value in (far, reach))
    return spots_in_windows(picture, np.array(points, dtype=float), far, reach)


def test_a_light_is_found_beside_its_expected_place_with_its_height():
    found = spots(drawn((40.3, 29.6, 150, 2.0)), (43, 31))
    np.testing.assert_allclose(found.points_px, [[40.3, 29.6]], atol=0.1)
    np.testing.assert_allclose(found.heights, 145, atol=3)  # the nearest pixel is 0.5 off: 150 exp(-0.5 0.25 / 4)
    # What is above half of a Gaussian's height reaches to 1.18 of its widths.
    assert found.boxes_px[0].tolist() == [38, 28, 42, 31]
    assert not found.cut[0]


def test_nothing_is_found_of_even_water_or_outside_the_picture():
    found = spots(drawn(), (40, 30), (-5, 10), (100, 10))
    assert np.isnan(found.heights).all()


def by_labels(picture, point, far, reach):
    """What is above half of the highest peak's height around it, by scikit-image's labels."""
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    near = (np.rint(point[0]) - x) ** 2 + (np.rint(point[1]) - y) ** 2 <= far**2
    row, column = np.unravel_index(np.argmax(np.where(near, picture, -1.0)), picture.shape)
    top, left = max(0, row - reach), max(0, column - reach)
    window = picture[top : row + reach + 1, left : column + reach + 1].astype(float)
    water = np.median(np.concatenate([window[0], window[-1], window[:, 0], window[:, -1]]))
    half = (water + picture[row, column]) / 2
    labels = np.asarray(label(window > half, connectivity=2))
    rows, columns = np.nonzero(labels == labels[row - top, column - left])
    weights = window[rows, columns] - half
    centre = [np.average(columns, weights=weights) + left, np.average(rows, weights=weights) + top]
    box = [columns.min() + left, rows.min() + top, columns.max() + left, rows.max() + top]
    steps = np.abs(np.diff(window[[0, -1]], axis=1))
    noise = np.sqrt(np.pi) / 2 * steps.mean()
    return centre, weights.sum() / (picture[row, column] - half), picture[row, column] - water, box, noise


@pytest.mark.parametrize("seed", range(4))
def test_spots_are_those_of_labels_also_at_the_pictures_edges(seed):
    rng = np.random.default_rng(seed)
    lights = [
        (2.2, 30.4, 150, 1.8),
        (40.3, 3.6, 120, 2.2),
        (76.6, 29.2, 170, 2.0),
        (20.4, 56.3, 140, 2.4),
        (41.2, 31, 90, 3),
    ]
    picture = np.clip(drawn(*lights) + rng.integers(0, 5, (60, 80)), 0, 255).astype(np.uint8)
    points = [(x + rng.uniform(-3, 3), y + rng.uniform(-2, 2)) for x, y, *_ in lights]
    points = np.clip(points, 0, [79, 59])
    found = spots(picture, *points)
    for k, point in enumerate(points):
        centre, span, height, box, noise = by_labels(picture, point, 6, 9)
        np.testing.assert_allclose(found.points_px[k], centre, atol=1e-9)
        assert found.spans_px[k] == pytest.approx(span)
        assert found.heights[k] == pytest.approx(height)
        assert found.boxes_px[k].tolist() == box
        assert found.noises[k] == pytest.approx(noise, rel=1e-3)
        assert found.cut[k] == (box[0] == 0 or box[1] == 0 or box[2] == 79 or box[3] == 59)


def test_a_pixel_counts_as_far_as_its_middle_is_within_reach_and_points_as_far_as_the_pictures_edge():
    picture = np.zeros((20, 20), np.uint8)
    picture[10, 16] = 200
    assert spots(picture, (10, 10), far=6, reach=3).peaks[0] == 200
    assert np.isnan(spots(picture, (10, 10), far=5, reach=3).peaks[0])
    assert np.isnan(spots(picture, (10, 11), far=6, reach=3).peaks[0])  # a corner of the square, not of the circle
    corner = np.zeros((20, 20), np.uint8)
    corner[0, 0] = corner[19, 19] = 200
    found = spots(corner, (-0.5, -0.5), (19.4, 19.4), (-0.6, 0), (19.5, 19), far=2, reach=3)
    assert found.peaks[:2].tolist() == [200, 200]
    assert np.isnan(found.peaks[2:]).all()
    np.testing.assert_array_equal(found.points_px[:2], [[0, 0], [19, 19]])


def test_what_another_look_shows_takes_the_place_of_chosen_lights():
    one, other = (
        spots(drawn((40, 30, 60, 1.5)), (40, 30), (20, 20)),
        spots(drawn((20, 20, 90, 1.5)), (40, 30), (20, 20)),
    )
    both = one.chosen(np.array([False, True]), other)
    np.testing.assert_array_equal(both.peaks, [80, 110])
    np.testing.assert_allclose(both.points_px, [[40, 30], [20, 20]])


def test_a_light_dimmer_than_the_flank_of_another_is_found_and_not_the_flank():
    # Where the window ends, three widths and a half from the other, that one still has 97 levels: more than this light.
    for u, v in ((52.0, 30.0), (28.0, 30.0), (40.0, 42.0), (40.0, 18.0)):
        found = spots(drawn((40, 30, 60, 1.5), (u, v, 200, 4.0)), (40, 30), far=7)
        np.testing.assert_allclose(found.peaks, 80, atol=4)
