"""TIFF files page by page: tifffile reads their tags and plain pixels, OpenCV what is compressed in other ways."""

import contextlib
import io
import logging
import math
import struct
import threading
import zlib
from dataclasses import dataclass
from typing import Any, BinaryIO

import cv2
import numpy as np

_HEADS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_MAX_PAGES = 100_000
_ORIENTATION, _MAKE, _DNG_VERSION = 274, 271, 50706
_RAW = (32803, 34892)  # a sensor's mosaic of colours, and colours before they are balanced
_NO_PICTURE = 1 | 4  # bits of the page's kind: a smaller version of another page, or its mask
_STORED, _DEFLATED = 1, (8, 32946)  # compressions that tifffile reads without its codecs
_COMPRESSIONS = (_STORED, *_DEFLATED, 2, 3, 4, 5, 7, 32773)  # OpenCV reads fax, LZW, JPEG and PackBits too
_PREDICTORS = (1, 2)  # none, and the difference to the pixel before
_WHITE_IS_0, _BLACK_IS_0, _RGB, _SEPARATE, _UNASSOCIATED = 0, 1, 2, 2, 2
_BY_OPENCV = (_WHITE_IS_0, _BLACK_IS_0, _RGB, 3, 5, 6)  # palettes, CMYK and YCbCr as well
# What says how packed pixels are meant: their size, bits, colours, predictor, palette, tiles, fax, JPEG and YCbCr tags.
_TAGS = {*range(256, 260), 262, 266, 277, 278, 284, 292, 293, 317, *range(320, 324), 338, 339, 347, 529, 530, 531, 532}
_SLACK_BYTES = 1 << 20  # of pixels that were packed, which may make them more

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # of damage one sentence is enough


class _RefusedError(ValueError):
    """A page that is not read, with a sentence that says why."""


def is_tiff(data: bytes) -> bool:
    """Whether bytes begin like a TIFF."""
    return data[:4] in _HEADS


@dataclass(frozen=True)
class Page:
    """One picture of a TIFF that tifffile has open. It is read, not mapped: a file may be cut short meanwhile."""

    file: Any
    lock: threading.Lock  # tifffile seeks
    offset: int  # of its tags in the file
    size: tuple[int, int, int]  # width and height in pixels, and bytes of a decoded pixel: its colours, and its opacity
    orientation: int  # EXIF's number of how it lies, 1 for upright

    def decoded(self) -> np.ndarray:
        """Its pixels, (H, W), (H, W, 3) BGR or (H, W, 4) BGRA. Raises ValueError where they cannot be read."""
        try:
            with self.lock:
                page = _page_at(self.file, self.offset)
                _check(page)
                if _is_plain(page):
                    return _as_opencv(page, page.asarray(maxworkers=1))
                data = _alone(page)
            return _by_opencv(page, data)
        except _RefusedError:
            raise
        except Exception as error:  # tifffile raises many kinds on damaged files
            raise ValueError("the picture is damaged or cut short") from error


