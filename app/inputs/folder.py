"""Pictures one can page through: those that browsers sent, and those of a folder on this machine."""

from __future__ import annotations

import threading
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.app.inputs.expand import PICTURE_ENDINGS, numeric
from dockpose.sources import VIDEO_ENDINGS

_DEEPEST, _MOST_FOLDERS, _MOST_PICTURES = 4, 200, 5000


class Shelf:
    """Uploaded pictures as they came, the newest last; the oldest go when there is no room."""

    def __init__(self) -> None:
        self._files: dict[str, bytes] = {}
        self._lock = threading.Lock()

    @property
    def kept_bytes(self) -> int:
        """How much memory they take."""
        with self._lock:
            return sum(map(len, self._files.values()))

    def names(self) -> list[str]:
        """Their names, in the order they came."""
        with self._lock:
            return list(self._files)

    def add(self, name: str, data: bytes) -> str:
        """Keep a file; one of the same name is replaced."""
        with self._lock:
            self._files.pop(name, None)
            self._files[name] = data
        return name

    def get(self, name: str) -> bytes:
        """The bytes of a file. Raises UserError where it is gone."""
        with self._lock:
            if name not in self._files:
                raise UserError(f"{name} is no longer kept. Upload it again.")
            return self._files[name]

    def make_room(self, at_most_bytes: int) -> None:
        """Forget the oldest until no more than so much is kept."""
        with self._lock:
            while self._files and sum(map(len, self._files.values())) > at_most_bytes:
                del self._files[next(iter(self._files))]


def step(names: list[str], name: str, by: int) -> str | None:
    """The name so many places further; None beyond the ends, or where the name is not there."""
    if name not in names or not 0 <= names.index(name) + by < len(names):
        return None
    return names[names.index(name) + by]


def below(root: Path, relative: str) -> Path:
    """The path of what is below a root folder.

    Raises UserError for whatever is not there or not below the root, by dots, as an absolute path, or through
    a link.
    """
    try:
        path = (root / relative).resolve(strict=True)
    except (OSError, ValueError, RuntimeError) as error:
        raise UserError(f"{relative} is not in the folder.") from error
    if not path.is_relative_to(root.resolve()):
        raise UserError(f"{relative} is not below the folder that was given at the start.")
    return path


def folders_below(root: Path) -> list[str]:
    """The root itself, as ".", and the folders below it, four deep, that do not lead out of it."""
    found, level = ["."], ["."]
    for _ in range(_DEEPEST):
        level = [name for above in level for name in _inside(root, above) if (root / name).is_dir()]
        found += sorted(level)
    return found[:_MOST_FOLDERS]


def pictures_in(root: Path, folder: str) -> list[str]:
    """Names, relative to the root, of the pictures of one folder, frame2 before frame10."""
    names = [
        name
        for name in _inside(root, folder)
        if Path(name).suffix.lower() in PICTURE_ENDINGS and (root / name).is_file()
    ]
    return sorted(names, key=lambda name: numeric(Path(name)))[:_MOST_PICTURES]


def videos_below(root: Path) -> list[str]:
    """Names, relative to the root, of the videos in it and in the folders below it."""
    names = [
        name
        for folder in folders_below(root)
        for name in _inside(root, folder)
        if Path(name).suffix.lower() in VIDEO_ENDINGS and (root / name).is_file()
    ]
    return sorted(names, key=lambda name: numeric(Path(name)))[:_MOST_PICTURES]


def _inside(root: Path, folder: str) -> list[str]:
    """What is in a folder and not hidden, relative to the root, without links that lead out of it."""
    found = []
    for entry in below(root, folder).iterdir():
        name = (Path(folder) / entry.name).as_posix()
        try:
            below(root, name)
        except UserError:
            continue
        if not entry.name.startswith("."):
            found.append(name)
    return found
