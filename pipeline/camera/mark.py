"""The mark of pictures and videos that we have drawn on, by which they are refused where one to search is asked for."""

import zlib

import cv2
import numpy as np

# The comment of a PNG (tEXt), a JPEG (COM) and a video (metadata), which programs that convert pictures keep.
COMMENT = "drawn by dockpose"
_TEXT, _MARK = b"tEXt", b"Comment\0" + COMMENT.encode()
_HEADER_BYTES = 33  # of a PNG: its signature and IHDR


def to_png(picture: np.ndarray) -> bytes:
    """A picture (H, W) or (H, W, C) that was drawn on as a PNG file with the mark."""
    data = cv2.imencode(".png", picture)[1].tobytes()
    chunk = len(_MARK).to_bytes(4, "big") + _TEXT + _MARK + zlib.crc32(_TEXT + _MARK).to_bytes(4, "big")
    return data[:_HEADER_BYTES] + chunk + data[_HEADER_BYTES:]


def to_jpeg(picture: np.ndarray, quality: int = 95) -> bytes:
    """A picture (H, W) or (H, W, C) that was drawn on as a JPEG file with the mark; ``quality`` is 0 to 100."""
    data, comment = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes(), COMMENT.encode()
    start = 4 + int.from_bytes(data[4:6], "big")  # behind JFIF's segment, which must be the first
    return data[:start] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + data[start:]


def is_drawn(data: bytes) -> bool:
    """Whether the bytes of a picture file have the mark, of which its head alone is looked at."""
    if data.startswith(b"\x89PNG"):
        start = 8
        while (kind := data[start + 4 : start + 8]) not in (b"", b"IDAT"):
            length = int.from_bytes(data[start : start + 4], "big")
            if kind == _TEXT and data[start + 8 : start + 8 + length].lower() == _MARK.lower():
                return True
            start += 12 + length
    elif data.startswith(b"\xff\xd8"):
        start = 2
        while data[start : start + 1] == b"\xff" and (kind := data[start + 1 : start + 2]) not in (b"", b"\xda"):
            length = int.from_bytes(data[start + 2 : start + 4], "big")
            if kind == b"\xfe" and data[start + 4 : start + 2 + length].rstrip(b"\0") == COMMENT.encode():
                return True
            start += 2 + length
    return False


def refusal(name: str, kind: str = "picture") -> str:
    """The sentence that refuses what has the mark."""
    return f"{name}: is a {kind} that dockpose has drawn on; give the one that it was made from"
