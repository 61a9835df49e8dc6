"""Where a command's results go: lines of JSON, and pictures in a folder. What cannot be written is a UsageError."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

import cv2
import numpy as np

from app.sources import UsageError


def open_text(target: str | None, files: contextlib.ExitStack) -> TextIO | None:
    """Open a file to write, to be closed with ``files``; "-" is standard output, None nothing."""
    if target is None:
        return None
    if target == "-":
        return sys.stdout
    try:
        return files.enter_context(open(target, "w", encoding="utf-8", newline=""))
    except OSError as error:
        raise UsageError(f"{target}: cannot be written ({error.strerror or error})") from error


def write_line(file: TextIO, line: dict[str, Any]) -> None:
    """Write one JSON object as one line, at once."""
    print(json.dumps(line, allow_nan=False), file=file, flush=True)


class PictureFolder:
    """A folder for pictures made from others, which is made if need be.

    Parameters
    ----------
    folder : where to write.
    originals : the pictures that results are made from; none of them is ever overwritten, nor is another result.
    """

    def __init__(self, folder: Path, originals: Sequence[Path]) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(f"{folder}: cannot be made ({error.strerror or error})") from error
        self._folder = folder
        self._taken = {path.resolve() for path in originals}

    def write(self, original: Path, picture: np.ndarray) -> Path:
        """Write the picture that was made from ``original`` as a PNG of its name; returns its path."""
        path = self._free_path(original)
        try:
            path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
        except OSError as error:
            raise UsageError(f"{path}: cannot be written ({error.strerror or error})") from error
        return path

    def _free_path(self, original: Path) -> Path:
        path, number = self._folder / f"{original.stem}.png", 1
        while path.resolve() in self._taken:
            number += 1
            path = self._folder / f"{original.stem}-{number}.png"
        self._taken.add(path.resolve())
        return path
