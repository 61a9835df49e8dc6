"""What browsers send and name: files, pictures of a folder out of which no name leads; file names made from text."""

import re
import tempfile
import threading
import unicodedata
from collections.abc import Callable, Collection
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any, TypeVar

from dockpose.app.errors import UserError
from dockpose.sources import BAG_ENDINGS, PICTURE_ENDINGS, VIDEO_ENDINGS, Kind, kind_of, numeric

_LARGEST_BYTES = 256 * 1024
Content = TypeVar("Content")
LONGEST_BYTES = 60  # of a name without its ending, in UTF-8: short of every system's limit, folders included
_LONGEST_UPLOAD = 80  # characters
# Windows opens a device in place of a file of such a name, whatever its ending.
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789¹²³")}
_OF_PAGES = (".tif", ".tiff")  # as a rule; those of a single picture are left out
_DEEPEST, _MOST_FOLDERS, _MOST_FILES = 4, 200, 5000


def read_sent(data: bytes, name: str, reader: Callable[[Path], Content]) -> Content:
    """What ``reader`` makes of a file that was sent; its errors name the file as the browser calls it."""
    if len(data) > _LARGEST_BYTES:
        raise UserError(f"{name}: has {len(data) // 1024} KiB; a file of this kind has at most 256.")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sent.yaml"
        path.write_bytes(data)
        try:
            return reader(path)
        except RecursionError as error:
            raise UserError(f"{name}: is nested too deeply") from error
        except ValueError as error:
            raise UserError(str(error).replace(str(path), name)) from error


def written(writer: Callable[[Path], None]) -> bytes:
    """The bytes of the file that ``writer`` writes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "written.yaml"
        writer(path)
        return path.read_bytes()


class UploadStore:
    """Uploaded pictures as they came, newest last; the oldest are dropped when there is no room."""

    def __init__(self) -> None:
        self._files: dict[str, bytes] = {}
        self._lock = threading.Lock()

    @property
    def kept_bytes(self) -> int:
        """Memory that they take."""
        with self._lock:
            return sum(map(len, self._files.values()))

    def names(self) -> list[str]:
        """Their names, in the order they came."""
        with self._lock:
            return list(self._files)

    def add(self, name: str, data: bytes) -> None:
        """Keep a file; one of the same name is replaced."""
        with self._lock:
            self._files.pop(name, None)
            self._files[name] = data

    def get(self, name: str) -> bytes:
        """The bytes of a file. Raises UserError where it is gone."""
        with self._lock:
            if name not in self._files:
                raise UserError(f"{name} is no longer kept. Upload it again.")
            return self._files[name]

    def make_room(self, at_most_bytes: int) -> None:
        """Drop the oldest until no more than so much is kept."""
        with self._lock:
            while self._files and sum(map(len, self._files.values())) > at_most_bytes:
                del self._files[next(iter(self._files))]


def safe_name(text: str, ending: str = "", *, taken: Collection[str] = (), otherwise: str = "picture") -> str:
    """Return a file name that Linux, Windows and macOS take and that stands for the text."""
    composed = unicodedata.normalize("NFC", text)
    stem = _shortened(re.sub(r"[^\w-]+", "_", composed).strip("_-"), LONGEST_BYTES).strip("_-") or otherwise
    if stem.lower() in _DEVICES:
        stem += "_"
    used = {name.casefold() for name in taken}
    name, number = f"{stem}{ending}", 1
    while name.casefold() in used:
        number += 1
        suffix = f"-{number}"
        name = f"{_shortened(stem, LONGEST_BYTES - len(suffix))}{suffix}{ending}"
    return name


def clean_name(name: Any) -> str:
    """What to call an uploaded file: its last part, without control characters, at most 80 characters."""
    last = PurePath(str(name).replace("\\", "/")).name
    return "".join(letter for letter in last if letter.isprintable())[:_LONGEST_UPLOAD] or "the file"


def _shortened(text: str, bytes_: int) -> str:
    """The longest beginning of a text that has so many bytes in UTF-8."""
    return text.encode("utf-8")[:bytes_].decode("utf-8", "ignore")


def step(names: list[str], name: str, by: int) -> str | None:
    """The name so many places further; None beyond the ends, or where the name is not there."""
    if name not in names or not 0 <= names.index(name) + by < len(names):
        return None
    return names[names.index(name) + by]


def below(root: Path, relative: str) -> Path:
    """The path of what is below a root folder."""
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
    return _files_in(root, [folder], PICTURE_ENDINGS)


def videos_below(root: Path) -> list[str]:
    """Names, relative to the root, of the videos, bags and pictures of several pages in it and below it."""
    names = _files_in(root, folders_below(root), (*VIDEO_ENDINGS, *BAG_ENDINGS, *_OF_PAGES))
    return [name for name in names if not name.lower().endswith(_OF_PAGES) or _has_pages(root / name)]


def _has_pages(path: Path) -> bool:
    try:
        about = path.stat()
    except OSError:  # gone meanwhile
        return False
    return _looked_at(str(path), about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=_MOST_FILES)
def _looked_at(path: str, _mtime_ns: int, _size: int) -> bool:
    """Whether a file, as it was then, has several pages; the page lists a folder often, and each look opens a file."""
    return kind_of(path) is Kind.PAGES


def _files_in(root: Path, folders: list[str], endings: tuple[str, ...]) -> list[str]:
    names = [name for folder in folders for name in _inside(root, folder) if Path(name).suffix.lower() in endings]
    files = [name for name in names if (root / name).is_file()]
    return sorted(files, key=lambda name: numeric(Path(name)))[:_MOST_FILES]


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
