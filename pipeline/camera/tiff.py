"""TIFF files page by page: tifffile reads their tags and plain pixels, OpenCV what is compressed in other ways."""

import contextlib
import io
import logging
import math
import struct
import threading
import zlib
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

_HEADS = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_MAX_PAGES = 100_000
_ORIENTATION = 274
_NO_PICTURE = 1 | 4  # bits of the page's kind: a smaller version of another page, or its mask
_STORED, _DEFLATED = 1, (8, 32946)  # compressions that tifffile reads without its codecs
_PREDICTORS = (1, 2)  # none, and the difference to the pixel before
_WHITE_IS_0, _BLACK_IS_0, _RGB, _SEPARATE, _UNASSOCIATED = 0, 1, 2, 2, 2

logging.getLogger("tifffile").addHandler(logging.NullHandler())  # of damage one sentence is enough


class _RefusedError(ValueError):
    """A page that is not read, with a sentence that says why."""


def is_tiff(data: Any) -> bool:
    """Whether bytes begin like a TIFF."""
    return data[:4] in _HEADS


@dataclass(frozen=True)
class Page:
    """One picture of a TIFF: its number in a file, of bytes or a private map of them, that tifffile has open."""

    data: Any
    file: Any
    lock: threading.Lock  # tifffile seeks
    index: int
    size: tuple[int, int, int]  # width and height in pixels, and bytes of a decoded pixel: its colours, and its opacity
    orientation: int  # EXIF's number of how it lies, 1 for upright

    def decoded(self) -> np.ndarray:
        """Its pixels, (H, W), (H, W, 3) BGR or (H, W, 4) BGRA. Raises ValueError where they cannot be read."""
        try:
            with self.lock:
                page = self.file.pages[self.index]
                _check(page, self.data)
                if _is_plain(page):
                    return _as_opencv(page, page.asarray(maxworkers=1))
            return self._by_opencv(page)
        except _RefusedError:
            raise
        except Exception as error:  # tifffile raises many kinds on damaged files
            raise ValueError("the picture is damaged or cut short") from error

    def _by_opencv(self, page: Any) -> np.ndarray:
        """Pixels of a page that OpenCV decodes; in 8 bits it applies opacity, and takes white as the most."""
        data = bytearray(self.data) if isinstance(self.data, bytes) else self.data
        place, form = (8, "Q") if self.file.is_bigtiff else (4, "I")
        pixels: Any = None
        with self.lock, contextlib.suppress(cv2.error):
            struct.pack_into(self.file.byteorder + form, data, place, page.offset)  # OpenCV reads the first page
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        if pixels is None:
            what = "the picture is damaged or cut short, or its compression is not read"
            raise _RefusedError(f"{what} ({_compression(page)})")
        if pixels.dtype == np.uint8:
            return _opaque(pixels)
        if page.photometric == _WHITE_IS_0:
            pixels = np.iinfo(pixels.dtype).max - pixels
        return pixels if page.extrasamples[:1] == (_UNASSOCIATED,) else _opaque(pixels)


def pages(data: Any) -> list[Page]:
    """Pages of a TIFF or BigTIFF, but for smaller versions and masks; ValueError where its header is damaged."""
    import tifffile  # seldom needed, and takes a while

    found, kinds, places = list[Page](), list[int](), set[int]()
    try:
        file: Any = io.BytesIO(data) if isinstance(data, bytes) else data
        file.seek(0)
        file = tifffile.TiffFile(file, is_lsm=False, is_ndpi=False, is_scanimage=False)
        lock = threading.Lock()
        while len(found) < _MAX_PAGES and (page := file.pages[len(found)]).offset not in places:
            places.add(page.offset)
            pixel_bytes = int(page.samplesperpixel) * ((int(np.max(page.bitspersample)) + 7) // 8)
            size = int(page.imagewidth), int(page.imagelength) * int(page.imagedepth), pixel_bytes
            kinds.append(int(page.subfiletype) & _NO_PICTURE)
            found.append(Page(data, file, lock, len(found), size, page.tags.valueof(_ORIENTATION, default=1)))
    except Exception as error:  # IndexError behind the last page, and many kinds on damaged files
        if not found:
            raise ValueError(f"the TIFF has no picture, or is damaged or cut short ({len(data)} bytes)") from error
    return [page for page, kind in zip(found, kinds, strict=False) if not kind] or found[:1]


def _check(page: Any, data: Any) -> None:
    """Refuse a page of a kind that is not read, without all its bytes, or with more packed in them than it is large."""
    bits, samples, is_plain = page.bitspersample, page.samplesperpixel, _is_plain(page)
    if samples == 2 or (page.photometric == _WHITE_IS_0 and bits > 8 and bits != 16):
        what = "grey with opacity" if samples == 2 else f"of {bits} bits with white as 0"
        raise _RefusedError(f"is a TIFF {what}, which is not read; save it as grey of 8 or 16 bits")
    if samples > 1 and page.planarconfig == _SEPARATE and not is_plain and (bits != 8 or page.photometric != _RGB):
        what = f"is a TIFF with separate planes and compression {_compression(page)}"
        raise _RefusedError(f"{what}, which is not read; save it as red, green and blue without compression")
    places, sizes = page.dataoffsets, page.databytecounts
    if not len(places) == len(sizes) == math.prod(page.chunked) or min(*places, *sizes) < 1:
        raise _RefusedError("the TIFF's header is damaged or cut short: it does not say where its pixels are")
    end, stored = max(place + size for place, size in zip(places, sizes, strict=True)), sum(sizes)
    if end > len(data):
        raise _RefusedError(f"the picture is cut short ({len(data)} bytes of {end})")
    if is_plain and page.compression == _STORED and stored < page.nbytes:
        raise _RefusedError(f"the picture is cut short ({stored} bytes of {page.nbytes})")
    if is_plain and page.compression in _DEFLATED:  # without its codecs tifffile unpacks whatever is there
        most = math.prod(page.chunks) * page.dtype.itemsize
        for place, size in zip(places, sizes, strict=True):
            if len(zlib.decompressobj().decompress(data[place : place + size], most + 1)) > most:
                raise _RefusedError("the picture is damaged: more is packed in it than it is large")


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


def _compression(page: Any) -> str:
    return getattr(page.compression, "name", str(page.compression))
