"""Picture files as frames: a single one, a folder's, or those that match a glob."""

from __future__ import annotations

import glob
import hashlib
import io
import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from dockpose.camera.image import ImageError, decode, read_picture_file
from dockpose.checks import as_text
from dockpose.sources.frames import Frame, Frames, SourceError, Tell
from PIL import ExifTags, Image

PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".pgm", ".ppm")
_WITH_EXIF = (b"\xff\xd8", b"II*\0", b"MM\0*", b"RIFF")  # the first bytes of JPEG, TIFF and WebP


class Pictures(Frames):
    """Picture files in the given order, each read when it is due.

    Parameters
    ----------
    paths : sequence of Path
        The files.
    source : str
        Display name of them all.
    rate_hz : float, hertz, optional
        Frames per second, where they are a sequence; None where they are not, and have no times.
    tell : callable, optional
        Called with a sentence for each file that cannot be read, which is skipped.
    """

    def __init__(
        self, paths: Sequence[Path], source: str, rate_hz: float | None = None, tell: Tell | None = None
    ) -> None:
        super().__init__(source, tell)
        self.paths = tuple(paths)
        self.rate_hz = rate_hz
        self.count = len(self.paths)

    def __iter__(self) -> Iterator[Frame]:
        return self.between(0, len(self.paths))

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the pictures with ``start`` <= index < ``stop``."""
        for index in range(max(0, start), min(stop, len(self.paths))):
            path = self.paths[index]
            try:
                image, sha256, taken_s = read_picture_and_time(path)
            except ImageError as error:
                self._skip(str(error))
                continue
            time_s = None if self.rate_hz is None else index / self.rate_hz
            yield Frame(image, index, time_s, as_text(str(path)), sha256, time_unix_s=taken_s)


def read_picture(path: Path) -> tuple[np.ndarray, str]:
    """Read a picture file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    image : (H, W) or (H, W, 3) BGR array, uint8 or uint16
        The picture, see :func:`dockpose.camera.image.decode`.
    sha256 : str
        Checksum of the file.

    Raises
    ------
    ImageError
        If the file cannot be read or is not a picture.
    """
    return read_picture_and_time(path)[:2]


def read_picture_and_time(path: Path) -> tuple[np.ndarray, str, float | None]:
    """Read a picture file as :func:`read_picture`, and when it was taken as :func:`taken_unix_s`."""
    data = read_picture_file(path)
    return decode(data, str(path)), hashlib.sha256(data).hexdigest(), taken_unix_s(data)


def taken_unix_s(data: bytes) -> float | None:
    """When a picture was taken by its EXIF tags, in seconds since 1970-01-01 00:00 UTC; None where it is not sure.

    DateTimeOriginal is a clock on the wall; without OffsetTimeOriginal nobody knows of which time zone. The fraction of
    the second is that of SubSecTimeOriginal (EXIF 2.31, section 4.6.5).

    Parameters
    ----------
    data : bytes
        Contents of a picture file; only JPEG, TIFF and WebP are looked into.
    """
    if not data.startswith(_WITH_EXIF):
        return None
    try:
        with Image.open(io.BytesIO(data)) as picture:
            tags = picture.getexif().get_ifd(ExifTags.IFD.Exif)
        taken, zone = tags[ExifTags.Base.DateTimeOriginal], tags[ExifTags.Base.OffsetTimeOriginal]
        digits = str(tags.get(ExifTags.Base.SubsecTimeOriginal, "")).strip(" \0")
        moment = datetime.strptime(f"{taken.strip(chr(0))} {zone.strip(chr(0))}", "%Y:%m:%d %H:%M:%S %z")
        return moment.timestamp() + (float(f"0.{digits}") if digits else 0.0)
    except Exception:  # no such tags, or damaged ones, for which Pillow raises many kinds of errors
        return None


def list_pictures(source: str) -> list[Path]:
    """List the picture files that a text stands for.

    A folder stands for its pictures, and a glob for the files it matches, both in numeric order (frame2 before
    frame10). Anything else stands for itself, whether it exists or not.

    Parameters
    ----------
    source : str
        Path or glob.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    SourceError
        If a folder has no pictures, or a glob matches nothing.
    """
    path = Path(source)
    if path.is_dir():
        found = [entry for entry in path.iterdir() if entry.suffix.lower() in PICTURE_ENDINGS and entry.is_file()]
        if not found:
            raise SourceError(f"{source}: the folder has no pictures ({', '.join(PICTURE_ENDINGS)})")
        return sorted(found, key=numeric)
    if not path.exists() and glob.has_magic(source):
        found = [Path(match) for match in glob.glob(source, recursive=True) if Path(match).is_file()]
        if not found:
            raise SourceError(f"{source}: no file matches")
        return sorted(found, key=numeric)
    return [path]


def numeric(path: Path) -> list[tuple[int, int, str]]:
    """Sort key that compares runs of digits as numbers.

    Parameters
    ----------
    path : Path
        To be sorted.

    Returns
    -------
    list of (int, int, str)
        An entry for each run of digits and each text between them.
    """
    pieces = re.split(r"(\d+)", str(path))
    return [(1, int(piece), piece) if piece.isdecimal() else (0, 0, piece) for piece in pieces]
