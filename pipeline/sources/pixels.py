"""Pixels of a decoded video frame: brightness with all its levels, or colour."""

from functools import lru_cache
from typing import Any

import av
import cv2
import numpy as np

# Formats whose first plane is the brightness, with as many bits as the first component has, from the lowest bit on.
_LUMA_FIRST = ("yuv4", "yuvj4", "yuva4", "gray", "nv12", "nv16", "nv21", "nv24")
# EXIF's numbers, by where a display matrix takes the picture's x axis and its y axis (ISO 14496-12, section 8.3.2).
_ORIENTATIONS = {
    (1, 0, 0, 1): 1,
    (-1, 0, 0, 1): 2,
    (-1, 0, 0, -1): 3,
    (1, 0, 0, -1): 4,
    (0, 1, 1, 0): 5,
    (0, 1, -1, 0): 6,
    (0, -1, -1, 0): 7,
    (0, -1, 1, 0): 8,
}
_FULL_RANGE, _LIMITED_RANGE = 2, 1  # FFmpeg's AVCOL_RANGE_JPEG and AVCOL_RANGE_MPEG


def picture_of(frame: av.VideoFrame, *, grey: bool = False) -> np.ndarray:
    """Return the picture (H, W) or (H, W, 3) that a frame shows, as the sensor has it; see :func:`orientation_of`."""
    name = frame.format.name
    if name.startswith(_LUMA_FIRST) and (grey or name.startswith("gray")):
        return _luma(frame)
    return _converted(frame, grey=grey)


def orientation_of(frame: av.VideoFrame) -> int:
    """How a frame is to be shown, by EXIF's numbers: 1 as it is, 2 to 8 turned or mirrored, 0 askew; not applied."""
    side_data: Any = frame.side_data  # its types say that names alone are taken
    for place in range(len(side_data)):
        side = side_data[place]
        if side.type.name == "DISPLAYMATRIX":
            a, b, _, c, d = np.frombuffer(bytes(side), np.int32)[:5] / 65536
            return _ORIENTATIONS.get((round(a), round(b), round(c), round(d)), 0)
    return 1


def _luma(frame: av.VideoFrame) -> np.ndarray:
    bits = frame.format.components[0].bits
    order = ">u2" if frame.format.name.endswith("be") else "<u2"
    plane = frame.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8 if bits == 8 else order).reshape(frame.height, -1)
    levels = rows[:, : frame.width]
    is_grey = frame.format.name.startswith("gray")
    is_full = frame.color_range == _FULL_RANGE or frame.format.name.startswith("yuvj")
    if is_full or (is_grey and frame.color_range != _LIMITED_RANGE):
        return levels.astype(np.uint8 if bits == 8 else np.uint16)
    stretch = _stretched(bits)
    return np.asarray(cv2.LUT(levels, stretch)) if bits == 8 else stretch[levels]


def _converted(frame: av.VideoFrame, *, grey: bool) -> np.ndarray:
    bits = max(component.bits for component in frame.format.components)
    is_deep = bits > 8 and not frame.format.name.startswith("pal")
    if grey and not frame.format.is_rgb:
        return frame.to_ndarray(format="gray16le" if is_deep else "gray")
    return frame.to_ndarray(format="bgr48le" if is_deep else "bgr24")


@lru_cache(maxsize=8)
def _stretched(bits: int) -> np.ndarray:
    """Full-scale level of each level of video range, of so many bits."""
    step = 1 << (bits - 8)
    levels = (np.arange(1 << bits) - 16 * step) / (219 * step)
    top = (1 << bits) - 1
    return np.clip(np.rint(levels * top), 0, top).astype(np.uint8 if bits == 8 else np.uint16)
