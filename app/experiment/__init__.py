"""The log of frames taken, in plain files (docs/outputs.md); a row counts once :meth:`Session.take` has returned."""

from dockpose.app.experiment.record import Row, SessionRecord, read_session
from dockpose.app.experiment.session import Session, SessionError

__all__ = ["Row", "Session", "SessionError", "SessionRecord", "read_session"]
