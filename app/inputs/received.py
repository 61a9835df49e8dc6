"""What browsers send and are given: YAML files, since the readers and writers of ``pipeline`` take paths; pictures."""

import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from dockpose.app.errors import UserError

_LARGEST_BYTES = 256 * 1024
Content = TypeVar("Content")


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
