# pyright: reportArgumentType=false

import math

import msgspec
import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.lights.markers import Markers
from dockpose.lights.masks import LEAST_FRAMES, StillGroups, _union, hidden_pixels, hide
from dockpose.lights.motion import Paths
from dockpose.simulate import render
from dockpose.simulate.parts import Text
from dockpose.thresholds import METHODS, histogram_of

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.mark.parametrize(
    ("mask", "hidden"),
    [
        ((1, 0, 2, 1), ["·##·", "····", "····"]),
        ((0.5, 0.5, 2, 5), ["····", "·##·", "·##·"]),
        ((-3, -3, 5, 4), ["##··", "····", "····"]),
        ((3, 2, 1e9, 1e9), ["····", "····", "···#"]),
        ((4, 0, 5, 5), ["····", "····", "····"]),
        ((1.2, 1.2, 0.5, 0.5), ["····", "····", "····"]),
    ],
)
def test_pixels_whose_centres_lie_in_a_mask_are_hidden(mask, hidden):
    found = hidden_pixels((3, 4), [mask])
    assert ["".join("#" if pixel else "·" for pixel in row) for row in found] == hidden


def test_nothing_is_copied_without_masks():
    grey = np.zeros((3, 4), np.uint8)
    same, counted = hide(grey, ())
    assert same is grey
    assert counted is None


def test_masked_pixels_are_black_and_do_not_count():
    grey = np.array([[0, 9, 9], [7, 9, 0]], np.uint8)
    shown, counted = hide(grey, [(1, 0, 2, 1), (1, 0, 1, 2)])
    assert shown.tolist() == [[0, 0, 0], [7, 0, 0]]
    assert grey[0, 1] == 9
    counts = histogram_of(shown, counted).counts
    assert {level: counts[level] for level in np.flatnonzero(counts)} == {0: 2, 7: 1}


@pytest.mark.parametrize(
    ("masks", "message"),
    [
        (((1, 2, 3),), r"masks\[0\] is \(1, 2, 3\); it must be four numbers: x_px, y_px, width_px, height_px"),
        (((0, 0, 5, 5), (0, 0, 0, 5)), r"masks\[1\] width_px is 0; it must be a finite number above 0"),
        (((0, 0, 5, -1.5),), r"masks\[0\] height_px is -1.5"),
        (((math.nan, 0, 5, 5),), r"masks\[0\] x_px is nan"),
        (((0, math.inf, 5, 5),), r"masks\[0\] y_px is inf"),
        (((0, 0, "5", 5),), r"masks\[0\] width_px is '5'"),
        (("0,0,5,5",), r"masks\[0\] is '0,0,5,5'"),
        ((7,), r"masks\[0\] is 7"),
    ],
)
def test_masks_that_are_none_are_refused_by_name(masks, message):
    with pytest.raises(ValueError, match=message):
        Settings(masks=masks)


def picture_with_text():
    scene = random_scene(1, position_m=(0.0, 0.0, 1.0))
    text = (Text(text="12:34", x_px=20, y_px=20, height_px=20),)
    return render(msgspec.structs.replace(scene, texts=text))


def test_masked_text_and_a_masked_light_are_no_lights():
    image, truth = picture_with_text()
    assert (estimate(image, CAMERA, DOCK).markers.points_px < 100).all(axis=1).any()
    x, y = truth.lights_px[0]
    masks = ((x - 10, y - 10, 20, 20), (10, 10, 90, 40))
    found = estimate(image, CAMERA, DOCK, Settings(masks=masks))
    assert found.status == "ok"
    assert len(found.markers) == 9
    assert found.to_dict()["settings"]["masks"] == [list(mask) for mask in masks]
    assert np.linalg.norm(found.markers.points_px - truth.lights_px[0], axis=1).min() > 30


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("bits", [8, 16])
def test_what_is_under_a_mask_makes_no_difference(method, bits):
    image, _ = picture_with_text()
    image = image if bits == 8 else image.astype(np.uint16) << 8
    other = image.copy()
    other[10:50, 10:100] = np.iinfo(image.dtype).max // 3
    settings = Settings(method=method, level=128, masks=((10, 10, 90, 40),))
    first, second = (estimate(picture, CAMERA, DOCK, settings).to_dict() for picture in (image, other))
    assert first | {"elapsed_ms": 0} == second | {"elapsed_ms": 0}
    assert first["threshold"]["level"] > 0


