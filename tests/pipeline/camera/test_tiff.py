"""TIFF files as other programs write them, by tifffile: what is read is what was written."""

import io
import struct
import zlib

import cv2
import numpy as np
import pytest
import tifffile
from dockpose.camera.image import ImageError, decode
from dockpose.camera.tiff import pages
from PIL import Image

RNG = np.random.default_rng(0)
STORED = [
    {},
    {"byteorder": ">"},
    {"bigtiff": True},
    {"rowsperstrip": 7},
    {"tile": (64, 64)},
    {"compression": "deflate", "predictor": True},
]


def tiff(pixels, photometric="minisblack", **how):
    file = io.BytesIO()
    tifffile.imwrite(file, pixels, metadata=None, photometric=photometric, **how)
    return file.getvalue()


def noise(kind, *shape):
    return RNG.integers(0, np.iinfo(kind).max, shape, dtype=kind)


def in_planes(pixels):
    return np.ascontiguousarray(np.moveaxis(pixels, 2, 0))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("how", STORED, ids=str)
def test_grey_and_colours_come_back_however_they_are_stored(kind, how):
    grey, rgb = noise(kind, 60, 80), noise(kind, 60, 80, 3)
    np.testing.assert_array_equal(decode(tiff(grey, **how)), grey)
    inverted = tiff(np.iinfo(kind).max - grey, **how | {"photometric": "miniswhite"})
    np.testing.assert_array_equal(decode(inverted), grey)
    np.testing.assert_array_equal(decode(tiff(rgb, photometric="rgb", **how)), rgb[:, :, ::-1])
    planes = tiff(in_planes(rgb), photometric="rgb", planarconfig="separate", **how)
    np.testing.assert_array_equal(decode(planes), rgb[:, :, ::-1])


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("planes", [False, True])
@pytest.mark.parametrize(("extra", "is_applied"), [("unassalpha", True), ("assocalpha", False), ("unspecified", False)])
def test_opacity_is_applied_once_where_it_is_not_yet(kind, planes, extra, is_applied):
    most, rgba = int(np.iinfo(kind).max), noise(kind, 60, 80, 4)
    bgr, alpha = rgba[:, :, 2::-1].astype(np.int64), rgba[:, :, 3:].astype(np.int64)
    wanted = (bgr * alpha + most // 2) // most if is_applied else bgr
    how = {"photometric": "rgb", "extrasamples": [extra]}
    data = tiff(in_planes(rgba), planarconfig="separate", **how) if planes else tiff(rgba, **how)
    np.testing.assert_array_equal(decode(data), wanted)


@pytest.mark.parametrize("planes", [False, True])
def test_one_that_is_cut_short_is_refused_wherever_it_ends(planes):
    rgb = noise(np.uint16, 60, 80, 3)
    data = tiff(in_planes(rgb), photometric="rgb", planarconfig="separate") if planes else tiff(rgb, photometric="rgb")
    for length in (4, 8, 60, 200, len(data) // 2, len(data) - 1):
        with pytest.raises(ImageError, match=r"^dock\.tif: .*cut short"):
            decode(data[:length], "dock.tif")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (tiff(noise(np.uint8, 5, 6, 8)), "has 5 pages, which are a sequence; open it by itself"),
        (tiff(np.zeros((6, 8), np.int32)), "pixels are int32"),
        (tiff(np.full((6, 8), 2, np.float32)), "floats must be from 0 to 1"),
        (tiff(noise(np.uint8, 6, 8, 2), extrasamples=["unassalpha"], planarconfig="contig"), "grey with opacity"),
    ],
)
def test_what_is_not_read_is_said_in_a_sentence(data, message):
    with pytest.raises(ImageError, match=rf"^dock\.tif: .*{message}"):
        decode(data, "dock.tif")


def test_a_file_that_claims_too_much_is_refused_before_it_is_decoded():
    data = tiff(noise(np.uint8, 6, 8))
    huge = data.replace(struct.pack("<HHII", 256, 4, 1, 8), struct.pack("<HHII", 256, 4, 1, 2**31))
    assert huge != data
    with pytest.raises(ImageError, match="megapixels"):
        decode(huge, "dock.tif")


