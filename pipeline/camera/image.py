"""Image decoding, and what every later stage works on: a grey image and its 8-bit levels."""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any, BinaryIO

import cv2
import numpy as np
from dockpose.camera import mark, tiff
from dockpose.camera.stills import as_meant, is_cut_short, is_many, name_of
from dockpose.files import FileError, read_small
from dockpose.text import InputError
from PIL import ExifTags, Image, UnidentifiedImageError

MAX_PIXELS = 100_000_000
# Of the decoded picture; decoding needs twice as much memory, and some two seconds.
_MAX_BYTES = 200_000_000
_STRIP_PIXELS = 500_000  # of which the alpha channel is applied at once
_SIGNIFICANT_BITS = (10, 12, 14, 16)
# All that Pillow tries, which knows many more formats, some of which take long; TIFF for its tags alone.
_FORMATS = ("JPEG", "PNG", "GIF", "PPM", "BMP", "WEBP", "TIFF")  # first those that Pillow loads at once
_DEFECTS = 0.01  # of a picture's pixels; more are no defects of a sensor, of which one in 1,000 is a bad one
_SPREAD = 1 / 8  # of a light's height, which its neighbours have at least, however sharp the lens
_ANIMATED = ("GIF", "WEBP", "PNG")  # as Pillow names them; the further pictures of a JPEG are its previews
# EXIF's numbers of orientations: how a picture lies, and how far to turn it clockwise, where that sets it upright.
_OVER = "mirrored and on its side", None
_ORIENTATIONS: dict[int, tuple[str, int | None]] = {0: ("askew", None), 2: ("mirrored", None), 3: ("upside down", 180)}
_ORIENTATIONS |= {4: ("mirrored and upside down", None), 5: _OVER, 6: ("on its side", 90), 7: _OVER}
_ORIENTATIONS |= {8: ("on its side", 270)}
_PNG_WITH_TAGS = (b"eXIf", b"XML:com.adobe.xmp", b"Raw profile type")  # else Pillow decodes all of it to look for them


class ImageError(InputError):
    """A file or an array that is not a usable picture; the text names it and says why."""


def read(path: str | Path) -> np.ndarray:
    """Read and decode a picture file; see :func:`decode`."""
    return decode(read_picture_file(path), str(path))


def read_picture_file(path: str | Path) -> bytes:
    """Return the bytes of a regular file that is no larger than a picture that is read can be."""
    try:
        return read_small(path, 2 * _MAX_BYTES)
    except FileError as error:
        raise ImageError(str(error)) from error


def decode(data: bytes, name: str = "image") -> np.ndarray:
    """Decode the bytes of a picture file (PNG, JPEG, TIFF, BMP, GIF, WebP, PNM). Returns (H, W) in pixels."""
    if not data:
        raise ImageError(f"{name}: the file is empty (0 bytes)")
    if tiff.is_tiff(data):
        pages = tiff_pages(data, name)
        if len(pages) > 1:
            raise ImageError(f"{name}: has {len(pages)} pages, which are a sequence; open it by itself, like a video")
        return decode_page(pages[0], name)
    if what := name_of(data):
        raise ImageError(f"{name}: is {what}")
    is_gif = _is_gif(data, name)
    if mark.is_drawn(data):
        raise ImageError(mark.refusal(name))
    if is_gif:  # not read by OpenCV before 4.11
        with opened_quietly(io.BytesIO(data)) as picture:
            return _of_pillow(picture, name)
    # OpenCV sets memory aside for as much as a damaged PNG says that follows.
    image = None if is_cut_short(data) else _decoded(data)
    if image is None:
        raise ImageError(f"{name}: the picture is damaged or cut short ({len(data)} bytes)")
    if is_many(data, image.nbytes):
        text = f"{name}: holds several pictures, one after another; save each in a file of its own, or JPEGs as .mjpeg"
        raise ImageError(text)
    image = as_meant(image, data)
    return as_picture(image, name)


def tiff_pages(data: bytes | BinaryIO, name: str) -> list[tiff.Page]:
    """The pages of a TIFF, of bytes or an open file. Raises ImageError, by ``name``, if it is damaged or raw."""
    try:
        return tiff.pages(data)
    except ValueError as error:
        raise ImageError(f"{name}: {error}") from error


def decode_page(page: tiff.Page, name: str) -> np.ndarray:
    """Decode one page of a TIFF as :func:`decode` does; its errors too."""
    check_size(*page.size, name)
    try:
        image = page.decoded()
    except ValueError as error:
        raise ImageError(f"{name}: {error}") from error
    return as_picture(image, name)