@pytest.mark.parametrize("method", METHODS)
def test_whatever_is_left_by_a_mask_is_no_fault(method):
    image = np.random.default_rng(1).integers(0, 255, (480, 640)).astype(np.uint8)
    for masks in (((0, 0, 640, 480),), ((0, 0, 640, 479),), ((0, 0, 640, 240), (1, 240, 640, 240))):
        found = estimate(image, CAMERA, DOCK, Settings(method=method, level=128, masks=masks))
        assert found.status != "ok"
    everything = estimate(image, CAMERA, DOCK, Settings(method=method, level=128, masks=((-1, -1, 1e6, 1e6),)))
    assert everything.status == "no_lights"
    assert everything.message == "No lights: the whole picture is masked."


# What stays put over frames. The dock is a ring of ten groups, the text three at the upper left.

TURN = 2 * np.pi * np.arange(10) / 10
RING_PX = np.column_stack([200 + 60 * np.cos(TURN), 150 + 60 * np.sin(TURN)])
TEXT_PX = np.array([[20.0, 15.0], [32.0, 15.0], [44.0, 15.0]])


def groups(ring_px, others_px, areas=None):
    points = np.vstack([ring_px, others_px])
    corner = np.rint(points).astype(int)
    areas = np.full(len(points), 30) if areas is None else areas
    boxes = np.column_stack([corner - 4, corner + 4])
    return Markers(points, areas, np.full(len(points), 255), 0, boxes), np.arange(len(points)) < len(ring_px)


def watch(frames, ring_at, others_at, found=True, areas_at=None):
    """The masks after each frame."""
    still, masks = StillGroups(), []
    for frame in range(frames):
        markers, on_ring = groups(ring_at(frame), others_at(frame), None if areas_at is None else areas_at(frame))
        still.see(markers, on_ring if found else None)
        masks.append(still.masks)
    return masks


def moving(frame):
    return RING_PX + [1.5 * frame, 0.0]


CENTRE_PX = np.array([[200.0, 150.0]])


def coming(frame):
    return CENTRE_PX + (RING_PX - CENTRE_PX) * 1.02**frame


def test_text_is_masked_after_eight_frames_as_one_line():
    masks = watch(10, moving, lambda frame: TEXT_PX)
    assert masks[LEAST_FRAMES - 2] == ()
    # Boxes from 16 to 48 and 11 to 19, last pixels included, with 3 pixels around.
    assert masks[LEAST_FRAMES - 1] == ((13.0, 8.0, 39.0, 15.0),)


def test_new_masks_are_told_once():
    still = StillGroups()
    told = [still.see(*groups(moving(frame), TEXT_PX)) for frame in range(12)]
    assert [len(masks) for masks in told] == [0] * 7 + [1] + [0] * 4


def test_texts_far_apart_are_masked_apart():
    masks = watch(8, moving, lambda frame: np.array([[20.0, 15.0], [20.0, 300.0], [400.0, 15.0]]))
    assert len(masks[-1]) == 3


def staying(frame):
    return TEXT_PX


@pytest.mark.parametrize(
    ("ring_at", "others_at", "areas_at"),
    [
        pytest.param(lambda frame: RING_PX, staying, None, id="everything stands still"),
        pytest.param(moving, lambda frame: TEXT_PX + [0.1 * frame, 0.0], None, id="it drifts"),
        pytest.param(coming, lambda frame: CENTRE_PX, None, id="it is the point that the camera moves to"),
        pytest.param(moving, staying, lambda frame: np.full(13, 20 if frame % 4 else 60), id="its size changes"),
        pytest.param(moving, lambda frame: TEXT_PX + (frame % 12 > 0) * 3.0 * frame, None, id="it comes and goes"),
    ],
)
def test_nothing_is_masked_where(ring_at, others_at, areas_at):
    assert watch(20, ring_at, others_at, areas_at=areas_at)[-1] == ()


@pytest.mark.parametrize("ring_at", [moving, coming])
@pytest.mark.parametrize("found", [True, False])
@pytest.mark.parametrize("off", [[0.0, 0.0], [160.0, 120.0]], ids=["apart", "within the ring"])
def test_text_that_the_scene_moves_past_is_masked_whether_or_not_a_dock_is_found(ring_at, found, off):
    masks = watch(20, ring_at, lambda frame: TEXT_PX + off, found=found)[-1]
    hidden = hidden_pixels((400, 400), masks)
    assert all(hidden[round(y), round(x)] for x, y in TEXT_PX + off)
    assert not any(hidden[round(y), round(x)] for x, y in ring_at(19))


