"""Outputs kept from inputs and from each other; links and other spellings of a path are seen through."""

import contextlib
import os
from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.sources import Kind, SourceError, kind_of, list_pictures
from dockpose.sources.bags.storage import BAG_METADATA, is_rosbag2_file

_STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")


class Protected:
    """Files that no output may take the place of."""

    def __init__(self, outputs: Iterable[tuple[str, str]] = (), inputs: Iterable[Path] = ()) -> None:
        self._owners: dict[Hashable, str] = {}
        for path in inputs:
            if path.exists():
                self._owners |= dict.fromkeys(_names(path), f"would overwrite the input {path}")
        for option, value in outputs:
            self.check(f"{option} {value}", value)
            self._owners |= dict.fromkeys(_names(value), f"is what {option} writes too")

    def owner(self, path: str | Path) -> str | None:
        """What speaks against writing there, in words; None for nothing."""
        return next((self._owners[name] for name in _names(path) if name in self._owners), None)

    def check(self, option: str, path: str | Path) -> None:
        """Raise a UserError that begins with the option and its value where a path must not be written."""
        owner = self.owner(path)
        if owner is not None:
            raise UserError(f"{option}: {owner}; give another name")


def _names(path: str | Path) -> Iterator[Hashable]:
    """What tells a file, which may not exist yet, from others; nothing for devices, which outputs may share."""
    if str(path) in _STANDARD_OUTPUT:
        yield "-"
        return
    with contextlib.suppress(ValueError):  # no path at all, which is reported when it is opened
        if not Path(path).is_char_device():
            yield os.path.normcase(os.path.realpath(path))
            with contextlib.suppress(OSError):
                status = os.stat(path)
                yield status.st_dev, status.st_ino


def files_of(source: str | Path) -> Iterator[Path]:
    """Files that are read of a source as typed, and the YAML beside each; what is wrong is reported elsewhere."""
    kind, path, found = kind_of(str(source)), Path(source), list[Path]()
    with contextlib.suppress(OSError, SourceError):
        if kind in (Kind.PICTURE, Kind.FOLDER, Kind.GLOB):
            found = list_pictures(str(source))
        elif kind is Kind.BAG and path.is_dir():
            found = [one for one in path.iterdir() if is_rosbag2_file(one) or one.name == BAG_METADATA]
            found.append(path.resolve())
        elif kind not in (Kind.CAMERA, Kind.STREAM) or path.is_file():
            found = [path]
    for one in found:
        yield from (one, one.with_suffix(".yaml"))