def _of_pillow(picture: Image.Image, name: str) -> np.ndarray:
    """A picture of Pillow (H, W, 3) as uint8 BGR; transparent pixels are blended onto black."""
    try:
        return _without_alpha(cv2.cvtColor(np.asarray(picture.convert("RGBA")), cv2.COLOR_RGBA2BGRA))
    except Exception as error:  # Pillow's readers raise many kinds on damaged files
        raise ImageError(f"{name}: the picture is damaged or cut short ({error})") from error


def orientation_sentence(tag: int, name: str) -> str:
    """Sentence that names a tag of orientation by its number in EXIF, 0 for others; empty for 1, which is upright."""
    if tag not in _ORIENTATIONS:
        return ""
    how, degrees = _ORIENTATIONS[tag]
    turn = f"; --rotate {degrees} (in Python Camera.rotated) turns picture and camera together" if degrees else ""
    number = f" {tag}" if tag else ""
    return f"{name}: its orientation tag{number} says that it lies {how}; pixels stay as the sensor has them{turn}"


def orientation_of(data: bytes) -> int:
    """EXIF's number of the orientation, 1 to 8, of a picture's file; 1 where it has none."""
    try:
        if tiff.is_tiff(data):
            tag = tiff.pages(data)[0].orientation
        elif data.startswith(b"\x89PNG") and not any(mark in data for mark in _PNG_WITH_TAGS):
            return 1
        else:
            with opened_quietly(io.BytesIO(data)) as picture:
                tag = picture.getexif().get(ExifTags.Base.Orientation, 1)
    except Exception:  # damaged tags, for which Pillow raises many kinds of errors
        return 1
    return tag if tag in _ORIENTATIONS and tag else 1


