"""The pictures that browsers sent, in memory."""

import threading

from dockpose.app.errors import UserError


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
