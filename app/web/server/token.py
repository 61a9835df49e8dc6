"""The access token of a port, kept over restarts where only the user can read it."""

import contextlib
import os
import re
import secrets
from pathlib import Path

from dockpose.app.state.tank import make_private

_TOKEN = re.compile(r"[A-Za-z0-9_-]{24}")
_BYTES = 18  # 24 letters


def token_for(folder: Path | None, name: str) -> str:
    """Return the token of that name, as ``8080-view``; a new one where none is kept or it could have leaked."""
    new = secrets.token_urlsafe(_BYTES)
    if folder is None:
        return new
    path = folder / f"token-{name}"
    try:
        kept = path.read_text(encoding="ascii").strip()
        if _TOKEN.fullmatch(kept) and _is_private(path):
            return kept
    except (OSError, UnicodeDecodeError):
        pass
    with contextlib.suppress(OSError):
        make_private(folder)
        path.unlink(missing_ok=True)
        with open(path, "x", encoding="ascii", opener=_private) as file:
            file.write(new + "\n")
    return new


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)


def _is_private(path: Path) -> bool:
    """Whether nobody but this user can have read or written a file; always where files have no such owners."""
    if not hasattr(os, "getuid"):
        return True
    about = path.lstat()
    return about.st_uid == os.getuid() and not about.st_mode & 0o077
