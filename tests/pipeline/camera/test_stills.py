"""Files of stills whose bytes are written by hand: what they mean, or what they are called where they are not read."""

import io
import struct
import zlib

import cv2
import numpy as np
import pytest
from dockpose.camera.image import ImageError, decode
from PIL import Image

RGB = Image.new("RGB", (8, 6), (200, 100, 50))
NOISE = np.random.default_rng(0).integers(0, 256, (64, 64)).astype(np.uint8)


def by_pillow(kind):
    file = io.BytesIO()
    RGB.save(file, kind)
    return file.getvalue()


def png(bits, colours, row, chunks=()):
    """A PNG of one row, whose pixels are two."""
    parts = [(b"IHDR", struct.pack(">IIBBBBB", 2, 1, bits, colours, 0, 0, 0)), *chunks]
    parts += [(b"IDAT", zlib.compress(b"\0" + row)), (b"IEND", b"")]
    packed = (
        struct.pack(">I", len(part)) + kind + part + struct.pack(">I", zlib.crc32(kind + part)) for kind, part in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)


@pytest.mark.parametrize(
    ("data", "kind", "levels"),
    [
        (b"P5 2 1 255\n\x64\x32", np.uint8, [[100, 50]]),
        (b"P5\n# white is 100\n2 1\n100\n\x64\x32", np.uint8, [[255, 128]]),
        (b"P2 2 1 15\n15 5\n", np.uint8, [[255, 85]]),
        (b"P6 1 1 5\n\1\0\5", np.uint8, [[[255, 0, 51]]]),
        (b"P5 2 1 1023\n\3\xff\2\0", np.uint16, [[1023, 512]]),
        (b"P5 2 1 4095\n\x0f\xff\0\1", np.uint16, [[4095, 1]]),
        (b"P2 2 1 65535\n65535 258\n", np.uint16, [[65535, 258]]),
        (b"P5 2 1 500\n\1\xf4\0\xfa", np.uint16, [[1023, 512]]),  # 500 is white, 250 half of it
        (b"P1 4 1\n1 0 1 0\n", np.uint8, [[0, 255, 0, 255]]),  # 1 is ink
    ],
)
def test_a_pnm_says_what_white_is(data, kind, levels):
    image = decode(data)
    assert image.dtype == kind
    # A half is rounded to the even one or up.
    np.testing.assert_allclose(image, levels, atol=1 if b" 500" in data or b"100\n" in data else 0)


@pytest.mark.parametrize("one", [b"P5 2 1 255\n\x64\x32", b"P6 1 1 255\n\1\2\3", b"P5 1 1 1023\n\3\xff"])
def test_pnms_one_after_another_in_a_file_are_refused(one):
    assert decode(one).size
    with pytest.raises(ImageError, match=r"^dock\.pgm: holds several pictures, one after another"):
        decode(one + one, "dock.pgm")


@pytest.mark.parametrize("ending", [".jpg", ".png", ".bmp", ".webp"])
def test_pictures_one_after_another_in_a_file_are_refused_and_what_else_follows_is_not(ending):
    one, small = (cv2.imencode(ending, NOISE[:side, :side])[1].tobytes() for side in (64, 16))
    whole = decode(one)
    for many in (one + one, one + bytes(5) + one):
        with pytest.raises(ImageError, match=r"^a: holds several pictures, one after another; save each"):
            decode(many, "a")
    for more in (bytes(99), b"SEFT and a maker's data", b"\0\0\0\x18ftypmp42", small if ending == ".jpg" else b""):
        np.testing.assert_array_equal(decode(one + more), whole)


def test_previews_that_a_jpeg_lists_are_no_further_pictures():
    one = cv2.imencode(".jpg", NOISE)[1].tobytes()
    listed = one[:2] + b"\xff\xe2\0\x08MPF\0\xff\xd9" + one[2:]
    np.testing.assert_array_equal(decode(listed + one), decode(one))


@pytest.mark.parametrize("how", [(), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 2)])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_jpeg_whose_pixels_end_before_its_end_is_cut_short(how, channels):
    data = cv2.imencode(".jpg", NOISE.repeat(channels).reshape(64, 64, channels), how)[1].tobytes()
    odd = data[:2] + b"\xff\xe1\0\x06\xff\xd9\0\0\xff\xfe\0\4ab" + data[2:]  # damaged EXIF, and a comment
    np.testing.assert_array_equal(decode(odd), decode(data))
    for part in (0.5, 0.7, 0.9):
        with pytest.raises(ImageError, match="damaged or cut short"):
            decode(data[: int(part * len(data))] + b"\xff\xd9")


