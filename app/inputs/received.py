"""YAML files that browsers send and are given: the readers and writers of ``pipeline`` take paths."""

import tempfile
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