def test_what_unpacks_to_more_than_its_size_is_refused():
    packed = zlib.compress(bytes(100_000_000))
    data = tiff(noise(np.uint8, 60, 80), compression="deflate")
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        (size,) = file.pages.first.databytecounts
    (place,) = (at for at in range(len(data)) if data[at : at + 4] == struct.pack("<HH", 279, 4))
    assert struct.unpack("<I", data[place + 8 : place + 12]) == (size,)
    bomb = data[: place + 8] + struct.pack("<I", len(packed)) + data[place + 12 :]
    (offsets,) = (at for at in range(len(data)) if data[at : at + 4] == struct.pack("<HH", 273, 4))
    bomb = bomb[: offsets + 8] + struct.pack("<I", len(bomb)) + bomb[offsets + 12 :] + packed
    with pytest.raises(ImageError, match="more is packed in it than it is large"):
        decode(bomb, "dock.tif")


def test_a_ring_of_pages_ends():
    data = bytearray(tiff(noise(np.uint8, 6, 8)))
    first = struct.unpack("<I", data[4:8])[0]
    entries = struct.unpack("<H", data[first : first + 2])[0]
    after = first + 2 + 12 * entries
    data[after : after + 4] = data[4:8]
    assert decode(bytes(data)).shape == (6, 8)


def test_white_as_0_in_16_bits_where_opencv_unpacks_it():
    grey = noise(np.uint16, 60, 80)
    packed = cv2.imencode(".tiff", grey, [cv2.IMWRITE_TIFF_COMPRESSION, cv2.IMWRITE_TIFF_COMPRESSION_LZW])[1].tobytes()
    entry = struct.pack("<HHI", 262, 3, 1)  # how a grey value is meant: 1 for black as 0
    assert packed.count(entry + struct.pack("<I", 1)) == 1
    data = packed.replace(entry + struct.pack("<I", 1), entry + struct.pack("<I", 0))
    np.testing.assert_array_equal(decode(packed), grey)
    np.testing.assert_array_equal(decode(data), 65535 - grey)


SMALL, LARGE = noise(np.uint16, 30, 40), noise(np.uint16, 60, 80)
REDUCED, CFA, DNG = {"subfiletype": 1}, {"photometric": 32803}, {"extratags": [(50706, 1, 4, b"\1\4\0\0", True)]}
NIKON = {"extratags": [(271, 2, 0, "NIKON CORPORATION", True)]}


def written(*parts):
    """A TIFF of pages, each with how it is written and, where a third is given, how many SubIFDs follow."""
    file = io.BytesIO()
    with tifffile.TiffWriter(file) as writer:
        for pixels, how in parts:
            writer.write(pixels, metadata=None, **{"photometric": "minisblack"} | how)
    return file.getvalue()


@pytest.mark.parametrize(
    ("parts", "name"),
    [
        ([(SMALL, REDUCED | DNG | {"subifds": 1}), (LARGE, CFA)], "DNG"),
        ([(SMALL, REDUCED | NIKON | {"subifds": 2}), (SMALL, REDUCED), (LARGE, CFA)], "NIKON CORPORATION"),
        ([(SMALL, NIKON | {"subifds": 2}), (LARGE, CFA), (SMALL, REDUCED)], "NIKON CORPORATION"),
        ([(LARGE, CFA)], "CFA"),
        ([(np.dstack(3 * [LARGE]), {"photometric": 34892})], "CFA"),
        ([(SMALL, {}), (LARGE, CFA)], "CFA"),
    ],
)
def test_a_raw_picture_is_refused_by_name_wherever_the_sensors_picture_stands(parts, name):
    with pytest.raises(
        ImageError, match=rf"^dock\.dng: is a raw picture of a camera \({name}\); convert it to TIFF or PNG$"
    ):
        decode(written(*parts), "dock.dng")


def test_a_canon_raw_picture_is_known_by_its_head():
    data = bytearray(written((SMALL, {})))
    data += data[8:]
    tags = int.from_bytes(data[4:8], "little")
    moved = (
        bytes(data[:4]) + struct.pack("<I", len(data)) + b"CR\2\0" + bytes(data[12:]) + bytes(data[tags : tags + 400])
    )
    with pytest.raises(ImageError, match=r"\(CR2\); convert it"):
        decode(moved, "dock.cr2")