def test_a_picture_that_is_transparent_everywhere_is_not_taken_as_black():
    image = np.full((8, 8, 4), 200, np.uint8)
    image[:, :, 3] = 0
    with pytest.raises(ImageError, match=r"^a: is transparent everywhere \(its alpha channel is 0\)"):
        decode(cv2.imencode(".png", image)[1].tobytes(), "a")
    image[0, 0, 3] = 255
    assert decode(cv2.imencode(".png", image)[1].tobytes()).sum() == 600


@pytest.mark.parametrize(
    ("data", "levels"),
    [
        (png(8, 0, b"\xc8\x64"), [[200, 100]]),
        (png(8, 0, b"\xc8\x64", [(b"tRNS", b"\0\xc8")]), [[0, 100]]),
        (png(16, 0, b"\x4e\x20\0\x64", [(b"tRNS", b"\0\x64")]), [[20000, 0]]),
        (png(4, 0, b"\xf7", [(b"tRNS", b"\0\7")]), [[255, 0]]),
        (png(8, 2, b"\1\2\3\4\5\6", [(b"tRNS", b"\0\1\0\2\0\3")]), [[[0, 0, 0], [6, 5, 4]]]),
        (png(8, 3, b"\0\1", [(b"PLTE", b"\1\2\3\4\5\6"), (b"tRNS", b"\xff\0")]), [[[3, 2, 1], [0, 0, 0]]]),
        (png(16, 4, b"\xea\x60\xff\xff\xea\x60\0\0"), [[3 * [60000], [0, 0, 0]]]),
        (png(16, 0, b"\xff\xf0\0\x10", [(b"sBIT", b"\x0c")]), [[65520, 16]]),  # 12 bits on the left
        (png(8, 0, b"\xc8\x64", [(b"gAMA", struct.pack(">I", 100000))]), [[200, 100]]),  # as the sensor has them
    ],
)
def test_a_png_is_read_as_it_is_with_what_is_transparent_black(data, levels):
    np.testing.assert_array_equal(decode(data), levels)


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (by_pillow("TGA"), "a TGA picture; convert it to PNG or TIFF"),
        (by_pillow("PDF"), "a PDF document; convert"),
        *((b"\0\0\0\x18ftyp" + brand + bytes(40), what) for brand, what in (
            (b"heic", "a HEIC picture; convert"), (b"avif", "an AVIF picture; convert"),
            (b"crx ", r"a raw picture of a camera \(CR3, Canon\); convert"), (b"isom", "a video or a sound"),
        )),
        (b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(40), "a JPEG 2000 picture; convert"),
        (b"IIRO\x08\0\0\0" + bytes(40), r"a raw picture of a camera \(ORF, Olympus\); convert it"),
        (b"IIU\0\x18\0\0\0" + bytes(40), r"a raw picture of a camera \(RW2, Panasonic\); convert it"),
        (b"FUJIFILMCCD-RAW 0201" + bytes(40), r"a raw picture of a camera \(RAF, Fujifilm\); convert it"),
        (b"<?xml version='1.0'?>\n<svg width='1'/>", "an SVG drawing; convert"),
        (b"PK\3\4" + bytes(40), "an archive; unpack it"),
        (b"BZh91AY" + bytes(40), "an archive; unpack it"),
        (b"\x37\x7f\x06\x82" + bytes(40), r"the log of a bag; open the \.db3 beside it"),
        (b"#EXTM3U\n#EXT-X-VERSION:3\n", "a playlist; open a file"),
        (b"\xd4\xc3\xb2\xa1\2\0\4\0" + bytes(40), r"a capture of packets \(pcap\)"),
        (b"ULog\x01\x12\x35\1" + bytes(40), r"a log of PX4 \(ULog\), which has no pictures"),
        (struct.pack(">Q", 1_790_000_000_000_000) + b"\xfd\x09" + bytes(40), r"a log of telemetry \(MAVLink's tlog\)"),
        (b"version https://git-lfs.github.com/spec/v1\noid", "what Git LFS leaves"),
        *((by_pillow(kind), "not a picture that can be read") for kind in ("EPS", "ICO", "DDS", "SGI", "PCX")),
        (by_pillow("JPEG").replace(b"\xff\xc0\0\x11\x08", b"\xff\xc0\0\x11\x0c"), "a JPEG without loss or of 12 bits"),
        (bytes(400), "not a picture that can be read"),
    ],
)  # fmt: skip
def test_what_else_a_file_is_is_said_by_its_name(data, name):
    with pytest.raises(ImageError, match=rf"^dock\.png: is {name}"):
        decode(data, "dock.png")
