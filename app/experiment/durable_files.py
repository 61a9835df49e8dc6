"""Writing files whole or not at all, so that they survive a power cut."""

from __future__ import annotations

import contextlib
import errno
import os
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

# On macOS fsync leaves the data in the drive's own memory.
_FULL_SYNC = getattr(fcntl, "F_FULLFSYNC", None)
TEMPORARY_ENDING = ".part"


def write_whole(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, flush it to the disk, and only then give it its name.

    An existing file is replaced in one step; :func:`sync_folder` then makes the new name durable. Raises OSError where
    that fails, after removing the temporary file; an existing file is unchanged then.
    """
    temporary = path.with_name(f".{path.name}{TEMPORARY_ENDING}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            _sync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        remove(temporary)
        raise


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


def why(error: OSError) -> str:
    """The reason in words that people at a tank understand."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full"
    if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
        return "it may not be written to (read-only, or open in another program)"
    return error.strerror or str(error)


def _sync(descriptor: int) -> None:
    if _FULL_SYNC is not None and fcntl is not None:
        with contextlib.suppress(OSError):
            fcntl.fcntl(descriptor, _FULL_SYNC)
            return
    os.fsync(descriptor)
