import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.drawing.annotated import WIDTH_PX, annotate, around_ring, caption, kept_pixels, montage
from dockpose.app.drawing.colours import MASK_COLOUR, ORANGE, bgr
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample
from dockpose.camera.port import FlatPort
from dockpose.estimate.geometry import in_picture
from dockpose.pose.known import KnownPose
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene

POSE = KnownPose((0.0, 0.05, 0.9), 25.0, -20.0)


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


def test_no_line_runs_through_a_light(scene):
    image, found, _ = scene
    drawn = annotate(image, found, layers=("ellipse", "a", "b"))
    for x, y in np.rint(found.markers.points_px).astype(int):
        light = np.s_[y - 2 : y + 3, x - 2 : x + 3]
        np.testing.assert_array_equal(drawn[light], np.repeat(image[light][..., None], 3, axis=2))
    assert (drawn != image[..., None]).any()


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


def cells(sheet, columns, rows, height):
    """The tiles of a sheet, row by row."""
    width = (WIDTH_PX - (columns + 1) * 8) // columns
    return [
        sheet[8 + row * (height + 8) :, 8 + column * (width + 8) :][:height, :width]
        for row in range(rows)
        for column in range(columns)
    ]


def shows_kept_pixels(tile, image, found, part):
    """Whether the brightest pixel of each light is orange in a tile that shows a part, and dark water is dimmer."""
    left, top, right, _ = part
    scale = tile.shape[1] / (right - left)
    for x, y in np.rint(found.markers.points_px).astype(int):
        column, row = (np.array([x - left, y - top]) + 0.5) * scale
        if np.abs(tile[int(row), int(column)].astype(int) - bgr(ORANGE)).max() > 60:
            return False
    dark = tile[int(0.5 * scale), int(0.5 * scale)].astype(int)
    return bool((dark <= 0.5 * image[top, left] + 1).all())


def test_there_is_a_tile_a_method_in_order(scene):
    image, hats, none = scene
    whole = (0, 0, 640, 480)
    sheet = montage(image, {"hats": hats, "none": none, "again": hats}, part=whole)
    assert sheet.dtype == np.uint8
    # Two columns of 788 pixels, their pictures 591 high, and strips of 4 lines of 21 with a margin of 8.
    height = 591 + 92
    assert sheet.shape == (2 * (height + 8) + 8, 1600, 3)
    first, second, third, fourth = cells(sheet, 2, 2, height)
    assert shows_kept_pixels(first[:591], image, hats, whole)
    np.testing.assert_array_equal(third[:591], first[:591])
    assert (second[:591] != first[:591]).any()
    assert (third[591:] != first[591:]).any()  # another name
    assert (fourth == 255).all()


def test_nine_tiles_make_three_columns_and_a_tall_picture_gets_margins():
    image = np.full((900, 100), 7, np.uint8)
    found = estimate(np.full((480, 640), 7, np.uint8), CAMERA, DOCK)
    sheet = montage(image, dict.fromkeys("abcdefghi", found))
    tile = cells(sheet, 3, 3, 626 + 92)[0]
    assert sheet.shape[0] == 3 * (626 + 92 + 8) + 8
    assert (tile[:626, 226:296] == 3).all()  # no pixel is kept, so that all are dim
    assert (tile[:626, :225] != 3).all()


def test_a_montage_of_nothing_is_refused(scene):
    with pytest.raises(ValueError, match="estimates is empty"):
        montage(scene[0], {})


def test_the_caption_says_counts_pose_and_error(scene):
    _, hats, none = scene
    words = [text for text, _ in caption("hats", hats, POSE)]
    assert hats.threshold is not None
    assert words[0] == f"hats: level {hats.threshold.level}, 10 groups, 10 on the ring"
    assert words[1].startswith("z 90.0 cm, theta x 2")
    assert words[2].startswith("Agrees with the truth: off by 0.")
    assert len(caption("hats", hats)) == 2
    turned = KnownPose(POSE.position_m, 25.0, 20.0)
    assert caption("hats", hats, turned)[2][0].startswith("Not the truth: off by 0.")
    failed = caption("fixed", none, POSE)
    assert failed[0][0] == "fixed: level 255, 0 groups, 0 on the ring"
    assert failed[1][0].startswith("No pose. No lights: ")
    assert len(failed) == 2


def test_a_mask_is_outlined_and_hatched():
    image = np.full((480, 640), 10, np.uint8)
    found = estimate(image, CAMERA, DOCK, Settings(masks=((300, 200, 100, 50), (900, 900, 5, 5))))
    drawn = annotate(image, found, words=False)
    assert (drawn[200:250, 300] == bgr(MASK_COLOUR)).all()
    assert (drawn[249, 300:400] == bgr(MASK_COLOUR)).all()
    inside = (drawn[201:249, 301:399] == bgr(MASK_COLOUR)).all(axis=2).mean()
    assert 0.05 < inside < 0.3
    assert (drawn[:200] == 10).all()
    assert (drawn[200:250, :300] == 10).all()
    assert (drawn[252:275, 290:400] != 10).any()  # the word


def test_a_part_around_the_ring_fills_the_tiles(scene):
    image, hats, none = scene
    part = around_ring(hats)
    assert part is not None
    left, top, right, bottom = part
    ring = hats.markers.points_px[hats.ring.on_ring]
    assert (ring > [left, top]).all()
    assert (ring < [right, bottom]).all()
    assert around_ring(none) is None
    sheet = montage(image, {"hats": hats}, part=part)
    # One column of 1584 pixels; the part is as wide as 4 to 3, so that its picture is 1188 high, give or take a pixel.
    height = round(1584 * (bottom - top) / (right - left))
    assert shows_kept_pixels(sheet[8 : 8 + height, 8 : 8 + 1584], image, hats, part)


def test_all_tiles_show_the_part_around_the_first_ring_that_was_found(scene):
    image, hats, none = scene
    found = {"none": none, "hats": hats}
    np.testing.assert_array_equal(montage(image, found), montage(image, found, part=around_ring(hats)))


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