def lettering(frames, moves, seed=0):
    """Masks where a dock is seen on letters in every frame, with noise of 0.05 px on them; and the letters."""
    rng = np.random.default_rng(seed)
    letters = np.vstack([TEXT_PX, TEXT_PX + [0.0, 25.0], TEXT_PX + [40.0, 0.0]])
    still = StillGroups()
    for frame in range(frames):
        markers, on_ring = groups(letters + rng.normal(0, 0.05, letters.shape), moves(frame))
        on_ring[6:] = False  # six of the nine letters
        still.see(markers, on_ring)
    return still.masks, letters


def test_letters_are_masked_although_a_dock_was_seen_on_them():
    masks, letters = lettering(40, lambda frame: moving(frame) + [0.0, 100.0])
    hidden = hidden_pixels((400, 400), masks)
    assert all(hidden[round(y), round(x)] for x, y in letters)
    assert not any(hidden[round(y), round(x)] for x, y in moving(39) + [0.0, 100.0])


def test_letters_that_were_alone_in_view_are_masked_once_a_dock_moves_in_although_one_was_seen_on_them():
    still, rng = StillGroups(), np.random.default_rng(3)
    letters = np.vstack([TEXT_PX, TEXT_PX + [0.0, 25.0], TEXT_PX + [40.0, 0.0]])
    for frame in range(100):
        ring = moving(frame - 60) + [0.0, 100.0] if frame >= 60 else np.empty((0, 2))
        markers, on_ring = groups(letters + rng.normal(0, 0.05, letters.shape), ring)
        on_ring[:] = np.arange(len(on_ring)) < 6
        still.see(markers, on_ring)
        assert still.masks == () or frame >= 60  # while nothing moves, a dock at rest looks the same
    hidden = hidden_pixels((400, 400), still.masks)
    assert all(hidden[round(y), round(x)] for x, y in letters)


def drifting(rng):
    """Snow of thirty flakes in a current: each at its own speed, around a common one."""
    start, speed = (
        rng.uniform(0, 400, (30, 2)),
        [1.5, 0.3] * rng.uniform(0.3, 1.7, (30, 1)) + rng.normal(0, 0.2, (30, 2)),
    )
    return lambda frame: np.mod(start + frame * speed, 400)


@pytest.mark.parametrize("seed", range(10))
def test_a_dock_at_rest_is_never_masked_in_snow_that_a_current_carries(seed):
    masks, points = lettering(120, drifting(np.random.default_rng(seed)), seed)
    hidden = hidden_pixels((400, 400), masks)
    assert not any(hidden[round(y), round(x)] for x, y in points[:6])  # the ring's; what else stays put may be masked


def test_lights_that_stand_still_are_not_masked_while_snow_moves_nor_when_the_dock_has_gone():
    rng = np.random.default_rng(2)
    still = StillGroups()
    for _ in range(20):
        still.see(*groups(RING_PX, rng.uniform(0, 400, (40, 2))))
    assert still.masks == ()
    # Another ring is found elsewhere, and the lights are still where they were.
    for _ in range(20):
        still.see(*groups(RING_PX + 300.0, RING_PX))
    assert still.masks == ()


def test_a_frame_without_groups_is_no_fault():
    still = StillGroups()
    assert still.see(None, None) == ()
    assert still.see(*groups(np.empty((0, 2)), np.empty((0, 2)))) == ()
    assert still.see(*groups(np.empty((0, 2)), TEXT_PX)) == ()


def test_a_group_is_followed_over_more_than_its_stride_if_step_by_step():
    paths, rng = Paths(), np.random.default_rng(2)
    places, motion = rng.uniform(0, 600, (12, 2)), None
    for frame in range(10):
        motion = paths.see(places + [12.0 * frame, -5.0 * frame])
    np.testing.assert_allclose(paths.ends_px(), places + [108.0, -45.0])
    assert motion.turn == pytest.approx(1.0)
    assert motion.shift == pytest.approx(complex(96, -40))  # over eight frames


def test_masks_as_far_apart_as_they_are_high_are_one_and_farther_apart_two():
    assert _union((0, 0, 10, 10), (20, 0, 10, 10)) == (0, 0, 30, 10)
    assert _union((0, 0, 10, 10), (21, 0, 11, 10)) is None


def test_masks_are_one_where_the_rectangle_around_them_is_not_much_larger():
    assert _union((0, 0, 40, 10), (45, 0, 10, 10)) == (0, 0, 55, 10)
    assert _union((0, 0, 40, 10), (40, 0, 10, 40)) is None
