from dataclasses import replace

import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.drawing.annotated import DRAWN, annotate, around_ring, kept_pixels
from dockpose.app.drawing.colours import MASK_COLOUR, bgr
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample
from dockpose.camera.port import FlatPort
from dockpose.estimate.geometry import in_picture, light_labels, on_ring
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, Estimate, Estimate]:
    image, _ = render(random_scene(2, theta_x_deg=25.0, theta_y_deg=-20.0, position_m=(0.0, 0.05, 0.9)))
    hats = estimate(image, CAMERA, DOCK)
    return image, hats, estimate(image, CAMERA, DOCK, Settings(method="fixed", level=255, min_area_px=1000))


def test_the_picture_is_full_size_colour_and_a_copy(scene):
    image, found, _ = scene
    before = image.copy()
    drawn = annotate(image, found)
    assert drawn.shape == (480, 640, 3)
    assert drawn.dtype == np.uint8
    np.testing.assert_array_equal(image, before)


def changed_near(image, drawn, point, reach=12):
    x, y = np.rint(point).astype(int)
    window = np.s_[y - reach : y + reach + 1, x - reach : x + reach + 1]
    return bool((drawn[window] != image[window][..., None]).any())


def test_lights_centres_and_normals_are_marked_where_they_are(scene):
    image, found, _ = scene
    drawn = annotate(image, found)
    for point in found.markers.points_px:
        assert changed_near(image, drawn, point)
    assert changed_near(image, drawn, found.ellipse.centre_px, reach=3)
    for pose in found.candidates:
        tip = CAMERA.project([pose.position_m + 1.3 * DOCK.radius * pose.normal])[0]
        assert changed_near(image, drawn, tip, reach=3)
    assert not changed_near(image, drawn, (600, 400))


@pytest.mark.parametrize("picture", ["grey", "bgr", "16 bit"])
def test_any_kind_of_picture_can_be_drawn_on(scene, picture):
    image, *_ = scene
    kinds = {"grey": image, "bgr": np.dstack([image] * 3), "16 bit": image.astype(np.uint16) << 8}
    found = estimate(kinds[picture], CAMERA, DOCK)
    assert annotate(kinds[picture], found).shape == (480, 640, 3)


def test_a_picture_without_a_dock_says_so_and_is_drawn():
    image = np.full((480, 640), 10, np.uint8)
    drawn = annotate(image, estimate(image, CAMERA, DOCK))
    assert (drawn[:60, :200] != 10).any()
    assert (drawn[200:] == 10).all()


def test_a_tiny_picture_is_no_fault():
    image = np.full((3, 4), 10, np.uint8)
    camera = CAMERA.for_size(4, 3)
    assert annotate(image, estimate(image, camera, Dock(0.3))).shape == (3, 4, 3)


def test_behind_a_port_the_ellipse_runs_through_the_lights():
    camera = Camera(500, 500, 319.5, 239.5, 640, 480, port=FlatPort(0.03, 0.01))
    image, truth = render(random_scene(2, camera=camera, position_m=(0.15, -0.08, 0.9), theta_x_deg=25.0))
    found = estimate(image, camera, DOCK)
    assert found.ellipse is not None
    outline = in_picture(found, found.ellipse.points(720))
    for light in truth.lights_px:
        assert np.linalg.norm(outline - light, axis=1).min() < 0.8  # a step of the outline is 1 px
    drawn = annotate(image, found)
    for point in outline[::60]:
        assert changed_near(image, drawn, point, reach=2)
    # The lens alone, which does not know how far away the dock is, would put it elsewhere.
    assert np.linalg.norm(camera.distort(found.ellipse.points(720)) - outline, axis=1).max() > 10


def test_a_mask_is_outlined_and_hatched():
    image = np.full((480, 640), 10, np.uint8)
    found = estimate(image, CAMERA, DOCK, Settings(masks=((300, 200, 100, 50), (900, 900, 5, 5))))
    drawn = annotate(image, found, layers=[layer for layer in DRAWN if layer != "text"])
    assert (drawn[200:250, 300] == bgr(MASK_COLOUR)).all()
    assert (drawn[249, 300:400] == bgr(MASK_COLOUR)).all()
    inside = (drawn[201:249, 301:399] == bgr(MASK_COLOUR)).all(axis=2).mean()
    assert 0.05 < inside < 0.3
    assert (drawn[:200] == 10).all()
    assert (drawn[200:250, :300] == 10).all()
    assert (drawn[252:275, 290:400] != 10).any()  # the word


def test_the_part_around_a_ring_holds_all_of_it(scene):
    _, hats, none = scene
    part = around_ring(hats, 1.6)
    assert part is not None
    left, top, right, bottom = part
    ring = hats.markers.points_px[hats.ring.on_ring]
    assert (ring > [left, top]).all()
    assert (ring < [right, bottom]).all()
    assert around_ring(none, 1.6) is None


def test_lights_are_kept(view):
    found = analyse(view).estimate
    kept = kept_pixels(view.image, found)
    assert kept.shape == (480, 640)
    assert found.markers is not None
    for x, y in found.markers.points_px:
        assert kept[round(y), round(x)]


def test_masks_keep_nothing(view):
    text = with_sample(view, "burnt_in_text")
    rows, columns = text.image.shape[:2]
    masked = with_mask(text, 0, 0, columns, rows / 2)
    assert not kept_pixels(text.image, analyse(masked).estimate)[: rows // 2].any()


def test_nothing_is_kept_above_every_pixel_and_all_at_level_0(view):
    nothing = analyse(put(with_method(view, "fixed", 255), "level", 255)).estimate
    everything = analyse(with_method(view, "fixed", 0)).estimate
    assert not kept_pixels(view.image, nothing).any()
    assert kept_pixels(view.image, everything).all()


def test_levels_of_their_own_keep_the_pixels_they_list(view):
    found = analyse(with_method(view, "hats_local", 0)).estimate
    assert found.threshold is not None
    assert found.threshold.kept is not None
    assert kept_pixels(view.image, found).sum() == len(found.threshold.kept[0].index)


def test_without_a_pose_no_patch_is_a_light_of_the_dock(found):
    assert on_ring(found).sum() == len(light_labels(found)) == 10
    none = replace(found, choice=None)
    assert (on_ring(none).tolist(), light_labels(none)) == ([False] * len(found.markers), [])
