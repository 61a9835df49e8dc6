"""What is drawn of an estimate, part by part, where a hand would look for it."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false, reportCallIssue=false, reportOptionalSubscript=false

import cv2
import numpy as np
import pytest
from dockpose import estimate
from dockpose.estimate.canvas import Canvas
from dockpose.estimate.drawing import PARTS, draw_parts
from dockpose.palette import DROPPED_COLOUR, ELLIPSE_COLOUR, LIGHT_COLOUR, POSE_COLOURS, TEXT_COLOUR, bgr
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.fixture(scope="module")
def found():
    """A dock of ten lights, and a bright spot of four pixels in a corner that is none of them."""
    image = render(random_scene(1))[0]
    cv2.circle(image, (600, 440), 4, 255, -1)
    return estimate(image, CAMERA, DOCK)


def drawn(found, *parts, scale=1):
    canvas = Canvas(np.zeros((480 * scale, 640 * scale, 3), np.uint8))
    draw_parts(canvas, found, parts)
    return canvas.pixels


def share_of(pixels, colour):
    """How many pixels have this colour, as bright or darker by the smoothing of a stroke's edges."""
    wanted, shown = np.array(bgr(colour), float), pixels.astype(float)
    height = shown @ wanted / (wanted @ wanted)
    return int(((height > 0.5) & (np.linalg.norm(shown - height[..., None] * wanted, axis=-1) < 8)).sum())


@pytest.mark.parametrize(
    ("part", "colours"),
    [
        ("ellipse", {ELLIPSE_COLOUR}),
        ("lights", {LIGHT_COLOUR, DROPPED_COLOUR, TEXT_COLOUR}),
        ("a", {POSE_COLOURS[0], TEXT_COLOUR}),  # with the dock's centre, as it is chosen
        ("b", {POSE_COLOURS[1]}),
    ],
)
def test_each_part_is_drawn_by_itself_in_its_colour(found, part, colours):
    every = {ELLIPSE_COLOUR, LIGHT_COLOUR, DROPPED_COLOUR, TEXT_COLOUR, *POSE_COLOURS}
    assert {colour for colour in every if share_of(drawn(found, part), colour)} == colours
    assert not drawn(found).any()
    assert (drawn(found, *PARTS) != drawn(found, *(one for one in PARTS if one != part))).any()


def test_the_ellipse_runs_between_the_lights_and_stops_short_of_each(found):
    on_ring = found.markers.points_px[found.ring.on_ring]
    rows, columns = np.nonzero(drawn(found, "ellipse").any(axis=2))
    shown = np.column_stack([columns, rows])
    gap = np.linalg.norm(shown[:, None] - on_ring, axis=2).min(axis=1)
    assert 4 < gap.min() < 9  # 6 px less a smoothed stroke; larger lights have 1.6 of their radii
    # All of the rest of it: no ellipse is longer than by its larger radius all around, nor shorter than by its smaller.
    large, small = found.ellipse.semi_axes_px
    middle = np.linalg.norm(shown - found.ellipse.centre_px, axis=1)
    off_middle = middle > 15  # the cross of the centre
    assert small - 3 < middle[off_middle].min() < middle[off_middle].max() < large + 3
    around = np.degrees(np.arctan2(*(shown[off_middle] - found.ellipse.centre_px).T))
    assert np.diff(np.sort(around)).max() < 25


def test_a_light_has_a_circle_and_what_is_none_a_tilted_cross(found):
    pixels = drawn(found, "lights")
    for point, is_light in zip(found.markers.points_px, found.ring.on_ring, strict=True):
        x, y = (round(float(value)) for value in point)
        around = pixels[y - 12 : y + 13, x - 12 : x + 13]
        assert bool(share_of(around, LIGHT_COLOUR)) == is_light
        assert bool(share_of(around, DROPPED_COLOUR)) != is_light
        # A cross runs through the middle, and a circle leaves it free.
        assert bool(pixels[y, x].any()) != is_light
    assert not found.ring.on_ring.all()


def test_strokes_and_the_gaps_beside_lights_grow_with_the_picture():
    image = render(random_scene(1))[0]
    wide = 3
    large = estimate(cv2.resize(image, None, fx=wide, fy=wide), CAMERA.for_size(640 * wide, 480 * wide), DOCK)
    on_ring = large.markers.points_px[large.ring.on_ring]
    rows, columns = np.nonzero(drawn(large, "ellipse", scale=wide).any(axis=2))
    gap = np.linalg.norm(np.column_stack([columns, rows])[:, None] - on_ring, axis=2).min()
    assert gap > wide * 4


def test_lines_of_words_have_the_colours_of_their_poses(found):
    """White, then A's and B's: blue has more blue than red, orange more red than blue, both brightened."""
    pixels = found.draw().astype(int)
    # The largest channel of each line's colour, of which A's is 178 and B's 230 before .45 of white are mixed in.
    for row, (sign, most) in enumerate(((0, 255), (1, 0.55 * 178 + 0.45 * 255), (-1, 0.55 * 230 + 0.45 * 255))):
        line = pixels[4 + 16 * row : 4 + 16 * (row + 1), 8:]
        bright = line[line.max(axis=2) > 180]
        assert len(bright) > 50
        assert np.sign(np.round(np.median(bright[:, 0] - bright[:, 2]) / 20)) == sign
        # On a darkened ground letters are legible: no channel of a line's own colour is darker than 0.45 of white, or
        # of what a stroke covers of a pixel, which is less in older versions of OpenCV.
        letters = line[line.max(axis=2) >= np.percentile(bright.max(axis=1), 90)]
        assert np.median(letters.min(axis=1) - 0.45 * 255 * letters.max(axis=1) / most) >= -1


def test_the_chosen_pose_is_drawn_twice_as_wide_as_the_other():
    found = estimate(render(random_scene(1))[0], CAMERA, DOCK)
    chosen, other = (
        share_of(drawn(found, part, scale=2), colour) for part, colour in zip("ab", POSE_COLOURS, strict=True)
    )
    assert chosen > 1.3 * other
