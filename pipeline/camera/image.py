"""Image decoding, and what every later stage works on: a grey image and its 8-bit levels."""

from __future__ import annotations

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from dockpose.camera.yaml_file import FileError, read_small
from dockpose.checks import InputError
from PIL import Image, UnidentifiedImageError

MAX_PIXELS = 100_000_000
# Of the decoded picture; decoding needs twice as much memory, and some two seconds.
_MAX_BYTES = 200_000_000
_STRIP_PIXELS = 500_000  # of which the alpha channel is applied at once
_SIGNIFICANT_BITS = (10, 12, 14, 16)


class ImageError(InputError):
    """A file or an array that is not a usable picture; the text names it and says why."""


def read(path: str | Path) -> np.ndarray:
    """Read and decode a picture file; see :func:`decode`.

    Raises
    ------
    ImageError
        If the file cannot be read or decoded.
    """
    return decode(read_picture_file(path), str(path))


def read_picture_file(path: str | Path) -> bytes:
    """Return the bytes of a regular file that is no larger than a picture that is read can be.

    Raises
    ------
    ImageError
        If it cannot be read, is no regular file, or is larger.
    """
    try:
        return read_small(path, 2 * _MAX_BYTES)
    except FileError as error:
        raise ImageError(str(error)) from error


def decode(data: bytes, name: str = "image") -> np.ndarray:
    """Decode the bytes of a picture file (PNG, JPEG, TIFF, BMP, WebP, PNM).

    Parameters
    ----------
    data : bytes
        Contents of the file.
    name : str
        What to call it in an error.

    Returns
    -------
    (H, W) grey or (H, W, 3) BGR array, uint8 or uint16
        The picture; transparent pixels are blended onto black.

    Raises
    ------
    ImageError
        If the file is empty, not a picture, cut short, neither 8 nor 16 bit, or has more than 100 megapixels or 200 MB
        of them (judged by its header, before anything is decoded).
    """
    if not data:
        raise ImageError(f"{name}: the file is empty (0 bytes)")
    width, height, pixel_bytes = _size_from_header(data, name)
    if width * height > MAX_PIXELS:
        raise ImageError(
            f"{name}: the picture is {width} x {height}, {width * height / 1e6:.0f} megapixels; "
            f"at most {MAX_PIXELS // 1_000_000} are read"
        )
    if width * height * pixel_bytes > _MAX_BYTES:
        raise ImageError(
            f"{name}: the picture is {width} x {height} with {pixel_bytes} bytes a pixel, "
            f"{width * height * pixel_bytes / 1e6:.0f} MB; at most {_MAX_BYTES // 1_000_000} are read"
        )
    image = None
    if not _is_cut_short(data):  # OpenCV sets memory aside for as much as a damaged PNG says that follows
        with contextlib.suppress(cv2.error):
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise ImageError(f"{name}: the picture is damaged or cut short ({len(data)} bytes)")
    return _check(_without_alpha(image), name)


def to_grey(image: Any) -> np.ndarray:
    """Convert a picture to grey, weighing colours as ITU-R BT.601 does (0.299 R + 0.587 G + 0.114 B).

    Parameters
    ----------
    image : (H, W) grey, (H, W, 3) BGR or (H, W, 4) BGRA array_like, uint8 or uint16
        The picture.

    Returns
    -------
    (H, W) array, uint8 or uint16
        The grey picture.

    Raises
    ------
    ImageError
        If it is any other array.
    """
    array = _check(_without_alpha(np.asarray(image)), "image")
    return array if array.ndim == 2 else cv2.cvtColor(array, cv2.COLOR_BGR2GRAY)


def significant_bits(grey: np.ndarray) -> int:
    """Number of bits used: 8 for uint8; for uint16 the smallest of 10, 12, 14 and 16 that holds the picture's maximum.

    Cameras store 10- and 12-bit pictures in 16-bit files; their levels would otherwise crowd into the lowest few.
    """
    if grey.dtype == np.uint8:
        return 8
    largest = int(grey.max())
    return next(bits for bits in _SIGNIFICANT_BITS if largest < 1 << bits)


def to_levels(grey: np.ndarray) -> tuple[np.ndarray, int]:
    """Reduce a grey picture to 256 equal levels (uint8); also return how many native grey steps one level holds."""
    shift = significant_bits(grey) - 8
    return (grey, 1) if shift == 0 else ((grey >> shift).astype(np.uint8), 1 << shift)


def _size_from_header(data: bytes, name: str) -> tuple[int, int, int]:
    """Width, height and bytes of a decoded pixel."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data)) as header:
                is_deep = header.mode.startswith(("I", "F")) or (data.startswith(b"\x89PNG") and data[24] == 16)
                channels = 3 if header.mode == "P" else len(header.getbands())
                return *header.size, channels * (2 if is_deep else 1)
    except UnidentifiedImageError as error:
        raise ImageError(f"{name}: is not a picture that can be read (PNG, JPEG, TIFF, BMP, WebP, PNM)") from error
    except Image.DecompressionBombError as error:
        at_most = MAX_PIXELS // 1_000_000
        raise ImageError(f"{name}: the picture has far more than the {at_most} megapixels that are read") from error
    except Exception as error:  # Pillow's readers raise many kinds on damaged headers
        raise ImageError(f"{name}: the picture's header is damaged or cut short ({error})") from error


def _is_cut_short(data: bytes) -> bool:
    """Whether a PNG or JPEG file lacks its end; before 4.11, OpenCV gave out what there was of such a picture."""
    if data.startswith(b"\x89PNG"):
        start = 8
        while (kind := data[start + 4 : start + 8]) not in (b"", b"IEND"):
            start += 12 + int.from_bytes(data[start : start + 4], "big")
        return kind == b""
    if not data.startswith(b"\xff\xd8"):
        return False
    start = 2  # of each segment before the scan; a thumbnail in one of them has an end of its own
    while data[start : start + 1] == b"\xff" and data[start + 1 : start + 2] != b"\xda":
        start += 2 + int.from_bytes(data[start + 2 : start + 4], "big")
    return b"\xff\xd9" not in data[start:]


def _without_alpha(image: np.ndarray) -> np.ndarray:
    if image.ndim == 3 and image.shape[2] == 1:
        return image[:, :, 0]
    if image.ndim != 3 or image.shape[2] != 4 or image.dtype not in (np.uint8, np.uint16):
        return image
    opaque = np.iinfo(image.dtype).max
    if (image[:, :, 3] == opaque).all():
        return np.ascontiguousarray(image[:, :, :3])
    blended = np.empty((*image.shape[:2], 3), image.dtype)
    rows = max(1, _STRIP_PIXELS // image.shape[1])
    for top in range(0, len(image), rows):
        strip = image[top : top + rows].astype(np.uint32)  # holds 65,535 squared
        blended[top : top + rows] = (strip[:, :, :3] * strip[:, :, 3:] + opaque // 2) // opaque
    return blended


def _check(image: np.ndarray, name: str) -> np.ndarray:
    if image.dtype not in (np.uint8, np.uint16):
        raise ImageError(f"{name}: pixels are {image.dtype}; they must be 8 or 16 bit (uint8 or uint16)")
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3) or image.size == 0:
        raise ImageError(
            f"{name}: has shape {image.shape}; it must be grey (H, W), BGR (H, W, 3) or BGRA (H, W, 4), not empty"
        )
    return image
