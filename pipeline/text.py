"""Text for people: the error that is one line; values, names and kinds of files in words that are safe to print."""

import re
from collections.abc import Iterable
from typing import Any

# What gives access: our own token, a password in an address (FFmpeg takes up to the last @ before a slash), and what
# cameras and servers call such things, also where a path has them, as rtsp://HOST/user=NAME_password=WORD.
_NAMES = r"token|pass\w*?|pwd|pas|secret|sig(?:nature)?|key|auth|credentials?"
_SECRETS = (
    (re.compile(rf"((?:^|[?&;\s/_])[\w-]*?(?:{_NAMES})=)[^\s&;\"')]+", re.IGNORECASE), r"\1***"),
    (re.compile(r"(\w://)[^/\s@]*:(?!\d{1,5}(?:[/?#:\s]|$))\S*@"), r"\1***@"),
    (re.compile(r"(\w://)[^/?#\s]*@"), r"\1***@"),
    (re.compile(r"((?:authorization|cookie)\s*[:=]\s*).*", re.IGNORECASE), r"\1***"),
)
_ADDRESS = re.compile(r"\w+://\S+")
_LONGEST, _MOST_TEXT = 80, 900  # characters of a value that are quoted, and of a message
# What files begin with that are given in place of others; results of ours first, which are no source.
RESULTS = (
    (b'{"schema":1,"source":', "a file of results by estimate --json; export makes tables and plots of it"),
    (b"source,frame,", "a table of results, as estimate --csv writes it"),
    (b"# time_s ", "poses, as estimate --tum writes them"),
    (b"PK\3\4", "a ZIP file; unpack it, and name a file of it"),
    (b"<!doctype html", "a web page, as reports are"),
)
ARCHIVES = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"Rar!", b"\x28\xb5\x2f\xfd")
ELSEWHERE = (  # what stands in the place of a file
    *((start, "a web page; download the file itself") for start in (b"<!doctype html", b"<html")),
    (b"version https://git-lfs", "what Git LFS leaves in place of a file; fetch it by git lfs pull"),
)
_OTHERS = (
    *ELSEWHERE,
    *((start, "a picture") for start in (b"\x89PNG", b"\xff\xd8\xff", b"II*\0", b"MM\0*", b"GIF8")),
    *((start, "a video") for start in (b"\x1aE\xdf\xa3", b"RIFF")),
    *((start, "a bag") for start in (b"\x89MCAP", b"#ROSBAG", b"SQLite format 3")),
    *((start, "packed; unpack it") for start in ARCHIVES),
    (b"%PDF", "a PDF file"),
)
MOST_START_BYTES = 32


class InputError(ValueError):
    """Something that was given cannot be used; the text says what and why, on one line."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(public(text)))


def shown(value: Any) -> str:
    """``repr`` of a value for a message: on one line, and no longer than a few words."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to print a whole number of thousands of digits
        text = f"{hex(value)[:_LONGEST]}..."
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def one_line(text: str, most: int = _MOST_TEXT) -> str:
    """Text for a message: what cannot be printed is spelt out; of a long one the middle, mostly a name, is left out."""
    half = most // 2
    return printable(text if len(text) <= most else f"{text[:half]}...{text[-half:]}")


def printable(text: str) -> str:
    r"""Text of any length in which what cannot be printed is spelt out, also the bytes of a name that are no text.

    Examples
    --------
    >>> print(printable(b"tank\xff.png".decode(errors="surrogateescape")), printable(chr(27) + "[2J"))
    tank\xff.png \x1b[2J
    """
    return text if text.isprintable() else "".join(map(_spelt, text))


def as_text(name: str) -> str:
    """A file's name as text that any file can hold: bytes in it that are no UTF-8 are spelt out, as in messages."""
    # A lone surrogate stands for a byte that is no text, or is half of one.
    return re.sub("[\ud800-\udfff]", lambda match: _spelt(match[0]), name)


def _spelt(character: str) -> str:
    if character.isprintable():
        return character
    if "\udc80" <= character <= "\udcff":  # Python's stand-in for a byte that is no UTF-8
        return f"\\x{ord(character) - 0xDC00:02x}"
    return character.encode("unicode_escape").decode()


def without_secrets(text: str) -> str:
    """Text in which tokens, passwords and cookies are replaced by ``***``."""
    for pattern, replacement in _SECRETS:
        text = pattern.sub(replacement, text)
    return text


def public(text: str) -> str:
    """Text as people may see it, also a source's name: passwords and the like in its addresses are hidden."""
    return _ADDRESS.sub(lambda found: without_secrets(found[0]), text) if "://" in text else text


def kind_in_words(start: bytes, kinds: Iterable[tuple[bytes, str]] = (*RESULTS, *_OTHERS)) -> str | None:
    """What a file is that begins so, in words; None where that is not known."""
    if start[4:8] == b"ftyp" and kinds not in (RESULTS, ELSEWHERE):
        return "a video"
    start = start[:MOST_START_BYTES].lower()
    return next((words for begins, words in kinds if start.startswith(begins.lower())), None)
