"""Pictures and cameras in messages of ROS and Foxglove."""

import re
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.formats.described import Described
from dockpose.camera.formats.readers import check_projection
from dockpose.camera.image import ImageError, decode

Size = tuple[int, int]  # width and height in pixels

# Bits and channels of each encoding, and how it becomes BGR or, of one channel, stays grey. OpenCV names a Bayer
# pattern by the second row and column, ROS by the first: ROS's rggb is OpenCV's BG.
_BAYER = {
    "rggb": cv2.COLOR_BAYER_BG2BGR,
    "bggr": cv2.COLOR_BAYER_RG2BGR,
    "gbrg": cv2.COLOR_BAYER_GR2BGR,
    "grbg": cv2.COLOR_BAYER_GB2BGR,
}
_ENCODINGS: dict[str, tuple[int, int, int | None]] = {
    **{name: (bits, 1, None) for bits in (8, 16) for name in (f"mono{bits}", f"{bits}UC1")},
    **{name: (bits, 3, None) for bits in (8, 16) for name in (f"bgr{bits}", f"{bits}UC3")},
    **{f"rgb{bits}": (bits, 3, cv2.COLOR_RGB2BGR) for bits in (8, 16)},
    **{name: (bits, 4, cv2.COLOR_BGRA2BGR) for bits in (8, 16) for name in (f"bgra{bits}", f"{bits}UC4")},
    **{f"rgba{bits}": (bits, 4, cv2.COLOR_RGBA2BGR) for bits in (8, 16)},
    **{f"bayer_{pattern}{bits}": (bits, 1, code) for bits in (8, 16) for pattern, code in _BAYER.items()},
    **{name: (8, 2, cv2.COLOR_YUV2BGR_UYVY) for name in ("yuv422", "uyvy")},
    **{name: (8, 2, cv2.COLOR_YUV2BGR_YUY2) for name in ("yuv422_yuy2", "yuyv")},
}
# The colours' planes, of half the size, follow that of brightness.
_PLANAR = {"nv12": cv2.COLOR_YUV2BGR_NV12, "nv21": cv2.COLOR_YUV2BGR_NV21, "i420": cv2.COLOR_YUV2BGR_I420}
_HALVED = ("yuv422", "uyvy", "yuv422_yuy2", "yuyv", *_PLANAR)  # two pixels share their colours
_FLOATS, _TOP = "32FC1", 65535
# A principal point that is off the middle by more than this share of it, and alike in both directions, is of pictures
# of another size: lenses are off by a few percent, and in any direction.
_MOST_OFF, _ALIKE = 0.15, 0.05


