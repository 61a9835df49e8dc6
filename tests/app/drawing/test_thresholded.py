import numpy as np
from dockpose.app.drawing.thresholded import counts, kept_pixels
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.detection import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample


def test_lights_are_kept_and_counted(view):
    found = analyse(view).estimate
    kept = kept_pixels(view.image, found)
    assert kept.shape == (480, 640)
    assert counts(found) == (10, 0, 0)
    assert found.markers is not None
    for x, y in found.markers.points_px:
        assert kept[round(y), round(x)]


def test_thrown_out_groups_are_counted_and_masks_keep_nothing(view):
    text = with_sample(view, "burnt_in_text")
    found = analyse(text).estimate
    on_ring, thrown_out, _ = counts(found)
    assert on_ring >= 5
    assert thrown_out > 0
    rows, columns = text.image.shape[:2]
    masked = with_mask(text, 0, 0, columns, rows / 2)
    assert not kept_pixels(text.image, analyse(masked).estimate)[: rows // 2].any()


def test_small_groups_are_counted(view):
    found = analyse(put(view, "min_area_px", 900)).estimate
    assert counts(found)[0] == 0


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


def test_16_bit_picture(view):
    deep = view.image.astype(np.uint16) * 256
    assert (kept_pixels(deep, analyse(view).estimate) == kept_pixels(view.image, analyse(view).estimate)).all()