@pytest.mark.parametrize("kind", [1, 4, 5])
def test_a_smaller_version_alone_is_not_searched(kind):
    data = written((SMALL, REDUCED), (SMALL[::2], REDUCED))
    entry = struct.pack("<HHI", 254, 4, 1)
    assert data.count(entry + b"\1\0") == 2
    with pytest.raises(ImageError, match="holds nothing but a smaller version of a picture, or its mask"):
        decode(data.replace(entry + b"\1", entry + bytes([kind])), "dock.tif")


@pytest.mark.parametrize(
    "parts",
    [
        [(LARGE, {"subifds": 2}), (SMALL, REDUCED), (SMALL[::2], REDUCED)],  # a pyramid
        [(LARGE, {"subifds": 1}), (SMALL, {})],  # one that is not marked
        [(SMALL, REDUCED | {"subifds": 2}), (SMALL, REDUCED), (LARGE, {})],
        [(SMALL, REDUCED), (LARGE, {})],
        [(SMALL, {}), (LARGE, {})],
        [(LARGE, {}), (SMALL, {})],
    ],
)
def test_the_whole_picture_is_read_and_not_its_thumbnail(parts):
    np.testing.assert_array_equal(decode(written(*parts)), LARGE)


@pytest.mark.parametrize("how", [{}, {"compression": "deflate"}, "lzw"])
def test_a_file_that_is_cut_while_it_is_open_gives_one_sentence(how, tmp_path):
    path, stack = tmp_path / "dock.tif", [noise(np.uint16, 200, 300) for _ in range(3)]
    if how == "lzw":
        cv2.imwritemulti(str(path), stack, [cv2.IMWRITE_TIFF_COMPRESSION, 5])
    else:
        path.write_bytes(written(*((page, how) for page in stack)))
    with path.open("rb") as file:
        opened = pages(file)
        np.testing.assert_array_equal(opened[0].decoded(), stack[0])
        with path.open("r+b") as other:
            other.truncate(path.stat().st_size // 2)
        for page in opened[1:]:
            with pytest.raises(ValueError, match="cut short"):
                page.decoded()
        np.testing.assert_array_equal(opened[0].decoded(), stack[0])


def test_pages_that_are_cut_off_are_named_and_not_left_out():
    data = written(*((page, {}) for page in (LARGE, LARGE + 1, LARGE + 2)))
    with tifffile.TiffFile(io.BytesIO(data)) as file:
        last = file.pages[2].offset
    first, second, lost = pages(data[: last + 20])
    assert first.size == second.size
    with pytest.raises(ValueError, match="cut short"):
        lost.decoded()


@pytest.mark.parametrize("how", [{}, {"tile": (64, 64)}, {"rowsperstrip": 7}], ids=str)
@pytest.mark.parametrize("file_how", [{}, {"bigtiff": True}, {"byteorder": ">"}], ids=str)
def test_opencv_reads_the_page_alone_that_it_is_given(how, file_how):
    levels = noise(np.uint8, 60, 80)
    palette = np.tile(np.arange(256, dtype=np.uint16)[::-1] * 257, (3, 1))  # white is 0
    file = io.BytesIO()
    with tifffile.TiffWriter(file, **file_how) as writer:
        for page in (levels, levels[::-1]):
            writer.write(page, metadata=None, photometric="palette", colormap=palette, **how)
    for page, wanted in zip(pages(file.getvalue()), (levels, levels[::-1]), strict=True):
        np.testing.assert_array_equal(page.decoded(), np.dstack(3 * [255 - wanted]))


def test_pictures_without_pages_of_their_own_are_refused():
    for is_imagej in (True, False):
        file = io.BytesIO()
        stack = noise(np.uint16, 3, 6, 8)
        tifffile.imwrite(file, stack, photometric="minisblack", truncate=True, imagej=is_imagej)
        with pytest.raises(ImageError, match="holds several pictures in one page, as large stacks of ImageJ do"):
            decode(file.getvalue(), "dock.tif")


def test_a_compression_that_is_not_read_is_named():
    file = io.BytesIO()
    Image.fromarray(noise(np.uint8, 60, 80)).save(file, "TIFF", compression="lzma")
    with pytest.raises(ImageError, match="is a TIFF of compression LZMA, which is not read"):
        decode(file.getvalue(), "dock.tif")


def test_colours_that_are_none_are_refused_by_name():
    with pytest.raises(ImageError, match="colours of the kind CIELAB, which is not read; save it as grey or RGB"):
        decode(tiff(noise(np.uint8, 6, 8, 3), photometric="cielab"), "dock.tif")
