import numpy as np
import pytest
from dockpose.lights.conics import conics_through, polygons_on_ellipses

from tests.pipeline.lights.test_ring import CAMERA, FOCAL_PX, lights

MIDDLE = np.array([CAMERA.cx, CAMERA.cy])


def rings_in(points, count=None, tolerance_px=1.5):
    return polygons_on_ellipses(points - MIDDLE, np.arange(len(points)), count, FOCAL_PX, tolerance_px)


def test_the_conic_through_five_points_is_known_by_hand():
    # x^2 + 4 y^2 = 4, and x y = 1.
    ellipse = [(2, 0), (0, 1), (-2, 0), (0, -1), (2**0.5, 0.5**0.5)]
    hyperbola = [(1, 1), (2, 0.5), (-1, -1), (-4, -0.25), (0.5, 2)]
    places = np.dstack([np.array([ellipse, hyperbola]), np.ones((2, 5))])
    conics = conics_through(places)
    np.testing.assert_allclose(conics[0] / conics[0, 0], [1, 0, 4, 0, 0, -4], atol=1e-12)
    np.testing.assert_allclose(conics[1] / conics[1, 1], [0, 1, 0, 0, 0, -1], atol=1e-12)


@pytest.mark.parametrize("count", [9, 16, 24, 37, 48, 64])
@pytest.mark.parametrize("is_told", [True, False])
def test_the_number_of_lights_of_a_near_tilted_ring_is_found(count, is_told):
    # At 0.6 m the near side is larger by a fifth, which bends an even spacing by more than that of 64 lights.
    ours = lights(count, z_m=0.6, angles=(0.5, -0.4))
    (ring,) = rings_in(ours, count if is_told else None)
    assert sorted(ring.members) == list(range(count))
    assert ring.squares_px2 < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_strays_and_missing_lights_change_nothing(seed):
    rng = np.random.default_rng(seed)
    ours = lights(32, z_m=1.0, missing=(3, 17)) + rng.normal(0, 0.2, (30, 2))
    strays = rng.uniform([0, 0], [640, 480], (25, 2))
    strays = strays[np.linalg.norm(strays[:, None] - ours, axis=2).min(axis=1) > 8]
    rings = rings_in(np.vstack([ours, strays]))
    assert len(rings) == 1
    assert len(rings[0].corners) == 32
    assert set(rings[0].members) == set(range(30))


@pytest.mark.parametrize("times", [0.5, 1, 6])
def test_a_ring_built_by_hand_is_found_whole_at_every_size_of_the_picture(times):
    # Half a percent of the radius, which is a third of a pixel to four: pictures 320 to 3840 pixels wide.
    ours = (lights(24, z_m=0.8) - MIDDLE) * times
    radius_px = np.linalg.norm(ours - ours.mean(axis=0), axis=1).max()
    ours = ours + np.random.default_rng(2).normal(0, 0.005 * radius_px / np.sqrt(2), ours.shape)
    (ring,) = polygons_on_ellipses(ours, np.arange(24), None, times * FOCAL_PX, 1.5)
    assert sorted(ring.members) == list(range(24))


@pytest.mark.parametrize(("count", "times"), [(60, 3.0), (60, 1.33), (24, 0.5), (24, 2.5)])
def test_a_ring_of_another_camera_is_found_and_tells_its_focal_length(count, times):
    # Near and steep, where evenly spaced lights look uneven by more than the lights are apart.
    ours = lights(count, z_m=0.5, angles=(0.6, -0.5)) - MIDDLE
    (ring,) = polygons_on_ellipses(ours, np.arange(count), count, FOCAL_PX / times, 1.5)
    assert sorted(ring.members) == list(range(count))
    assert ring.focal_px == pytest.approx(FOCAL_PX, rel=0.1)  # the steps in which they are tried


@pytest.mark.parametrize("seed", range(5))
def test_points_anywhere_on_an_ellipse_are_no_ring_of_another_camera(seed):
    rng = np.random.default_rng(seed)
    anywhere = lights(3600, z_m=0.5, angles=(0.6, -0.5))[rng.choice(3600, 40, replace=False)]
    assert rings_in(anywhere, 40) == []
    assert rings_in(anywhere) == []


@pytest.mark.parametrize("count", [9, 20, 60, 150])
def test_points_strewn_at_random_are_no_ring(count):
    rng = np.random.default_rng(count)
    assert not any(rings_in(rng.uniform([0, 0], [640, 480], (count, 2))) for _ in range(20))
