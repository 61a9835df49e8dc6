import io
import struct
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from dockpose.camera.image import (
    ImageError,
    as_picture,
    darkest_channel,
    decode,
    significant_bits,
    to_grey,
    to_levels,
    without_defects,
)
from PIL import Image

GRADIENT = np.arange(48, dtype=np.uint8).reshape(6, 8) * 5


def encoded(image: np.ndarray, ending: str = ".png") -> bytes:
    return cv2.imencode(ending, image)[1].tobytes()


def png_header(width: int, height: int, bits: int = 8, colours: int = 0) -> bytes:
    """A PNG that claims a size and holds next to nothing; grey, or 6 for colours and alpha."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, bits, colours, 0, 0, 0)
    content = zlib.compress(bytes(1000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("image", "ending"),
    [
        *((GRADIENT, ending) for ending in (".png", ".tiff", ".bmp", ".pgm")),
        (GRADIENT.astype(np.uint16) * 250, ".png"),
        (np.random.default_rng(0).integers(0, 65536, (5, 7, 3), dtype=np.uint16), ".png"),
    ],
)
def test_what_loses_nothing_comes_back(image, ending):
    np.testing.assert_array_equal(decode(encoded(image, ending)), image)


def test_grey_by_hand():
    # ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B; the picture is B, G, R.
    image = np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255]]], np.uint8)
    assert to_grey(image).tolist() == [[29, 150, 76]]
    assert to_grey(GRADIENT) is GRADIENT
    np.testing.assert_array_equal(to_grey(GRADIENT[:, :, None]), GRADIENT)


def test_the_darkest_channel_has_white_alone_bright_and_a_grey_picture_has_none():
    image = np.array([[[10, 20, 30], [255, 0, 255], [255, 254, 255]]], np.uint8)
    np.testing.assert_array_equal(darkest_channel(image), [[10, 0, 254]])
    with_alpha = np.dstack([image, np.zeros((1, 3), np.uint8)])
    np.testing.assert_array_equal(darkest_channel(with_alpha), [[10, 0, 254]])
    assert darkest_channel(GRADIENT) is None
    assert darkest_channel(np.dstack([GRADIENT] * 3)) is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", r"dock\.png: the file is empty"),
        (b"these are words, not a picture", r"dock\.png: is not a picture"),
        (encoded(GRADIENT)[:-20], r"dock\.png: .*(damaged|cut short)"),
        (encoded(GRADIENT)[:20], r"dock\.png: "),
        (png_header(10001, 10000), r"dock\.png: .*10001 x 10000, 100 megapixels"),
        (png_header(2**31 - 1, 2**31 - 1), r"dock\.png: "),
    ],
)
def test_what_is_no_picture_is_refused_by_name(data, message):
    with pytest.raises(ImageError, match=message):
        decode(data, "dock.png")


def test_a_jpeg_that_was_cut_short_is_refused_wherever_it_ends_and_despite_its_thumbnail():
    whole = encoded(np.tile(GRADIENT, (50, 50)), ".jpg")
    thumbnail = encoded(GRADIENT, ".jpg")
    whole = whole[:2] + struct.pack(">4sH", b"\xff\xff\xff\xe1", len(thumbnail) + 2) + thumbnail + whole[2:]
    assert decode(whole + b"\xff\xda and what a telephone appends").shape == (300, 400)
    for length in (len(thumbnail), len(whole) // 2, len(whole) - 20, len(whole) - 2):
        with pytest.raises(ImageError, match=r"damaged|cut short"):
            decode(whole[:length], "dock.jpg")


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.full((4, 4), 1.5), "float64, from 1.5 to 1.5; floats must be from 0 to 1"),
        (np.full((4, 4), -0.1), "float64, from -0.1"),
        (np.full((4, 4), np.nan), "float64, not all numbers"),
        (np.zeros((4, 4), np.int32), "int32"),
        (np.ma.masked_less(GRADIENT, 10), "masked"),
        (np.zeros((4, 4), bool), "bool"),
        (np.zeros((4, 4, 2), np.uint8), r"\(4, 4, 2\)"),
        (np.zeros((0, 4), np.uint8), r"\(0, 4\)"),
        (np.zeros(4, np.uint8), r"\(4,\)"),
    ],
)
def test_arrays_that_are_no_picture_are_refused(image, message):
    with pytest.raises(ImageError, match=message):
        to_grey(image)


@pytest.mark.parametrize(("largest", "bits"), [(0, 10), (1023, 10), (1024, 12), (4095, 12), (4096, 14), (65535, 16)])
def test_significant_bits_of_16_bit_pictures(largest, bits):
    assert significant_bits(np.array([[0, largest]], np.uint16)) == bits


def lit(level, *extent, water=20, count=10):
    """A picture (60, 80) of 16 bits with lights of an extent in pixels, 6 pixels apart."""
    image = np.full((60, 80), water, np.uint16)
    for x in range(6, 6 + 6 * count, 6):
        image[10 : 10 + extent[0], x : x + extent[1]] = level
    return image


@pytest.mark.parametrize(("level", "water", "bits"), [(200, 20, 10), (530, 20, 10), (3000, 900, 12), (9000, 5000, 14)])
@pytest.mark.parametrize("hot", [[(50, 40)], [(50, 40), (50, 41)], [(0, 0), (59, 79), (30, 5), (11, 7)]], ids=str)
def test_hot_pixels_do_not_scale_a_picture(level, water, bits, hot):
    image = lit(level, 3, 3, water=water)
    for place in hot:
        image[place] = 65535
    assert significant_bits(image) == bits
    assert significant_bits(np.dstack(3 * [image])) == bits
    levels, step = to_levels(image)
    assert step == 1 << bits - 8
    for place in np.ndindex(image.shape):
        assert levels[place] == (255 if place in hot else image[place] // step)
    assert without_defects(image).max() == (1 << bits) - 1


@pytest.mark.parametrize("extent", [(1, 2), (2, 1), (2, 2), (3, 3)])
def test_lights_of_a_few_pixels_keep_their_levels_and_so_does_one_that_is_spread(extent):
    image = lit(65535, *extent)
    assert significant_bits(image) == 16
    assert without_defects(image) is image
    spread = lit(500, 3, 3, count=1)
    spread[11, 6:9] = spread[10:13, 7] = 4000
    spread[11, 7] = 20000  # the peak of a light of 3 x 3
    assert significant_bits(spread) == 16


def test_many_single_pixels_are_no_defects():
    image = np.zeros((60, 80), np.uint16)
    image[::2, ::2] = 65535
    assert significant_bits(image) == 16


def test_a_picture_that_would_take_too_much_memory_is_refused_before_it_is_decoded():
    data = png_header(7000, 7000, bits=16, colours=6)
    tracemalloc.start()
    try:
        with pytest.raises(ImageError, match=r"^big: .* 7000 x 7000 with 8 bytes a pixel, 392 MB; at most 200"):
            decode(data, "big")
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_alpha_is_applied_exactly_in_strips(kind):
    rng, opaque = np.random.default_rng(0), np.iinfo(kind).max
    image = rng.integers(0, opaque + 1, (900, 700, 4), dtype=kind)
    image[0, 0] = opaque
    # Rounded to the nearest level, in numbers that hold every product.
    expected = (2 * image[:, :, :3].astype(np.int64) * image[:, :, 3:] + opaque) // (2 * opaque)
    np.testing.assert_array_equal(decode(encoded(image)), expected)


def test_floats_from_0_to_1_and_any_order_of_bytes_are_taken():
    levels = np.array([[0, 1, 257], [32768, 65534, 65535]], np.uint16)
    np.testing.assert_array_equal(to_grey(levels / 65535), levels)
    np.testing.assert_array_equal(to_grey((levels / 65535).astype(np.float32)), levels)
    swapped = to_grey(levels.astype(">u2"))
    np.testing.assert_array_equal(swapped, levels)
    assert swapped.dtype.isnative
    assert to_grey(np.ma.array(GRADIENT)).tolist() == GRADIENT.tolist()  # nothing is masked


@pytest.mark.parametrize("kind", ["GIF", "WEBP", "PNG"])
def test_an_animation_is_refused_and_a_single_picture_of_its_kind_is_read(kind):
    frames = [Image.fromarray(GRADIENT + step) for step in (0, 3)]
    single, film = io.BytesIO(), io.BytesIO()
    frames[0].save(single, kind, lossless=True)
    frames[0].save(film, kind, save_all=True, append_images=frames[1:], lossless=True)
    assert to_grey(decode(single.getvalue())).tolist() == GRADIENT.tolist()
    with pytest.raises(ImageError, match=r"^dock: is an animation; convert it to a video, as MP4, or to pictures"):
        decode(film.getvalue(), "dock")


@pytest.mark.parametrize(
    ("array", "conversion"),
    [
        (np.ones((2, 2), bool), ", as 255 * image.astype(np.uint8)"),
        (np.full((2, 2), 255, np.int64), ", as image.astype(np.uint8)"),
        (np.full((2, 2), 256, np.int32), ", as image.astype(np.uint16)"),
        (np.full((2, 2), -1, np.int32), "from 0 to 1"),
        (np.full((2, 2), 70000, np.uint32), "from 0 to 1"),
    ],
)
def test_what_makes_a_picture_of_other_numbers_is_named(array, conversion):
    with pytest.raises(ImageError) as raised:
        as_picture(array)
    assert str(raised.value).endswith(conversion)
