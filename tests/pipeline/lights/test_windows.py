import numpy as np
from dockpose.lights.windows import spots_in_windows


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


def test_the_flank_of_a_brighter_light_is_no_spot():
    found = spots(drawn((40, 30, 60, 1.5), (52, 30, 200, 2.5)), (40, 30), far=7)
    np.testing.assert_allclose(found.points_px, [[40, 30]], atol=0.3)


def test_nothing_is_found_of_even_water_or_outside_the_picture():
    found = spots(drawn(), (40, 30), (-5, 10), (100, 10))
    assert np.isnan(found.heights).all()


def test_a_light_at_the_edge_is_cut():
    assert spots(drawn((1.0, 30, 150, 2.0)), (2, 30)).cut[0]
