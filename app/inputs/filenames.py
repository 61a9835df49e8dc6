"""File names made from text that came from outside, and the names of uploaded files."""

import re
import unicodedata
from collections.abc import Collection
from pathlib import PurePath
from typing import Any

LONGEST_BYTES = 60  # of a name without its ending, in UTF-8: short of every system's limit, folders included
_LONGEST_UPLOAD = 80  # characters
# Windows opens a device in place of a file of such a name, whatever its ending.
_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{digit}" for port in ("com", "lpt") for digit in "0123456789¹²³")}


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
