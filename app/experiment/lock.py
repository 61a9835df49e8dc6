"""Locks for one program at a time on a folder or an output. The system releases them when the holder ends, however."""

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Hashable, Iterable
from pathlib import Path

NAME = ".lock"
_FAR_BYTE = 1 << 30  # Windows forbids others to read what is locked; the holder's number before it stays readable


class InUseError(Exception):
    """Another program, or another part of this one, holds the lock; the text says which."""


class _Held:
    _descriptor: int | None = None

    def release(self) -> None:
        """Let others have it."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


class FolderLock(_Held):
    """Holds a folder from its creation until :meth:`release`."""

    def __init__(self, folder: Path) -> None:
        descriptor = os.open(folder / NAME, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(descriptor):
                number = os.read(descriptor, 20).decode("ascii", "replace")
                raise InUseError(f"process {number}" if number.isdigit() else "another program")
            os.ftruncate(descriptor, 0)
            os.write(descriptor, str(os.getpid()).encode())
        except BaseException:
            os.close(descriptor)
            raise
        self._descriptor = descriptor


class Claims(_Held):
    """What this program writes, kept from the user's other programs until :meth:`release`, where that can be had."""

    def __init__(self) -> None:
        user = getattr(os, "getuid", lambda: "")()
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        with contextlib.suppress(OSError):
            self._descriptor = os.open(Path(tempfile.gettempdir()) / f"dockpose-{user}.lock", flags, 0o600)

    def claim(self, places: Iterable[Hashable]) -> bool:
        """Claim what is known by any of these; return whether no other program has it."""
        if self._descriptor is None:
            return True
        digests = [hashlib.blake2b(repr(place).encode(), digest_size=8).digest() for place in places]
        return all(_lock_byte(self._descriptor, int.from_bytes(digest, "big") % _FAR_BYTE) for digest in digests)


if sys.platform == "win32":
    import msvcrt

    def _lock_byte(descriptor: int, number: int) -> bool:
        os.lseek(descriptor, number, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            os.lseek(descriptor, 0, os.SEEK_SET)
        return True

    def _lock(descriptor: int) -> bool:
        return _lock_byte(descriptor, _FAR_BYTE)

else:
    import fcntl

    def _lock_byte(descriptor: int, number: int) -> bool:
        try:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, number)
        except (BlockingIOError, PermissionError):
            return False
        except OSError:  # a file system without locks
            return True
        return True

    def _lock(descriptor: int) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True
