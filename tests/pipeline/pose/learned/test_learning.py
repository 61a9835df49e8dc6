import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.pose.learned.learning import LearningError, learn_dock

from tests.support.docks import CAMERA, dock_views, errors_m, nominal, uneven


def learn(true, views, camera=CAMERA, **how):
    return learn_dock(views, camera, nominal(true), **how)


# Single pictures are numbered alike by what is seen in the ring's plane.
@pytest.mark.parametrize(
    ("moved_m", "rolls"), [((3e-3, 0, 0), 0.05), ((0, 0, 3e-3), 0.05), ((3e-3, 0, 0), None), ((0, -3e-3, 0), None)]
)
def test_one_of_five_lights_that_is_off_its_place_is_learned_from_eight_exact_pictures(moved_m, rolls):
    true = Dock(0.30, 5, offsets_m=((0.0, 0.0, 0.0), moved_m, *[(0.0, 0.0, 0.0)] * 3))
    learned = learn(true, dock_views(true, 3, count=8, noise_px=0.0, rolls=rolls))
    assert np.abs(errors_m(learned, true)[0]).max() < 0.05e-3
    assert learned.views == 8
    assert learned.is_uneven
    assert learned.residual_px < 1e-3 < 0.1 < learned.nominal_px


def test_standard_errors_are_those_of_the_noise_of_the_pixels():
    ratios, sigmas_m = [], []
    for seed in range(4):
        true = uneven(seed, 6)
        once, twice = (learn(true, dock_views(true, seed, count=12, noise_px=noise_px)) for noise_px in (0.1, 0.2))
        assert once.residual_px == pytest.approx(0.1, rel=0.3)
        error, sigma = errors_m(once, true)
        ratios.append(((error / sigma) ** 2).mean())
        sigmas_m.append(np.median(twice.sigmas_m / once.sigmas_m))
    assert 0.4 < np.mean(ratios) < 1.8
    assert np.mean(sigmas_m) == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("badly", ["a light", "every other picture"])
def test_standard_errors_are_larger_where_what_is_seen_is_worse_than_its_median(badly):
    squares = []
    for seed in range(8):
        true, rng = uneven(seed, 8), np.random.default_rng(seed)
        views = dock_views(true, seed, count=40, noise_px=0.05)
        for number, view in enumerate(views):
            if badly == "a light":
                view.points_px[3] += rng.normal(0, 0.5, 2)
            elif number % 2:
                view.points_px[:] += rng.normal(0, 0.4, (8, 2))
        error, sigma = errors_m(learn(true, views), true)
        squares.append(((error / sigma) ** 2).mean())
    # Of 136 free numbers; by the median's noise alone it is 3.
    assert 0.6 < np.mean(squares) < 2.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lights", "focal_px", "noise_px", "rolls"),
    [
        (10, 700, 0.1, 0.05),
        (10, 700, 0.1, None),
        (6, 700, 0.1, 0.05),
        (16, 700, 0.1, None),
        (8, 1400, 0.2, None),
        (12, 400, 0.1, 0.05),
        (7, 700, 0.2, 0.05),
    ],
)
def test_lights_a_millimetre_off_are_found_to_a_fifth_of_it(lights, focal_px, noise_px, rolls):
    true, camera = uneven(lights, lights), Camera(focal_px, focal_px, 319.5, 239.5, 640, 480)
    learned = learn(true, dock_views(true, lights, noise_px=noise_px, camera=camera, rolls=rolls), camera)
    error, sigma = errors_m(learned, true)
    assert np.sqrt((error**2).mean()) < 0.2e-3
    assert np.median(np.abs(error)) < 0.1e-3
    # The standard errors are honest: for 3 N - 7 independent numbers their ratio is 1 within a fifth or so.
    assert 0.5 < np.sqrt(((error / sigma) ** 2).mean()) < 1.6
    assert learned.dock.lights_sigma_m == pytest.approx(np.linalg.norm(learned.sigmas_m) / math.sqrt(3 * lights))
    assert learned.is_uneven
    # The median of residuals of 420 lights or more is known to a few per cent.
    assert learned.residual_px == pytest.approx(noise_px, rel=0.15)
    assert learned.nominal_px > 2 * noise_px


