"""From what was typed (a picture, a folder, a glob) to picture files, in order."""

from __future__ import annotations

import glob
import re
from collections.abc import Sequence
from pathlib import Path

PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm")


class UsageError(ValueError):
    """What was typed cannot be done; the text says what and why."""


def expand(sources: Sequence[str]) -> list[Path]:
    """Picture files that the sources stand for.

    A folder stands for its pictures, a glob for the files it matches, both in numeric order (frame2 before frame10).
    Anything else stands for itself, whether it exists or not.

    Raises
    ------
    UsageError
        if a folder has no pictures, or a glob matches nothing.
    """
    return [path for source in sources for path in _expand_one(source)]


def _expand_one(source: str) -> list[Path]:
    path = Path(source)
    if path.is_dir():
        found = [entry for entry in path.iterdir() if entry.suffix.lower() in PICTURE_ENDINGS and entry.is_file()]
        if not found:
            raise UsageError(f"{source}: the folder has no pictures ({', '.join(PICTURE_ENDINGS)})")
        return sorted(found, key=numeric)
    if not path.exists() and glob.has_magic(source):
        found = [Path(match) for match in glob.glob(source, recursive=True) if Path(match).is_file()]
        if not found:
            raise UsageError(f"{source}: no file matches")
        return sorted(found, key=numeric)
    return [path]


def numeric(path: Path) -> list[tuple[int, int, str]]:
    """Sort key by which digits count as numbers."""
    pieces = re.split(r"(\d+)", str(path))
    return [(1, int(piece), piece) if piece.isdecimal() else (0, 0, piece) for piece in pieces]
