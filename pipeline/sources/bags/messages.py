"""Pictures and cameras in ROS messages."""

from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.formats.readers import Described
from dockpose.camera.image import ImageError, decode

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

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


def picture_in(message: Any, name: str = "image") -> np.ndarray:
    """Return the picture of a message, (H, W)."""
    if not hasattr(message, "encoding"):
        if "compressedDepth" in message.format:
            raise ImageError(f"{name}: is a depth picture ({message.format}), which shows no lights")
        return decode(bytes(memoryview(message.data)), name)
    if message.encoding == _FLOATS:
        levels = _rows(message, 4, name).view(">f4" if message.is_bigendian else "<f4")
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
    levels = rows.view(np.uint8 if bits == 8 else (">u2" if message.is_bigendian else "<u2"))
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
        raise ImageError(
            f"{name}: says {width} x {height} pixels of {pixel_bytes} bytes in rows of {step}, but has {len(data)}"
        )
    # The last row need not be filled up.
    return np.ascontiguousarray(np.lib.stride_tricks.as_strided(data, (height, used), (step, 1)))


def camera_in(message: Any, is_rectified: bool = False) -> Camera | None:
    """Return the camera of a message, for pictures as they were published."""
    names = "kpd" if hasattr(message, "k") else "KPD"  # as ROS 1 spells them
    K, P, D = (np.array(getattr(message, name), float) for name in names)
    matrix = np.reshape(P, (3, 4))[:, :3] if is_rectified else np.reshape(K, (3, 3))
    if matrix[0, 0] == 0:
        return None
    roi = message.roi
    x, y, width, height = roi.x_offset, roi.y_offset, roi.width, roi.height
    if width == 0 or height == 0:  # the whole picture
        x, y, width, height = 0, 0, message.width, message.height
    matrix = matrix.copy()
    matrix[:2, 2] -= (x, y)
    distortion = [] if is_rectified else D.tolist()
    model = "" if is_rectified else message.distortion_model  # a driver that knows none leaves it empty
    return Described(matrix, distortion, (width, height), model).camera(None, lambda note: None)
