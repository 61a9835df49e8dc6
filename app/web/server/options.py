"""What the page may do, given at its start."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dockpose.sources import DEFAULT_CAPTURE, CaptureSettings
from dockpose.vehicle import Vehicle

if TYPE_CHECKING:
    from dockpose.app.export.mavlink import Autopilot

UPLOAD_LIMIT_BYTES = 200 * 2**20
DEFAULT_PORT = 8080
SESSIONS_FOLDER = Path("dockpose-sessions")
RECORDINGS_FOLDER = "dockpose-recordings"  # beside the former


@dataclass(frozen=True)
class Options:
    """What the page may do."""

    # host names that browsers may use besides this machine's own, such as a reverse proxy's
    allow_hosts: tuple[str, ...] = ()
    allow_frames: tuple[str, ...] = ()  # origins of pages that may show this one in a frame
    resume: bool = False  # whether the session that was changed last is open from the start
    folder: Path | None = None  # the folder on this machine whose pictures the page may show
    upload_limit_bytes: int = UPLOAD_LIMIT_BYTES  # limit for all uploaded pictures together
    remember_in: Path | None = None  # folder for the last settings and each port's token
    sessions: Path = SESSIONS_FOLDER  # folder for experiments
    capture: CaptureSettings = DEFAULT_CAPTURE  # what a camera is asked for that was given at the start
    topic: str | None = None  # of the bag that it starts with
    autopilot: "Autopilot | None" = None  # to which the page may send what it sees
    vehicle: Vehicle | None = None  # that carries the camera


DEFAULTS = Options()
