"""Where a command's results go: lines of JSON, pictures, a video. What cannot be written is a UserError."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

import cv2
import msgspec
import numpy as np
from dockpose.app.errors import UserError

# MPEG-4 that everything plays, and JPEG pictures in a row, which keep the finest lines.
VIDEO_CODECS = {".mp4": "mp4v", ".avi": "MJPG"}


def open_text(target: str | None, files: contextlib.ExitStack) -> TextIO | None:
    """Open a file to write, to be closed with ``files``; "-" is standard output, None nothing."""
    if target is None:
        return None
    if target == "-":
        return sys.stdout
    try:
        return files.enter_context(open(target, "w", encoding="utf-8", newline=""))
    except OSError as error:
        raise UserError(f"{target}: cannot be written ({error.strerror or error})") from error


def write_line(file: TextIO, line: dict[str, Any]) -> None:
    """Write one JSON object as one line, at once, in plain ASCII, which every terminal can show."""
    file.write(to_json(line) + "\n")
    file.flush()


def to_json(line: dict[str, Any]) -> str:
    """JSON of an object in plain ASCII; numbers that are none are null."""
    try:
        text = msgspec.json.encode(line)  # in a twentieth of the standard library's time
    except UnicodeEncodeError:  # a file's name need not be text
        return json.dumps(line, allow_nan=False)
    return text.decode() if text.isascii() else json.dumps(msgspec.json.decode(text))


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
            raise UserError(f"{folder}: cannot be made ({error.strerror or error})") from error
        self._folder = folder
        self._taken = {path.resolve() for path in originals}

    def write(self, original: Path, picture: np.ndarray) -> Path:
        """Write the picture that was made from ``original`` as a PNG of its name; returns its path."""
        return self.write_named(original.stem, picture)

    def write_named(self, name: str, picture: np.ndarray) -> Path:
        """Write a picture as NAME.png, or NAME-2.png where an original or another result has that name."""
        path = self._free_path(name)
        try:
            path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
        except OSError as error:
            raise UserError(f"{path}: cannot be written ({error.strerror or error})") from error
        return path

    def _free_path(self, name: str) -> Path:
        path, number = self._folder / f"{name}.png", 1
        while path.resolve() in self._taken:
            number += 1
            path = self._folder / f"{name}-{number}.png"
        self._taken.add(path.resolve())
        return path


class AnnotatedVideo:
    """A video made from pictures of one size, begun with the first.

    Parameters
    ----------
    path : ends as one of ``VIDEO_CODECS``.
    rate_hz : pictures in a second.
    """

    def __init__(self, path: Path, rate_hz: float) -> None:
        if not path.parent.is_dir():
            raise UserError(f"{path}: cannot be written ({path.parent}: there is no such folder)")
        self._path, self._rate_hz = path, rate_hz
        self._writer: cv2.VideoWriter | None = None

    def write(self, picture: np.ndarray) -> None:
        """Add a picture, (H, W, 3) BGR uint8; an odd row or column at its end is left out, as videos need."""
        height, width = (size - size % 2 for size in picture.shape[:2])
        if self._writer is None:
            codec = cv2.VideoWriter.fourcc(*VIDEO_CODECS[self._path.suffix.lower()])
            self._writer = cv2.VideoWriter(str(self._path), codec, self._rate_hz, (width, height))
            if not self._writer.isOpened():
                raise UserError(f"{self._path}: cannot be written as a video")
        self._writer.write(np.ascontiguousarray(picture[:height, :width]))

    def close(self) -> None:
        """Finish the file."""
        if self._writer is not None:
            self._writer.release()
