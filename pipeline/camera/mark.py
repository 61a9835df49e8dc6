"""The mark of pictures and videos that we have drawn on, by which they are refused where one to search is asked for."""

import zlib

import cv2
import numpy as np

# The comment of a PNG (tEXt), a JPEG (COM) and a video (metadata), which programs that convert pictures keep.
COMMENT = "drawn by dockpose"
_TEXT = [b"tEXt" + key + b"\0" + COMMENT.encode() for key in (b"Comment", b"comment")]  # as others may spell it
_CHUNKS = [(len(text) - 4).to_bytes(4, "big") + text + zlib.crc32(text).to_bytes(4, "big") for text in _TEXT]
_SEGMENT = b"\xff\xfe" + (len(COMMENT) + 2).to_bytes(2, "big") + COMMENT.encode()
_HEADER_BYTES = 33  # of a PNG: its signature and IHDR


def to_png(picture: np.ndarray) -> bytes:
    """A picture (H, W) or (H, W, C) that was drawn on as a PNG file with the mark."""
    data = cv2.imencode(".png", picture)[1].tobytes()
    return data[:_HEADER_BYTES] + _CHUNKS[0] + data[_HEADER_BYTES:]


def to_jpeg(picture: np.ndarray, quality: int = 95) -> bytes:
    """A picture (H, W) or (H, W, C) that was drawn on as a JPEG file with the mark; ``quality`` is 0 to 100."""
    data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    start = 4 + int.from_bytes(data[4:6], "big")  # behind JFIF's segment, which must be the first
    return data[:start] + _SEGMENT + data[start:]


def is_drawn(data: bytes) -> bool:
    """Whether the bytes of a picture file have the mark, of which its head alone is looked at."""
    if data.startswith(b"\x89PNG"):
        head = data[: max(0, data.find(b"IDAT"))]
        return any(chunk in head for chunk in _CHUNKS)
    return data.startswith(b"\xff\xd8") and _SEGMENT in data[: max(0, data.find(b"\xff\xda"))]


def refusal(name: str, kind: str = "picture") -> str:
    """The sentence that refuses what has the mark."""
    return f"{name}: is a {kind} that dockpose has drawn on; give the one that it was made from"
