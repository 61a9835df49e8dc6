"""From what was typed (a picture, a folder, a glob) to picture files, in order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.sources import PICTURE_ENDINGS, SourceError, list_pictures, numeric

__all__ = ["PICTURE_ENDINGS", "expand", "numeric"]


def expand(sources: Sequence[str]) -> list[Path]:
    """Picture files that the sources stand for, see :func:`dockpose.sources.list_pictures`.

    Raises
    ------
    UserError
        if a folder has no pictures, or a glob matches nothing.
    """
    try:
        return [path for source in sources for path in list_pictures(source)]
    except SourceError as error:
        raise UserError(str(error)) from error
