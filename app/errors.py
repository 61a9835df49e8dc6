"""The error whose text is a sentence for a person."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator

from dockpose.checks import InputError

# What no argument can be blamed for.
_DISK = (errno.ENOSPC, errno.EFBIG, errno.EIO, getattr(errno, "EDQUOT", errno.ENOSPC))


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
    except BrokenPipeError:  # who read it has gone, as `head` does
        raise
    except OSError as error:
        raise unwritable(target, error) from error


def unwritable(target: object, error: OSError) -> UserError:
    """The error to raise for what could not be written."""
    kind = OutputError if error.errno in _DISK else UserError
    return kind(f"{target}: cannot be written ({why(error)})")


def why(error: OSError) -> str:
    """The reason in words that people at a tank understand."""
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", None)):
        return "the disk is full"
    if error.errno == errno.EFBIG:
        return "the disk or this account takes no larger file"
    if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
        return "it may not be written to (read-only, or open in another program)"
    return error.strerror or str(error)