def pages(data: bytes | BinaryIO) -> list[Page]:
    """The pictures of a TIFF or BigTIFF, no smaller versions or masks; ValueError where there are none to be read."""
    import tifffile  # seldom needed, and takes a while

    found, lock, seen, offset = list[Page](), threading.Lock(), set[int](), 0
    stream = io.BytesIO(data) if isinstance(data, bytes) else data
    stream.seek(0)
    try:
        file: Any = tifffile.TiffFile(stream, is_lsm=False, is_ndpi=False, is_scanimage=False)
        ahead = [file.pages[0].offset]
        while ahead and len(found) < _MAX_PAGES:
            if (offset := ahead.pop()) in seen:
                continue
            seen.add(offset)
            page = _page_at(file, offset)
            _refuse_raw(page, file)
            pixel_bytes = int(page.samplesperpixel) * ((int(np.max(page.bitspersample)) + 7) // 8)
            size = int(page.imagewidth), int(page.imagelength) * int(page.imagedepth), pixel_bytes
            if not int(page.subfiletype) & _NO_PICTURE:
                found.append(Page(file, lock, offset, size, page.tags.valueof(_ORIENTATION, default=1)))
            ahead += [*filter(None, [_next_offset(file, offset)]), *reversed(page.subifds or ())]
    except _RefusedError:
        raise
    except Exception as error:  # many kinds on damaged files
        if not found:
            length = stream.seek(0, io.SEEK_END)
            raise ValueError(f"the TIFF has no picture, or is damaged or cut short ({length} bytes)") from error
        if len(found) > 1:  # else what says where another one is may be anything
            found.append(Page(found[0].file, lock, offset, (0, 0, 0), 1))  # is named when it is due
    if not found:
        raise _RefusedError("holds nothing but a smaller version of a picture, or its mask; open the picture itself")
    if len(found) == 1 and _is_stack(found[0].file):
        raise _RefusedError("holds several pictures in one page, as large stacks of ImageJ do; save each as a page")
    width, height = (max(page.size[axis] for page in found) for axis in (0, 1))
    # Not all programs mark thumbnails and pyramids.
    return [page for page in found if 0 in page.size or 2 * page.size[0] > width or 2 * page.size[1] > height]


def _page_at(file: Any, offset: int) -> Any:
    """The page whose tags stand at an offset of a file."""
    import tifffile

    file.filehandle.seek(offset)
    return tifffile.TiffPage(file, index=0)


def _is_stack(file: Any) -> bool:
    """Whether the only page of a file is followed by pictures without tags, as its description says."""
    with contextlib.suppress(Exception):  # many kinds on descriptions that are not as they seem
        return bool((file.is_imagej or file.is_shaped) and file.series[0].is_truncated)
    return False


def _next_offset(file: Any, offset: int) -> int:
    """Where the tags of the page after that at an offset stand; 0 after the last."""
    form = file.tiff
    file.filehandle.seek(offset)
    count = struct.unpack(form.tagnoformat, file.filehandle.read(form.tagnosize))[0]
    file.filehandle.seek(offset + form.tagnosize + count * form.tagsize)
    return struct.unpack(form.offsetformat, file.filehandle.read(form.offsetsize))[0]


def _refuse_raw(page: Any, file: Any) -> None:
    """Refuse the files of a camera's sensor, in which small pictures for display stand first."""
    file.filehandle.seek(8)
    is_canon, is_dng = file.filehandle.read(2) == b"CR", _DNG_VERSION in page.tags
    if page.photometric in _RAW or is_dng or is_canon:
        maker = str(file.pages[0].tags.valueof(_MAKE, default="")).strip()
        kind = "DNG" if is_dng else "CR2" if is_canon else maker or "CFA"
        raise _RefusedError(f"is a raw picture of a camera ({kind}); convert it to TIFF or PNG")


def _check(page: Any) -> None:
    """Refuse a page of a kind that is not read, without all its bytes, or with more packed in them than it is large."""
    bits, samples, is_plain = page.bitspersample, page.samplesperpixel, _is_plain(page)
    colours, separate = page.photometric, samples > 1 and page.planarconfig == _SEPARATE and not is_plain
    if samples == 2 or page.imagedepth > 1:
        what = "grey with opacity" if samples == 2 else "of a volume"
    elif colours not in _BY_OPENCV or (colours == _WHITE_IS_0 and bits > 8 and bits != 16):
        what = f"of {bits} bits with colours of the kind {_name(colours)}"
    elif page.compression not in _COMPRESSIONS or (separate and (bits != 8 or colours != _RGB)):
        what = f"{'with separate planes and' if separate else 'of'} compression {_name(page.compression)}"
    else:
        what = ""
    if what:
        text = f"is a TIFF {what}, which is not read; save it as grey or RGB of 8 or 16 bits, without compression"
        raise _RefusedError(text)
    places, sizes, most = page.dataoffsets, page.databytecounts, math.prod(page.chunks) * page.dtype.itemsize
    if not len(places) == len(sizes) == math.prod(page.chunked) or min(*places, *sizes) < 1:
        raise _RefusedError("the TIFF's header is damaged or cut short: it does not say where its pixels are")
    end, stored = max(place + size for place, size in zip(places, sizes, strict=True)), sum(sizes)
    _bytes_at(page, end - 1, 1)
    if is_plain and page.compression == _STORED and stored < page.nbytes:
        raise _RefusedError(f"the picture is cut short ({stored} bytes of {page.nbytes})")
    if stored > 2 * most * len(sizes) + _SLACK_BYTES:
        raise _RefusedError("the picture is damaged: more is packed in it than it is large")
    if is_plain and page.compression in _DEFLATED:  # without its codecs tifffile unpacks whatever is there
        for place, size in zip(places, sizes, strict=True):
            if len(zlib.decompressobj().decompress(_bytes_at(page, place, size), most + 1)) > most:
                raise _RefusedError("the picture is damaged: more is packed in it than it is large")


def _bytes_at(page: Any, place: int, size: int) -> bytes:
    page.parent.filehandle.seek(place)
    data = page.parent.filehandle.read(size)
    if len(data) < size:
        raise _RefusedError(f"the picture is cut short: the file ends before byte {place + size}")
    return data


def _alone(page: Any) -> bytes:
    """A TIFF that has one page alone, its pixels packed as they are: OpenCV would want all of a file."""
    import tifffile

    order, is_big = page.parent.byteorder, page.parent.is_bigtiff
    width, count, word, kind = (8, "Q", "Q", 16) if is_big else (4, "H", "I", 4)
    tags = {}
    for tag in page.tags:
        if tag.code in _TAGS:
            size = tag.count * struct.calcsize("=" + tifffile.TIFF.DATA_FORMATS[tag.dtype])
            tags[tag.code] = int(tag.dtype), tag.count, _bytes_at(page, tag.valueoffset, size)
    out, places = bytearray(_bytes_at(page, 0, 2 * width)), list[int]()
    for place, size in zip(page.dataoffsets, page.databytecounts, strict=True):
        places.append(len(out))
        out += _bytes_at(page, place, size)
    for code, values in zip((324, 325) if page.is_tiled else (273, 279), (places, page.databytecounts), strict=True):
        tags[code] = kind, len(values), struct.pack(f"{order}{len(values)}{word}", *values)
    entries = b""
    for code, (kind, number, value) in sorted(tags.items()):
        if len(value) > width:
            place, value = len(out), struct.pack(order + word, len(out))
            out += tags[code][2]
        entries += struct.pack(f"{order}HH{word}{width}s", code, kind, number, value)
    struct.pack_into(order + word, out, width, len(out))
    return bytes(out + struct.pack(order + count, len(tags)) + entries + bytes(width))


def _by_opencv(page: Any, data: bytes) -> np.ndarray:
    """Pixels of a page that OpenCV decodes; in 8 bits it applies opacity, and takes white as the most."""
    pixels: Any = None
    with contextlib.suppress(cv2.error):
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise _RefusedError(f"the picture is damaged or cut short (its compression is {_name(page.compression)})")
    if pixels.dtype == np.uint8:
        return _opaque(pixels)
    if page.photometric == _WHITE_IS_0:
        pixels = np.iinfo(pixels.dtype).max - pixels
    return pixels if page.extrasamples[:1] == (_UNASSOCIATED,) else _opaque(pixels)


def _is_plain(page: Any) -> bool:
    """Whether tifffile reads a page without its codecs: grey, or red, green and blue, in whole bytes."""
    is_colour = page.photometric == _RGB and page.samplesperpixel in (3, 4)
    is_grey = page.photometric in (_WHITE_IS_0, _BLACK_IS_0) and page.samplesperpixel == 1
    is_whole = page.bitspersample in (8, 16, 32, 64) and page.dtype is not None and page.imagedepth == 1
    is_read = page.compression in (_STORED, *_DEFLATED) and page.predictor in _PREDICTORS
    return (is_colour or is_grey) and is_whole and is_read


def _as_opencv(page: Any, pixels: np.ndarray) -> np.ndarray:
    """A page's numbers with its colours last, in OpenCV's order, and without opacity that is applied already."""
    if page.photometric != _RGB:
        return np.iinfo(pixels.dtype).max - pixels if page.photometric == _WHITE_IS_0 else pixels
    last = np.moveaxis(pixels, 0, 2) if page.planarconfig == _SEPARATE else pixels
    bgr = np.ascontiguousarray(last[:, :, [2, 1, 0, 3][: last.shape[2]]])
    return bgr if page.extrasamples[:1] == (_UNASSOCIATED,) else _opaque(bgr)


def _opaque(pixels: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(pixels[:, :, :3]) if pixels.ndim == 3 and pixels.shape[2] == 4 else pixels


def _name(number: Any) -> str:
    """Name of one of tifffile's numbers of colours and compressions."""
    return getattr(number, "name", str(number))
