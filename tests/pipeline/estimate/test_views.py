from itertools import chain

import cv2
import numpy as np
import pytest
from dockpose import Camera, Settings
from dockpose.estimate.flow import picture_in
from dockpose.estimate.views import faint_views, key_of, views

PLACES = np.array([[120, 100], [300, 90], [470, 160], [200, 330], [420, 360]])
CAMERA = Camera(640.0, 640.0, 319.5, 239.5, 640, 480)


def drawn(radius_px, height, noise=3.0, slope=0.0, seed=0):
    """Gaussian lights of one width at PLACES, on water that grows brighter to the right, with noise."""
    y, x = np.mgrid[:480, :640]
    light = sum(height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * radius_px**2)) for u, v in PLACES)
    noisy = 40 + slope * x + light + np.random.default_rng(seed).normal(0, noise, (480, 640))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def discs(*places_and_radii, shape=(480, 640)):
    """White discs (x, y, radius) on black."""
    picture = np.zeros(shape, np.uint8)
    for x, y, radius in places_and_radii:
        cv2.circle(picture, (x, y), radius, 200, -1)
    return picture


def all_views(image, before=None):
    tried = set() if before is None else {key_of(before)}
    return list(chain.from_iterable(views(picture_in(image, CAMERA, Settings()), Settings(), tried)))


def are_lights(points_px):
    apart = np.linalg.norm(points_px[:, None] - PLACES, axis=2)
    return len(points_px) == len(PLACES) and apart.min(axis=0).max() < 2


@pytest.mark.parametrize(("radius_px", "height"), [(1, 60), (3, 20), (6, 12), (12, 8)])
def test_lights_of_any_width_are_found_in_noise_that_hides_their_pixels(radius_px, height):
    assert any(are_lights(view.lights.points_px) for view in all_views(drawn(radius_px, height, noise=4.0)))


def test_lights_on_a_slope_that_is_brighter_than_they_are_are_found():
    assert any(are_lights(view.lights.points_px) for view in all_views(drawn(2, 25, slope=0.3)))


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_has_no_lights(seed):
    # Five standard deviations above a level eight above the water: none in a million pixels.
    assert all_views(drawn(1, 0, noise=8.0, seed=seed)) == []


def test_lights_that_only_others_make_sure_are_among_faint_peaks():
    # A blur of 1 px leaves four fifths of a Gaussian light of 2 px, and .28 of the noise: 6.8 deviations, less than 8.
    picture = picture_in(drawn(2, 4.8, noise=2.0), CAMERA, Settings())
    faint = [view.lights.points_px for view in faint_views(picture, Settings(), set())]
    off_px = [np.linalg.norm(points[:, None] - PLACES, axis=2) for points in faint]
    assert any(len(off) and (off.min(axis=0) < 3).all() for off in off_px)
    clear = [view.lights.points_px for view in all_views(picture.image)]
    assert not any(are_lights(points) for points in clear)


def test_lights_that_are_alike_are_looked_at_without_those_of_other_sizes():
    small = [(60 + 60 * k, 60, 2) for k in range(6)]
    large = [(60 + 90 * k, 300, 14) for k in range(6)]
    found = [
        sorted(view.lights.points_px[:, 1].round().astype(int).tolist()) for view in all_views(discs(*small, *large))
    ]
    assert found[0] == [60] * 6 + [300] * 6
    assert [60] * 6 in found
    assert [300] * 6 in found


def test_no_lights_are_looked_at_twice_nor_those_that_were_before():
    image = discs(*((60 + 60 * k, 60, 4) for k in range(6)))
    (only,) = {tuple(map(tuple, view.lights.points_px.round().tolist())) for view in all_views(image)}
    assert len(all_views(image)) == 1
    assert len(only) == 6
    assert all_views(image, all_views(image)[0].lights) == []


def test_three_lights_are_no_view():
    assert all_views(discs((100, 100, 5), (200, 100, 5), (300, 100, 5))) == []


def test_saturated_lamps_are_told_from_their_glow_in_the_darkest_channel():
    # Lamps are white; what they light up to their right is more than half as bright in grey, but green.
    image = np.zeros((480, 640, 3), np.uint8)
    for x, y in PLACES.tolist():
        cv2.rectangle(image, (x, y - 8), (x + 30, y + 8), (0, 255, 0), -1)
        cv2.circle(image, (x, y), 5, (255, 255, 255), -1)
    found = all_views(image)
    assert not any(are_lights(view.lights.points_px) for view in found if not view.picture.in_white)
    assert any(are_lights(view.lights.points_px) for view in found if view.picture.in_white)


def test_a_lamp_that_texture_breaks_up_is_one_light_in_a_blurred_picture():
    rng = np.random.default_rng(3)
    texture = rng.uniform(0.2, 1, (480, 640))
    image = (discs(*((x, y, 16) for x, y in PLACES)) * texture).astype(np.uint8)
    found = all_views(image)
    assert len(found[0].lights) > len(PLACES)
    assert any(are_lights(view.lights.points_px) for view in found if view.blur_px)


def test_what_is_masked_is_looked_at_in_no_channel_either():
    """A white spot under a mask, and a red one, which the darkest channel does not show, beside white lights."""
    image = cv2.merge([discs(*((x, y, 5) for x, y in PLACES))] * 3)
    cv2.circle(image, (560, 60), 12, (255, 255, 255), -1)
    cv2.circle(image, (560, 260), 12, (0, 0, 255), -1)
    settings = Settings(masks=((530, 30, 60, 60),))
    seen = list(chain.from_iterable(views(picture_in(image, CAMERA, settings), settings, set())))
    points = {
        is_white: [view.lights.points_px for view in seen if view.picture.in_white == is_white] for is_white in (0, 1)
    }
    assert all(len(each) for each in points.values())
    for each in chain(*points.values()):
        assert np.linalg.norm(each - [560, 60], axis=1).min() > 40
    assert any(np.linalg.norm(each - [560, 260], axis=1).min() < 1 for each in points[False])
    assert all(are_lights(each) for each in points[True])