def test_the_focal_length_is_found_with_them():
    true = uneven(1)
    views = dock_views(true, 1, camera=Camera(730, 730, 319.5, 239.5, 640, 480))
    learned = learn(true, views, fit_focal=True)
    assert learned.sigma_focal is not None
    assert abs(learned.camera.fx - 730) < 4 * 730 * learned.sigma_focal
    assert learned.sigma_focal < 0.01
    assert np.sqrt((errors_m(learned, true)[0] ** 2).mean()) < 0.2e-3


def test_lamps_behind_the_circle_are_learnt_where_they_are_and_the_depth_is_kept():
    true = msgspec.structs.replace(uneven(1), lamp_depth_m=0.02)
    learned = learn(true, dock_views(true, 1))
    assert learned.dock.lamp_depth_m == 0.02
    assert np.sqrt((errors_m(learned, true)[0] ** 2).mean()) < 0.2e-3


@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_a_light_off_in_depth_alone_is_learned_from_single_pictures(seed):
    """Where it is seen depends on the view: the numbering that agrees best in the ring's plane was a wrong one."""
    true = Dock(0.30, 6, offsets_m=((0.0, 0.0, 0.0), (0.0, 0.0, 3e-3), *[(0.0, 0.0, 0.0)] * 4))
    learned = learn(true, dock_views(true, seed, rolls=None, count=30))
    assert np.abs(errors_m(learned, true)[0]).max() < 0.3e-3
    assert learned.residual_px < 0.12
    assert learned.is_uneven


def test_no_even_dock_comes_out_uneven_by_how_its_single_pictures_were_numbered():
    even, refused = 0, 0
    for seed in range(4):
        for lights in (5, 6, 7):
            true = uneven(seed + 700, lights, off_m=0.0)
            try:
                even += not learn(true, dock_views(true, seed + 700, rolls=None, count=30)).is_uneven
            except LearningError:
                refused += 1
    assert even + refused == 12
    assert even > 0


def test_a_perfect_dock_is_found_to_be_even():
    true = uneven(3, off_m=0.0)
    learned = learn(true, dock_views(true, 3))
    assert not learned.is_uneven
    assert learned.roll_share < 0.2
    assert np.sqrt((errors_m(learned, true)[0] ** 2).mean()) < 0.1e-3


def test_wrong_lights_count_little():
    true = uneven(5)
    views = dock_views(true, 5)
    for number in range(0, 60, 2):  # a reflection in place of a light, 3 px off
        views[number].points_px[number % 10] += 3.0
    assert np.sqrt((errors_m(learn(true, views), true)[0] ** 2).mean()) < 0.2e-3


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"count": 6}, "6 of 6 views show 5 or more lights of the dock clearly, and 8 are needed"),
        ({"tilt_deg": 0.5, "aside": 0.002}, "how far lights stand off the dock's plane .* views are too alike"),
        ({"ranges_m": (14.0, 16.0), "noise_px": 0.3}, "can't tell"),
        ({"count": 30, "off_m": 0.0, "rolls": None}, "can't tell which light is which"),
    ],
)
def test_views_that_do_not_tell_are_refused(how, why):
    how = dict(how)
    true = uneven(6, off_m=how.pop("off_m", 1e-3))
    with pytest.raises(LearningError, match=why):
        learn(true, dock_views(true, 6, **how))


def test_the_dock_must_be_even_to_begin_with():
    with pytest.raises(LearningError, match="evenly spaced"):
        learn_dock([], CAMERA, Dock(0.30, angles_deg=(0, 80, 200)))