def turned(image: np.ndarray, degrees: int) -> np.ndarray:
    """A picture (H, W, ...) turned clockwise by 0, 90, 180 or 270 degrees; see :meth:`Camera.rotated`."""
    return np.ascontiguousarray(np.rot90(image, -degrees // 90)) if degrees else image


def to_grey(image: Any) -> np.ndarray:
    """Convert a picture (H, W, ...) to grey (H, W), by the weights of ITU-R BT.601."""
    array = as_picture(image)
    return array if array.ndim == 2 else cv2.cvtColor(array, cv2.COLOR_BGR2GRAY)


def darkest_channel(image: np.ndarray) -> np.ndarray | None:
    """The least of a colour picture's channels (H, W), high where light is white; None for a picture without colours.

    A lamp that saturates the sensor is white, while its glow, and what it lights up, keep a colour.
    """
    if image.ndim == 2:
        return None
    blue, green, red = cv2.split(image)[:3]
    least = cv2.min(cv2.min(blue, green), red)
    return None if np.array_equal(least, cv2.max(cv2.max(blue, green), red)) else least


def significant_bits(image: np.ndarray) -> int:
    """Bits used: 8 of uint8; of uint16 the fewest of 10, 12, 14 and 16 that hold all but hot pixels (H, W, ...)."""
    if image.dtype == np.uint8:
        return 8
    grey = image if image.ndim == 2 else image.max(axis=2)
    largest = int(grey.max())
    return next(bits for bits in _SIGNIFICANT_BITS if largest < 1 << bits or _are_defects(grey, 1 << bits))


def without_defects(grey: np.ndarray) -> np.ndarray:
    """A grey picture (H, W) in which nothing is above what its significant bits hold."""
    top = (1 << significant_bits(grey)) - 1
    return grey if grey.dtype == np.uint8 or grey.max() <= top else np.minimum(grey, np.array(top, grey.dtype))


def _are_defects(grey: np.ndarray, least: int) -> bool:
    """Whether all pixels (H, W) of at least a level are hot ones: few, and each alone, as no lens draws a light.

    A light stands in its neighbours as well. Two hot pixels side by side are chance; three lights of two are not.
    """
    above = grey >= least
    if np.count_nonzero(above) > _DEFECTS * grey.size:
        return False
    ys, xs = np.nonzero(above)
    padded = np.pad(grey, 1)
    around = np.sort([padded[ys + y, xs + x] for y in range(3) for x in range(3) if (y, x) != (1, 1)], axis=0)
    water = around[3].astype(float)
    stands = np.count_nonzero(around >= water + _SPREAD * (grey[ys, xs] - water), axis=0)
    return bool(stands.max() < 2 and np.count_nonzero(stands) < 3)


def to_levels(grey: np.ndarray) -> tuple[np.ndarray, int]:
    """Reduce a grey picture to 256 equal levels (uint8); also return how many native grey steps one level holds."""
    shift = significant_bits(grey) - 8
    return (grey, 1) if shift == 0 else (np.minimum(grey >> shift, 255).astype(np.uint8), 1 << shift)


def check_size(width: int, height: int, pixel_bytes: int, name: str) -> None:
    """Raise ImageError for a picture that would take too much memory."""
    about, pixels, most = f"{name}: the picture is {width} x {height}", width * height, MAX_PIXELS // 1_000_000
    if pixels > MAX_PIXELS:
        raise ImageError(f"{about}, {pixels / 1e6:.0f} megapixels; at most {most} are read")
    if pixels * pixel_bytes > _MAX_BYTES:
        size = f"{about} with {pixel_bytes} bytes a pixel, {pixels * pixel_bytes / 1e6:.0f} MB"
        raise ImageError(f"{size}; at most {_MAX_BYTES // 1_000_000} are read")


def _is_gif(data: bytes, name: str) -> bool:
    """Whether a picture is a GIF; ImageError for an animation, and where the header is damaged, or says too much."""
    try:
        with opened_quietly(io.BytesIO(data)) as header:
            is_deep = header.mode.startswith(("I", "F")) or (data.startswith(b"\x89PNG") and data[24] == 16)
            channels = 3 if header.mode == "P" else len(header.getbands())
            check_size(*header.size, channels * (2 if is_deep else 1), name)
            if header.format in _ANIMATED and getattr(header, "is_animated", False):
                raise ImageError(f"{name}: is an animation; convert it to a video, as MP4, or to pictures")
            return header.format == "GIF"
    except ImageError:
        raise
    except UnidentifiedImageError as error:
        if data.startswith(b"\xff\xd8"):
            raise ImageError(f"{name}: is a JPEG without loss or of 12 bits, or damaged; save it as PNG") from error
        raise ImageError(f"{name}: is not a picture that can be read (PNG, JPEG, TIFF, BMP, GIF, WebP, PNM)") from error
    except Image.DecompressionBombError as error:
        at_most = MAX_PIXELS // 1_000_000
        raise ImageError(f"{name}: the picture has far more than the {at_most} megapixels that are read") from error
    except Exception as error:  # Pillow's readers raise many kinds on damaged headers
        raise ImageError(f"{name}: the picture's header is damaged or cut short ({error})") from error


def opened_quietly(source: io.BytesIO) -> Image.Image:
    """Open a picture of a format that we read with Pillow, without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        Image.preinit()  # else it loads all of its fifty formats to look for ours
        return Image.open(source, formats=_FORMATS)


def _decoded(data: bytes) -> np.ndarray | None:
    """What OpenCV makes of a file; None where it cannot be read."""
    with contextlib.suppress(cv2.error):
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    return None


def _without_alpha(image: np.ndarray) -> np.ndarray:
    if image.ndim == 3 and image.shape[2] == 1:
        return image[:, :, 0]
    if image.ndim != 3 or image.shape[2] != 4:
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


def _conversion(array: np.ndarray) -> str:
    """What makes a picture of an array of whole numbers or bool, for a message."""
    if array.dtype.kind == "b":
        return ", as 255 * image.astype(np.uint8)"
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 65535:
        return ""
    return f", as image.astype(np.uint{8 if array.max() < 256 else 16})"


def as_picture(image: Any, name: str = "image") -> np.ndarray:
    """Return an array as a picture. ``image`` (H, W); returns (H, W) in pixels."""
    if type(image) is not np.ndarray and np.ma.is_masked(image):  # which NumPy loads when it is asked
        raise ImageError(f"{name}: has masked pixels; say what they are, as by image.filled(0)")
    array = np.asarray(image)
    if array.ndim not in (2, 3) or array.shape[2:] not in ((), (1,), (3,), (4,)) or array.size == 0:
        text = f"{name}: has shape {array.shape}; it must be grey (H, W), BGR (H, W, 3) or BGRA (H, W, 4), not empty"
        raise ImageError(text)
    if array.dtype.kind == "f":
        least, most = float(array.min()), float(array.max())
        if not (least >= 0 and most <= 1):
            there = "not all numbers" if np.isnan(least) else f"from {least:g} to {most:g}"
            raise ImageError(f"{name}: pixels are {array.dtype}, {there}; floats must be from 0 to 1")
        array = np.rint(array * np.float64(65535)).astype(np.uint16)
    if array.shape[2:] == (4,) and not array[:, :, 3].any():
        raise ImageError(f"{name}: is transparent everywhere (its alpha channel is 0); save it without alpha")
    if array.dtype.kind != "u" or array.dtype.itemsize > 2:
        wanted = "8 or 16 bit (uint8 or uint16), or floats from 0 to 1"
        raise ImageError(f"{name}: pixels are {array.dtype}; they must be {wanted}{_conversion(array)}")
    return _without_alpha(array.astype(array.dtype.newbyteorder("="), copy=False))
