"""What the page may do, given at its start."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dockpose.sources import NO_WISHES, Wishes

UPLOAD_LIMIT_BYTES = 200 * 2**20
DEFAULT_PORT = 8080
SESSIONS_FOLDER = Path("dockpose-sessions")
RECORDINGS_FOLDER = "dockpose-recordings"  # beside the former


@dataclass(frozen=True)
class Options:
    """What the page may do.

    Attributes
    ----------
    allow_hosts : tuple of str
        Host names that browsers may use besides this machine's own, such as a reverse proxy's.
    folder : Path or None
        The folder on this machine whose pictures the page may show; None shows none.
    upload_limit_bytes : int
        Limit for all uploaded pictures together.
    remember_in : Path or None
        Folder for the last settings and each port's token; None keeps none, and shows no first card either.
    sessions : Path
        Folder for experiments; created with the first one.
    view_link : bool
        Whether there is a second address, for who may look but change nothing.
    wishes : Wishes
        What a camera is asked for that was given at the start.
    topic : str or None
        Of the bag that it starts with; None for the only one with pictures.
    """

    allow_hosts: tuple[str, ...] = ()
    folder: Path | None = None
    upload_limit_bytes: int = UPLOAD_LIMIT_BYTES
    remember_in: Path | None = None
    sessions: Path = SESSIONS_FOLDER
    view_link: bool = False
    wishes: Wishes = NO_WISHES
    topic: str | None = None


DEFAULTS = Options()
