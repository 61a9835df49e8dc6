"""Writing files whole or not at all, so that they survive a power cut."""

import contextlib
import errno
import functools
import io
import os
import re
import threading
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

# On macOS fsync leaves the data in the drive's own memory.
_FULL_SYNC = getattr(fcntl, "F_FULLFSYNC", None)
TEMPORARY_ENDING = ".part"
_TEMPORARY = re.compile(rf"\..*\.(\d+)-\d+{re.escape(TEMPORARY_ENDING)}", re.DOTALL)  # with its process's number


def write_whole(path: Path, data: bytes) -> None:
    """Replace a file in one step: it is written under a temporary name and flushed first. Raises OSError."""
    if path.is_symlink():
        path = path.resolve()
    if path.exists() and not path.is_file():  # as /dev/stdout
        path.write_bytes(data)
        return
    _tidy(path.parent.resolve())
    temporary = path.with_name(f".{path.name[:50]}.{os.getpid()}-{threading.get_native_id()}{TEMPORARY_ENDING}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            _sync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        remove(temporary)
        raise


def write_all(file: IO[bytes] | io.RawIOBase, data: bytes) -> int:
    """Write all of the data to an unbuffered file, which may take it in pieces; return its length."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
    return len(data)


class GrowingFile:
    """A file that grows by whole pieces, and is cut back to the last of them where it cannot be written."""

    def __init__(self, path: Path) -> None:
        self.path, self._whole_bytes = path, 0
        self._file = path.open("wb", buffering=0)

    def write(self, data: bytes) -> int:
        """Write all of the data at once, and return its length. Raises OSError where that cannot be done."""
        return write_all(self._file, data)

    def tell(self) -> int:
        """Return the place."""
        return self._file.tell()

    def flush(self) -> None:
        """Do nothing: all is written at once."""

    def mark(self) -> None:
        """What is written so far is whole."""
        if self.path.is_file():
            self._whole_bytes = os.fstat(self._file.fileno()).st_size  # a muxer may be at its beginning

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def cut(self) -> str:
        """Close the file, which could not be written; only what is whole stays. Returns what that is, in words."""
        self._file.close()
        if not self.path.is_file():
            return ""
        if self._whole_bytes == 0:
            remove(self.path)
            return "; nothing of it is kept"
        os.truncate(self.path, self._whole_bytes)
        return "; what was written before is kept"


def sync_folder(folder: Path) -> None:
    """Flush a folder's names to the disk. Windows does so by itself and offers no call for it."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        _sync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some network folders cannot
            raise
    finally:
        os.close(descriptor)


def remove(path: Path) -> None:
    """Remove a file if possible."""
    with contextlib.suppress(OSError):
        path.unlink()


def remove_temporaries(folder: Path) -> None:
    """Remove the temporary files of a program that was stopped while writing."""
    for path in folder.glob(f".*{TEMPORARY_ENDING}"):
        remove(path)


@functools.cache
def _tidy(folder: Path) -> None:
    """Remove, once in each folder, the temporary files of programs of this machine that are no longer there."""
    for path in folder.glob(f".*{TEMPORARY_ENDING}"):
        if (match := _TEMPORARY.fullmatch(path.name)) and not _is_running(int(match[1])):
            remove(path)


def _is_running(process: int) -> bool:
    if os.name == "nt":  # where a file that is open cannot be removed
        return process == os.getpid()
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's
        return True
    return True


def _sync(descriptor: int) -> None:
    if _FULL_SYNC is not None and fcntl is not None:
        with contextlib.suppress(OSError):
            fcntl.fcntl(descriptor, _FULL_SYNC)
            return
    os.fsync(descriptor)
