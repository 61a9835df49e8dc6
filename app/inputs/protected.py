"""Outputs kept from inputs and from each other, by device and inode: links and other spellings are seen through."""

import contextlib
import os
import stat
from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.app.inputs.folder import folders_below, pictures_in, videos_below
from dockpose.sources import Kind, SourceError, kind_of, list_pictures
from dockpose.sources.names import BAG_METADATA, is_rosbag2_file

_STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")


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
