"""The experiment log: frames taken one by one, with what was estimated and measured, in plain files (docs/outputs.md).

A row counts once :meth:`Session.take` has returned; a frame without one is kept, and its number is not used again.
"""

from dockpose.app.experiment.record import SessionRecord, read_session
from dockpose.app.experiment.row import Measured, Row
from dockpose.app.experiment.session import Session, SessionError

__all__ = ["Measured", "Row", "Session", "SessionError", "SessionRecord", "read_session"]
