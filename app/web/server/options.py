"""What the page may do, as given when it is started."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

UPLOAD_LIMIT_BYTES = 200 * 2**20
SESSIONS_FOLDER = Path("dockpose-sessions")


@dataclass(frozen=True)
class Options:
    """What the page may do.

    Attributes
    ----------
    allow_hosts : names by which browsers may call it, besides this machine's own; a reverse proxy's.
    folder : the folder on this machine whose pictures the page may show; None shows none.
    upload_limit_bytes : of all pictures together that browsers have sent.
    remember_in : folder in which the last settings are kept; None keeps none, and shows no first card either.
    sessions : folder below which experiments are kept; it is made when the first one is started.
    """

    allow_hosts: tuple[str, ...] = ()
    folder: Path | None = None
    upload_limit_bytes: int = UPLOAD_LIMIT_BYTES
    remember_in: Path | None = None
    sessions: Path = SESSIONS_FOLDER


DEFAULTS = Options()
