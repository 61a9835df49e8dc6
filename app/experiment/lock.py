"""A folder that one program at a time may change."""

import os
import sys
from pathlib import Path

LOCK = ".lock"  # the system releases locks when their holder ends, however
_FAR_BYTE = 1 << 30  # Windows forbids others to read what is locked; the holder's number before it stays readable


class InUseError(Exception):
    """Another program, or another part of this one, holds the lock; the text says which."""


class FolderLock:
    """Holds a folder from its creation until :meth:`release`."""

    def __init__(self, folder: Path) -> None:
        self._descriptor: int | None = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(self._descriptor):
                number = os.read(self._descriptor, 20).decode("ascii", "replace")
                raise InUseError(f"process {number}" if number.isdigit() else "another program")
            os.ftruncate(self._descriptor, 0)
            os.write(self._descriptor, str(os.getpid()).encode())
        except BaseException:
            self.release()
            raise

    def release(self) -> None:
        """Let others have it."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


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
