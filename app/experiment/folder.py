"""The sessions in one folder on this machine, which the page lists, starts and reopens."""

import datetime
from pathlib import Path

from dockpose.app.errors import UserError
from dockpose.app.experiment import Session, SessionError
from dockpose.app.experiment.record import is_session
from dockpose.app.inputs.filenames import safe_name
from dockpose.app.inputs.folder import below

_MOST = 500


class SessionFolder:
    """Sessions below ``root``, and nowhere else; the folder is created with the first session."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def names(self) -> list[str]:
        """Names of the sessions, the one that was changed last first; none where the folder cannot be read."""
        try:
            folders = [path for path in self.root.iterdir() if not path.name.startswith(".") and is_session(path)]
            return [path.name for path in sorted(folders, key=_changed_s, reverse=True)[:_MOST]]
        except OSError:
            return []

    def start(self, text: str) -> Session:
        """Start a session named after what was typed, else after the day. Raises SessionError if it cannot be made."""
        name = safe_name(text if text.strip() else f"{datetime.date.today():%Y-%m-%d}", taken=self._taken())
        return Session.create(self.root / name)

    def take_up(self, name: str) -> Session:
        """Reopen a session."""
        if name not in self.names():
            raise UserError(f"{name}: there is no such session in {self.root}.")
        return Session.open(below(self.root, name))

    def _taken(self) -> list[str]:
        try:
            return [path.name for path in self.root.iterdir()]
        except FileNotFoundError:
            return []
        except OSError as error:
            raise SessionError(f"{self.root}: cannot be read ({error.strerror or error})") from error


def _changed_s(folder: Path) -> float:
    return max(path.stat().st_mtime for path in (folder, folder / "session.yaml"))
