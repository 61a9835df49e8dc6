"""The error whose text is a sentence for a person."""

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from dockpose.text import InputError

_EDQUOT = getattr(errno, "EDQUOT", errno.ENOSPC)
_DISK = (errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EBADF, _EDQUOT)  # what no argument can be blamed for
_MAY_NOT = "it may not be written to (read-only, or open in another program)"
_WHY = {
    **dict.fromkeys((errno.ENOSPC, _EDQUOT), "the disk is full"),
    errno.EFBIG: "the disk or this account takes no larger file",
    errno.ENOENT: "there is no such file or folder",
    errno.EBADF: "it is closed",
    **dict.fromkeys((errno.EROFS, errno.EACCES, errno.EPERM), _MAY_NOT),
}


class UserError(InputError):
    """What somebody asked for cannot be done; the text says what and why."""


class OutputError(UserError):
    """A disk is full or broken, or another reason that is nobody's fault why results cannot be written."""


@contextlib.contextmanager
def blaming(argument: str) -> Iterator[None]:
    """Name the argument that a ValueError comes from: a UserError whose text begins with it takes its place."""
    try:
        yield
    except ValueError as error:
        raise UserError(f"{argument}{error}") from error


@contextlib.contextmanager
def writing(target: object) -> Iterator[None]:
    """Raise a UserError that names the target where it cannot be written; an OutputError where the disk is full."""
    try:
        yield
    except BrokenPipeError:  # the reader has gone, as `head` does
        raise
    except OSError as error:
        raise unwritable(target, error) from error


def unwritable(target: object, error: OSError, what: str = "cannot be written", kept: str = "") -> UserError:
    """The error to raise for what could not be written; ``kept`` says what there is of it all the same."""
    kind = OutputError if error.errno in _DISK else UserError
    return kind(f"{target}: {what} ({why(error)}){kept}")


def why(error: OSError) -> str:
    """The reason in words that people at a tank understand."""
    return _WHY.get(error.errno or 0) or error.strerror or str(error)


def check_place(path: Path, option: str, *, is_new: bool = False, in_place: bool = False) -> None:
    """Raise a UserError where a file cannot be put there, before work is done whose result would be lost."""
    if not path.parent.is_dir():
        raise UserError(f"{option} {path}: cannot be written, there is no folder {path.parent}")
    if path.is_dir():
        raise UserError(f"{option} {path}: is a folder; name a file in it")
    if path.is_file() and not os.access(path, os.W_OK):
        raise UserError(f"{option} {path}: cannot be written, the file is read-only")
    if not path.exists() or (path.is_file() and not in_place):
        check_folder(path.parent, f"{option} {path}")
    if is_new and path.is_file():
        raise UserError(f"{option} {path}: is there already and is not overwritten; give another name, or rename it")


def check_folder(folder: Path, what: str) -> None:
    """Raise a UserError that begins with ``what`` where nothing can be put into a folder, nor the folder be made."""
    there = next((one for one in (folder, *folder.parents) if one.exists()), folder)
    if not os.access(there, os.W_OK):
        raise UserError(f"{what}: cannot be written, the folder {there} is read-only")
