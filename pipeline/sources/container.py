"""Files and streams as FFmpeg opens them, and MP4 files that break off, some of which it would refuse as a whole."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any, BinaryIO

import av
from av.container import InputContainer

# What a text in a file says that is not UTF-8 matters to nobody; PyAV 19 keeps such texts of itself.
_LENIENT: dict[str, Any] = {"metadata_errors": "ignore"} if int(av.__version__.split(".")[0]) < 19 else {}


def opened(source: str | BinaryIO | io.RawIOBase, **options: Any) -> InputContainer:
    """Open what is to be read, with options of ``av.open``, whatever bytes its texts are.

    Raises
    ------
    FFmpegError, OSError, ValueError
        If it cannot be opened.
    """
    return av.open(source, "r", **options, **_LENIENT)


class WholeBoxes(io.RawIOBase):
    """An MP4 file without the box that it breaks off in, unless that holds frames.

    An MP4 is a row of boxes, each of which begins with its size and its kind (ISO 14496-12, section 4.2). Frames lie in
    boxes of the kind "mdat", of which FFmpeg reads what is there.

    Raises
    ------
    OSError
        If the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file: BinaryIO = path.open("rb")
        self._end, _ = _boxes(self._file)
        self._file.seek(0)

    def readable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes."""
        left = max(0, self._end - self._file.tell())
        return self._file.read(left if size < 0 else min(size, left))

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place; the end is that of the whole boxes."""
        if whence == os.SEEK_END:
            return self._file.seek(self._end + offset)
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the place."""
        return self._file.tell()

    def close(self) -> None:
        """Release the file."""
        self._file.close()
        super().close()


def breaks_off(path: Path) -> bool:
    """Whether the last box of an MP4 file is not there as a whole. Raises OSError if the file cannot be read."""
    with path.open("rb") as file:
        return _boxes(file)[1]


def _boxes(file: BinaryIO) -> tuple[int, bool]:
    """Where the last whole box ends, or the file where that is within frames; and whether the file breaks off."""
    length = file.seek(0, os.SEEK_END)
    start, kind = 0, b""
    while start < length:
        file.seek(start)
        head = file.read(16)
        size = int.from_bytes(head[:4], "big")
        if len(head) < (16 if size == 1 else 8):
            return start, True
        if size == 1:  # the size follows in 64 bits
            size = int.from_bytes(head[8:16], "big")
        if size == 0:  # as far as the file goes
            return length, False
        if size < 8:
            return start, True
        if start + size > length:
            return (length if head[4:8] == b"mdat" else start), True
        start, kind = start + size, head[4:8]
    return length, kind == b"moof"  # the head of a fragment, whose frames would follow
