"""A lock that lets one program at a time use a folder. The system releases it when the holder ends, however."""

from __future__ import annotations

import os
import sys
from pathlib import Path

NAME = ".lock"
_FAR_BYTE = 1 << 30  # Windows forbids others to read what is locked; the holder's number before it stays readable


class InUseError(Exception):
    """Another program, or another part of this one, holds the lock; the text says which."""


class FolderLock:
    """Holds a folder from its creation until :meth:`release`.

    Raises
    ------
    InUseError
        If it is held already.
    OSError
        If the folder cannot be written to, or cannot be locked.
    """

    def __init__(self, folder: Path) -> None:
        descriptor = os.open(folder / NAME, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(descriptor):
                raise InUseError(_holder(descriptor))
            os.ftruncate(descriptor, 0)
            os.write(descriptor, str(os.getpid()).encode())
        except BaseException:
            os.close(descriptor)
            raise
        self._descriptor: int | None = descriptor

    def release(self) -> None:
        """Let others have the folder."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def _holder(descriptor: int) -> str:
    number = os.read(descriptor, 20).decode("ascii", "replace")
    return f"process {number}" if number.isdigit() else "another program"


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> bool:
        os.lseek(descriptor, _FAR_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            os.lseek(descriptor, 0, os.SEEK_SET)
        return True

else:
    import fcntl

    def _lock(descriptor: int) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
