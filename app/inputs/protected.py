"""Outputs kept from inputs, each other and other programs; links and other spellings are seen through."""

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.app.inputs.received import folders_below, pictures_in, videos_below
from dockpose.sources import Kind, SourceError, kind_of, list_pictures
from dockpose.sources.bags.storage import BAG_METADATA, is_rosbag2_file

_STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")
LOCK = ".lock"  # of a folder; the system releases locks when their holder ends, however
_FAR_BYTE = 1 << 30  # Windows forbids others to read what is locked; the holder's number before it stays readable


class Protected:
    """Files that no output may take the place of."""

    def __init__(self, outputs: Iterable[tuple[str, str]] = (), inputs: Iterable[Path] = ()) -> None:
        self._owners: dict[Hashable, str] = {}
        for path in inputs:
            with contextlib.suppress(OSError, ValueError):
                self._owners.setdefault(_file(os.stat(path)), f"would overwrite the input {path}")
        for option, value in outputs:
            self.check(f"{option} {value}", value)
            self._owners.update(dict.fromkeys(places(value), f"is what {option} writes too"))

    def owner(self, path: str | Path) -> str | None:
        """What speaks against writing there, in words; None for nothing."""
        return next((self._owners[place] for place in places(path) if place in self._owners), None)

    def check(self, option: str, path: str | Path) -> None:
        """Raise a UserError that begins with the option and its value where a path must not be written."""
        owner = self.owner(path)
        if owner is not None:
            raise UserError(f"{option}: {owner}; give another name")


def places(path: str | Path) -> set[Hashable]:
    """What tells a file that may not exist yet from others; nothing for devices, which several outputs may share."""
    text = str(path)
    if text in _STANDARD_OUTPUT:
        with contextlib.suppress(OSError):
            status = os.fstat(1)
            if stat.S_ISREG(status.st_mode):
                return {"-", _file(status)}
        return {"-"}
    try:
        real = os.path.normcase(os.path.realpath(text))
        found: set[Hashable] = {real}
        with contextlib.suppress(OSError):
            found.add((*_file(os.stat(os.path.dirname(real))), os.path.basename(real)))
        with contextlib.suppress(OSError):
            status = os.stat(text)
            if stat.S_ISCHR(status.st_mode):
                return set()
            found.add(_file(status))
    except ValueError:  # no path at all, which is reported when it is opened
        return set()
    return found


def is_on_disk(path: str) -> bool:
    """Whether it is or can become a file or folder, rather than standard output, a pipe or a device."""
    there = Path(path)
    return path not in _STANDARD_OUTPUT and (there.is_file() or there.is_dir() or not there.exists())


def files_of(source: str | Path) -> Iterator[Path]:
    """Files that are read of a source as typed, and the YAML beside each; what is wrong is reported elsewhere."""
    source = str(source)
    kind, path, found = kind_of(source), Path(source), list[Path]()
    with contextlib.suppress(OSError, SourceError):
        if kind in (Kind.PICTURE, Kind.FOLDER, Kind.GLOB):
            found = list_pictures(source)
        elif kind is Kind.BAG and path.is_dir():
            found = [one for one in path.iterdir() if is_rosbag2_file(one) or one.name == BAG_METADATA]
        elif kind not in (Kind.CAMERA, Kind.STREAM) or path.is_file():
            found = [path]
    for one in found:
        yield from (one, one.with_suffix(".yaml"))
    if kind is Kind.BAG:
        yield path.with_suffix(".yaml")


def files_below(root: Path) -> Iterator[Path]:
    """Files that the page reads of a folder, and the YAML beside each."""
    with contextlib.suppress(OSError, UserError):
        pictures = [name for folder in folders_below(root) for name in pictures_in(root, folder)]
        for name in [*pictures, *videos_below(root)]:
            yield from files_of(root / name)


def _file(status: os.stat_result) -> tuple[int, int]:
    return status.st_dev, status.st_ino


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
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
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
