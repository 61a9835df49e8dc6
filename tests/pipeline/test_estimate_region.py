# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false

import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.lights.region import part_of, threshold_in_whole
from dockpose.simulate import render
from dockpose.thresholds import hats_local, histogram_of
from dockpose.tracking.search import ring_region

from tests.support.scenes import CAMERA, DOCK, random_scene


def around(found, margin_px=60):
    """Whole pixels around the ring's lights."""
    boxes = found.markers.boxes_px[found.ring.on_ring]
    left, top = (np.maximum(boxes[:, :2].min(axis=0) - margin_px, 0) // 2 * 2).tolist()
    right, bottom = np.minimum(boxes[:, 2:].max(axis=0) + margin_px + 1, [640, 480]).tolist()
    return left, top, right - left, bottom - top


def all_but(region):
    """Masks over the rest of the picture."""
    x, y, width, height = region
    right, bottom = x + width, y + height
    masks = ((0, 0, 640, y), (0, bottom, 640, 480 - bottom), (0, y, x, height), (right, y, 640 - right, height))
    return tuple(mask for mask in masks if mask[2] > 0 and mask[3] > 0)


@pytest.mark.parametrize("seed", range(8))
def test_a_region_is_a_mask_over_all_the_rest(seed):
    image, _ = render(random_scene(seed))
    region = around(estimate(image, CAMERA, DOCK))
    part = estimate(image, CAMERA, DOCK, region=region)
    masked = estimate(image, CAMERA, DOCK, Settings(masks=all_but(region)))
    assert part.threshold.level == masked.threshold.level
    np.testing.assert_array_equal(part.markers.boxes_px, masked.markers.boxes_px)
    np.testing.assert_allclose(part.markers.points_px, masked.markers.points_px, atol=1e-9)
    np.testing.assert_allclose(part.selected.position_m, masked.selected.position_m, atol=1e-9)
    assert (part.width, part.height) == (640, 480)


@pytest.mark.parametrize("kind", ["grey", "bgr", "16 bit"])
def test_every_kind_of_picture_has_regions(kind):
    image, _ = render(random_scene(2))
    region = around(estimate(image, CAMERA, DOCK))
    picture = {"grey": image, "bgr": np.repeat(image[:, :, None], 3, axis=2), "16 bit": image.astype(np.uint16) << 8}
    part, whole = estimate(picture[kind], CAMERA, DOCK, region=region), estimate(picture[kind], CAMERA, DOCK)
    np.testing.assert_allclose(part.selected.position_m, whole.selected.position_m, atol=1e-3)


def test_what_lies_outside_is_not_seen():
    image, _ = render(random_scene(2))
    x, y, width, height = around(estimate(image, CAMERA, DOCK))
    outside = np.full_like(image, 255)
    outside[y : y + height, x : x + width] = image[y : y + height, x : x + width]
    first = estimate(image, CAMERA, DOCK, region=(x, y, width, height)).to_dict()
    second = estimate(outside, CAMERA, DOCK, region=(x, y, width, height)).to_dict()
    assert first | {"elapsed_ms": 0} == second | {"elapsed_ms": 0}


def test_masks_keep_their_place_in_a_region():
    image, _ = render(random_scene(2))
    whole = estimate(image, CAMERA, DOCK)
    left, top, right, bottom = whole.markers.boxes_px[0].tolist()
    mask = (left - 12, top - 12, right - left + 24, bottom - top + 24)
    part = estimate(image, CAMERA, DOCK, Settings(masks=(mask,)), region=around(whole))
    assert len(part.markers) == len(whole.markers) - 1


def test_pixels_that_a_threshold_lists_are_those_of_the_whole_picture():
    image, _ = render(random_scene(3))
    part = part_of((100, 50, 440, 380), 640, 480)
    cut = np.ascontiguousarray(image[part[1] : part[3], part[0] : part[2]])
    found = hats_local(histogram_of(cut), min_area_px=2)
    pixels, lights = threshold_in_whole(found, part, 640).kept
    rows, columns = np.divmod(pixels.index, 640)
    assert pixels.width == 640
    np.testing.assert_array_equal(image[rows, columns], pixels.level)
    np.testing.assert_array_equal(lights, found.kept[1])


@pytest.mark.parametrize(
    ("region", "part"),
    [
        (None, (0, 0, 640, 480)),
        ((10, 20, 30, 40), (10, 20, 40, 60)),
        ((-10, -20, 30, 40), (0, 0, 20, 20)),
        ((600, 470, 100, 100), (600, 470, 640, 480)),
        ((9.5, 20.0, 1.0, 0.5), (10, 20, 11, 21)),  # pixel centres within
        ((11, 21, 5, 5), (10, 20, 16, 26)),  # even, so that half pixels are rounded as in the whole picture
    ],
)
def test_a_region_is_clipped_to_the_picture(region, part):
    assert part_of(region, 640, 480) == part


@pytest.mark.parametrize(
    ("region", "words"),
    [
        ((700, 10, 20, 20), r"region is \(700, 10, 20, 20\); it holds no pixel"),
        ((10, 10, 0, 20), "region width_px is 0"),
        ((10, 10, 20, float("nan")), "region height_px is nan"),
        ((float("inf"), 10, 20, 20), "region x_px is inf"),
        ((10, 10, 20), "four numbers"),
    ],
)
def test_a_wrong_region_is_named(region, words):
    with pytest.raises(ValueError, match=words):
        estimate(np.zeros((480, 640), np.uint8), CAMERA, DOCK, region=region)


def test_the_region_of_a_ring_holds_its_lights():
    image, truth = render(random_scene(5))
    found = estimate(image, CAMERA, DOCK)
    x, y, width, height = ring_region(found.selected, CAMERA, DOCK)
    assert (truth.lights_px >= [x - 2, y - 2]).all()
    assert (truth.lights_px <= [x + width + 2, y + height + 2]).all()


@pytest.mark.parametrize("name", ["max_speed_m_per_s", "max_turn_deg_per_s", "lost_after_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_bounds_of_motion_are_positive(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value!r}"):
        Settings(**{name: value})