def picture_in(message: Any, name: str = "image") -> np.ndarray:
    """Return the picture of a message, (H, W)."""
    if hasattr(message, "format") and not getattr(message, "encoding", ""):
        if "compressedDepth" in message.format:
            raise ImageError(f"{name}: is a depth picture ({message.format}), which shows no lights")
        try:
            return decode(bytes(memoryview(message.data)), name)
        except ImageError as error:
            raise ImageError(f"{error}; the message says that it is {message.format!r}") from error
    if message.encoding == _FLOATS:
        levels = _rows(message, 4, name).view(">f4" if getattr(message, "is_bigendian", 0) else "<f4")
        if not ((levels >= 0) & (levels <= 1)).all():
            raise ImageError(f"{name}: has floats beyond 0 to 1, as a depth picture, which shows no lights")
        return np.rint(levels * _TOP).astype(np.uint16)
    halved = (message.width, message.height)[: 2 if message.encoding in _PLANAR else 1]
    if message.encoding in _HALVED and any(size % 2 for size in halved):
        size = f"{message.width} x {message.height} pixels"
        raise ImageError(f"{name}: has {size}, which {message.encoding} cannot have")
    if message.encoding in _PLANAR:
        planes = _rows(message, 1, name, message.height * 3 // 2)
        return cv2.cvtColor(planes, _PLANAR[message.encoding])
    if message.encoding not in _ENCODINGS:
        known = ", ".join((*_ENCODINGS, *_PLANAR, _FLOATS))
        raise ImageError(f"{name}: has the encoding {message.encoding!r}; those read are {known}")
    bits, channels, conversion = _ENCODINGS[message.encoding]
    rows = _rows(message, bits // 8 * channels, name)
    levels = rows.view(np.uint8 if bits == 8 else (">u2" if getattr(message, "is_bigendian", 0) else "<u2"))
    pixels = levels.astype(np.uint8 if bits == 8 else np.uint16)  # in the machine's own order, and ours to keep
    if channels > 1:
        pixels = pixels.reshape(message.height, message.width, channels)
    return pixels if conversion is None else cv2.cvtColor(pixels, conversion)


def _rows(message: Any, pixel_bytes: int, name: str, rows: int | None = None) -> np.ndarray:
    """The bytes of a picture's rows, or of so many with those of its colours, without what fills them up."""
    width, height, step = message.width, message.height if rows is None else rows, message.step
    data = np.frombuffer(memoryview(message.data), np.uint8)
    used = width * pixel_bytes
    if width < 1 or height < 1 or step < used or len(data) < step * (height - 1) + used:
        text = f"{name}: says {width} x {height} pixels of {pixel_bytes} bytes in rows of {step}, but has {len(data)}"
        raise ImageError(text)
    # The last row need not be filled up.
    return np.ascontiguousarray(np.lib.stride_tricks.as_strided(data, (height, used), (step, 1)))


# Words of their own in a topic's name by which pictures have no distortion any more: not "corrected", not "direct".
_RECTIFIED = re.compile(r"(?<![a-z])(?<!no_)(?<!no[nt]_)(?<!pre_)(rect|rectif[a-z]+|undist|undistort[a-z]*)(?![a-z])")
_RAW = re.compile(r"(?<![a-z])raw(?![a-z])")


def is_rectified(topic: str) -> bool:
    """Whether pictures are rectified, by the last part of their topic's name that says it: "image_rect/ffmpeg" are."""
    parts = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", topic).lower().split("/")
    says = next((part for part in reversed(parts) if _RECTIFIED.search(part) or _RAW.search(part)), "")
    return bool(_RECTIFIED.search(says))


def camera_in(message: Any, size: Size, tell: Callable[[str], None], is_rectified: bool = False) -> Camera | None:
    """The camera of a message, for the pictures (width, height) beside it; None where it was not calibrated.

    Raises ValueError where it cannot be the camera of pictures of that size.
    """
    K, P, D = (np.array(getattr(message, name, getattr(message, name.lower(), ())), float) for name in "KPD")
    model = message.distortion_model  # a driver that knows none leaves it empty
    if is_rectified and (P.any() or D.any()):
        tell("its pictures are taken as rectified, by the topic's name: with the matrix P and without distortion")
        K, D, model = P.reshape(-1, 4)[:, :3].ravel() if P.size == 12 else P, np.zeros(0), ""
    if not K.any() or K[0] == 0:
        return None
    if K.size != 9:
        raise ValueError(f"its matrix has {K.size} numbers, where it must have 9")
    if not is_rectified and P.any():
        check_projection(P, K.reshape(3, 3), "K")
    whole, matrix = (message.width, message.height), K.reshape(3, 3)
    x, y, *window = _window(message, whole, size, tell)
    _check_middle(matrix, whole, size)
    matrix = matrix - np.array([[0, 0, x], [0, 0, y], [0, 0, 0]])
    return Described(matrix, D.tolist(), (window[0], window[1]), model).camera(None, tell).for_size(*size)


def _window(message: Any, whole: Size, size: Size, tell: Callable[[str], None]) -> tuple[int, int, int, int]:
    """Which part of the sensor the pictures show: x, y, width and height in pixels of the calibration."""
    if not all(whole):
        raise ValueError("it does not say for which pictures it is: width or height is 0")
    full, binning = (0, 0, *whole), tuple(max(1, getattr(message, f"binning_{axis}", 1)) for axis in "xy")
    roi = getattr(message, "roi", None)
    cut = full if roi is None or not (roi.width and roi.height) else (roi.x_offset, roi.y_offset, roi.width, roi.height)
    fitting = [
        (window, bins)
        for window in dict.fromkeys((cut, full))
        for bins in dict.fromkeys((binning, (1, 1)))
        if all(abs(pixels * by - length) < by for pixels, by, length in zip(size, bins, window[2:], strict=True))
    ]
    told = f"{whole[0]} x {whole[1]} pixels"
    told += "" if cut == full else f" with a region of interest of {cut[2]} x {cut[3]}"
    told += "" if binning == (1, 1) else f" binned by {binning[0]} x {binning[1]}"
    if not fitting or (len(fitting) > 1 and fitting[0] != (cut, binning)):
        raise ValueError(f"it is for pictures of {told}, but they have {size[0]} x {size[1]}")
    window = fitting[0][0]
    if fitting[0] != (cut, binning):
        why = "they are taken as not binned" if window == cut else "no region of interest is taken off"
        tell(f"its camera is for {told}, and its pictures have {size[0]} x {size[1]}, so {why}")
    return window


def _check_middle(matrix: np.ndarray, whole: Size, size: Size) -> None:
    """Raise ValueError where a principal point is that of pictures of another size than the camera says."""
    with np.errstate(all="ignore"):  # numbers that are too large are refused later
        middle = matrix[:2, 2] + 0.5
        shares = 2 * middle / whole
        off_whole, off_picture = (np.hypot(*(middle - np.array(each) / 2)) for each in (whole, size))
        is_scaled = abs(shares[0] - shares[1]) < _ALIKE and abs(shares.mean() - 1) > _MOST_OFF
    if is_scaled or 2 * off_picture < off_whole:
        at = f"its principal point ({matrix[0, 2]:.1f}, {matrix[1, 2]:.1f}) is that of pictures of about"
        raise ValueError(f"{at} {2 * middle[0]:.0f} x {2 * middle[1]:.0f} pixels, but it says {whole[0]} x {whole[1]}")
