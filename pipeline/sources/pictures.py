"""Picture files as frames: a single one, a folder's, or those that match a glob; and the pages of a TIFF."""

import glob
import hashlib
import io
import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from dockpose.camera import image as decoding
from dockpose.camera.tiff import is_tiff
from dockpose.sources.frames import Callback, Frame, Indexed, SourceError
from dockpose.text import as_text
from PIL import ExifTags

PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp", ".pgm", ".ppm")
_WITH_EXIF = (b"\xff\xd8", b"II*\0", b"MM\0*", b"RIFF")  # the first bytes of JPEG, TIFF and WebP


class Pictures(Indexed):
    """Picture files in the given order, each read when it is due; without a rate they have no times."""

    def __init__(
        self, paths: Sequence[Path], source: str, rate_hz: float | None = None, tell: Callback | None = None
    ) -> None:
        super().__init__(source, tell)
        self.paths = tuple(paths)
        self.rate_hz = rate_hz
        self.count = len(self.paths)

    def _frame(self, index: int) -> Frame:
        path = self.paths[index]
        image, sha256, taken_s, tag, encoded = read_tagged(path)
        self._tell_orientation(tag, str(path))
        time_s = None if self.rate_hz is None else index / self.rate_hz
        name = as_text(str(path))
        return Frame(image, index, time_s, name, sha256, time_unix_s=taken_s, encoded=encoded)


class Pages(Indexed):
    """The pages of a TIFF, each decoded when it is due; without a rate they have no times."""

    def __init__(self, source: str, rate_hz: float | None = None, tell: Callback | None = None) -> None:
        super().__init__(source, tell)
        self.rate_hz = rate_hz
        path = Path(source)
        file = self._open.enter_context(path.open("rb"))
        self._pages = decoding.tiff_pages(file, source)
        self.count = len(self._pages)

    def _frame(self, index: int) -> Frame:
        image = decoding.decode_page(self._pages[index], f"{self.source}: page {index + 1}")
        self._tell_orientation(self._pages[index].orientation, self.source)
        return Frame(image, index, None if self.rate_hz is None else index / self.rate_hz, self.source)


def has_pages(path: Path) -> bool:
    """Whether a file is a TIFF of several pages; False for what cannot be read."""
    try:
        with path.open("rb") as file:
            return is_tiff(file.read(4)) and len(decoding.tiff_pages(file, str(path))) > 1
    except (OSError, ValueError):
        return False


def read_tagged(path: Path) -> tuple[np.ndarray, str, float | None, int, bytes]:
    """A file's picture (H, W), checksum, time as by :func:`taken_unix_s`, orientation, and bytes."""
    data = decoding.read_picture_file(path)
    image = decoding.decode(data, str(path))
    sha256, tag = hashlib.sha256(data).hexdigest(), decoding.orientation_of(data)
    return image, sha256, taken_unix_s(data), tag, data


def taken_unix_s(data: bytes) -> float | None:
    """When a picture was taken by EXIF 2.31, in seconds since 1970-01-01 00:00 UTC; None where it is not sure."""
    # DateTimeOriginal is a clock on the wall; without OffsetTimeOriginal nobody knows of which time zone.
    if not data.startswith(_WITH_EXIF):
        return None
    try:
        with decoding.opened_quietly(io.BytesIO(data)) as picture:
            tags = picture.getexif().get_ifd(ExifTags.IFD.Exif)
        taken, zone = tags[ExifTags.Base.DateTimeOriginal], tags[ExifTags.Base.OffsetTimeOriginal]
        digits = str(tags.get(ExifTags.Base.SubsecTimeOriginal, "")).strip(" \0")
        moment = datetime.strptime(f"{taken.strip(chr(0))} {zone.strip(chr(0))}", "%Y:%m:%d %H:%M:%S %z")
        return moment.timestamp() + (float(f"0.{digits}") if digits else 0.0)
    except Exception:  # no such tags, or damaged ones, for which Pillow raises many kinds of errors
        return None


def list_pictures(source: str) -> list[Path]:
    """List the files of a folder or glob in numeric order (frame2 before frame10); else the text stands for itself."""
    if not source:
        raise SourceError("the name of a source is empty")
    path = Path(source)
    if path.is_dir():
        found = [entry for entry in path.iterdir() if entry.suffix.lower() in PICTURE_ENDINGS and entry.is_file()]
        none = f"the folder has no pictures ({', '.join(PICTURE_ENDINGS)})"
    elif not path.exists() and glob.has_magic(source):
        found = [Path(match) for match in glob.glob(source, recursive=True) if Path(match).is_file()]
        none = "no file matches"
    else:
        return [path]
    if not found:
        raise SourceError(f"{source}: {none}")
    return sorted(found, key=numeric)


def numeric(path: Path) -> list[tuple[int, int, str]]:
    """Sort key that compares runs of digits as numbers."""
    pieces = re.split(r"(\d+)", str(path))
    return [(1, int(piece), piece) if piece.isdecimal() else (0, 0, piece) for piece in pieces]
