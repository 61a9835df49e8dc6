"""The error whose text is a sentence for a person."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class UserError(ValueError):
    """What somebody asked for cannot be done; the text says what and why."""


@contextlib.contextmanager
def blaming(argument: str) -> Iterator[None]:
    """Name the argument that a ValueError comes from: a UserError whose text begins with it takes its place."""
    try:
        yield
    except ValueError as error:
        raise UserError(f"{argument}{error}") from error


@contextlib.contextmanager
def writing(target: object) -> Iterator[None]:
    """Raise a UserError that names the target where it cannot be written."""
    try:
        yield
    except OSError as error:
        raise UserError(f"{target}: cannot be written ({error.strerror or error})") from error
