"""What browsers send and are given: YAML files, pictures; and file names made from text that came from outside."""

import re
import tempfile
import threading
import unicodedata
from collections.abc import Callable, Collection
from pathlib import Path, PurePath
from typing import Any, TypeVar

from dockpose.app.errors import UserError

_LARGEST_BYTES = 256 * 1024
Content = TypeVar("Content")
LONGEST_BYTES = 60  # of a name without its ending, in UTF-8: short of every system's limit, folders included
_LONGEST_UPLOAD = 80  # characters
# Windows opens a device in place of a file of such a name, whatever its ending.
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789¹²³")}


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
