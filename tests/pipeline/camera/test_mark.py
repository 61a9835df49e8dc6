"""What we have drawn on, told by its mark; Pillow and FFmpeg read the mark and convert what has it."""

import io

import cv2
import numpy as np
import pytest
from dockpose import estimate
from dockpose.camera import mark
from dockpose.camera.image import ImageError, decode
from dockpose.sidecar import sample_path
from PIL import Image, PngImagePlugin

GREY = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)
COLOUR = np.dstack([GREY.astype(np.uint8)] * 3)
WORDS = "a.png: is a picture that dockpose has drawn on; give the one that it was made from"


@pytest.mark.parametrize("picture", [GREY, GREY.astype(np.uint8), COLOUR, np.dstack([COLOUR, COLOUR[:, :, :1]])])
def test_a_marked_png_has_the_same_pixels_and_is_refused(picture):
    data = mark.to_png(picture)
    np.testing.assert_array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), picture)
    with Image.open(io.BytesIO(data)) as opened:
        opened.load()
        assert opened.info["Comment"] == "drawn by dockpose"
    with pytest.raises(ImageError) as caught:
        decode(data, "a.png")
    assert str(caught.value) == WORDS


def test_a_marked_jpeg_has_the_comment_and_is_refused():
    data = mark.to_jpeg(COLOUR, 90)
    with Image.open(io.BytesIO(data)) as opened:
        assert opened.info["comment"] == b"drawn by dockpose"
        assert "jfif" in opened.info
        again = io.BytesIO()
        opened.save(again, "JPEG", comment=opened.info["comment"])
    for each in (data, again.getvalue()):
        with pytest.raises(ImageError, match="has drawn on"):
            decode(each, "a.jpg")


def saved(ending, **options):
    memory = io.BytesIO()
    Image.fromarray(COLOUR).save(memory, ending, **options)
    return memory.getvalue()


def text(key, value):
    chunks = PngImagePlugin.PngInfo()
    chunks.add_text(key, value)
    return chunks


@pytest.mark.parametrize(
    "data",
    [
        saved("PNG"),
        saved("PNG", pnginfo=text("Comment", "as drawn by dockpose last year")),
        saved("PNG", pnginfo=text("Author", "drawn by dockpose")),
        saved("JPEG"),
        saved("JPEG", comment="not drawn by dockpose"),
        saved("PNG") + b"Comment\0drawn by dockpose",
        saved("JPEG") + b"\xff\xfe\0\x13drawn by dockpose",
        sample_path("plain").read_bytes(),
    ],
)
def test_other_pictures_are_read_whatever_they_say(data):
    assert decode(data).ndim >= 2


@pytest.mark.parametrize("whole", [mark.to_png(COLOUR), mark.to_jpeg(COLOUR)])
def test_a_damaged_head_ends_the_search_for_the_mark(whole):
    rng = np.random.default_rng(1)
    for length in range(60):
        damaged = bytearray(whole[: len(whole) if length % 2 else length])
        for at in rng.integers(0, max(1, len(damaged)), 4):
            damaged[at : at + 1] = bytes([rng.integers(256)])
        assert mark.is_drawn(bytes(damaged)) in (True, False)


def test_the_drawing_in_a_notebook_is_marked():
    assert mark.is_drawn(estimate("plain")._repr_png_())
