"""The experiment log: frames taken one by one, with what was estimated and what was measured, in plain files.

A session is a folder:

``session.yaml``
    made once: the schema, when, which program and libraries, notes.
``results.csv``
    one row per frame, see :class:`Row`; always whole, since each change replaces it in one step.
``frames/0001.png``, ``frames/0001.json``
    the pixels that were estimated, losslessly, and everything found in them (schema 1, with camera, dock, settings
    and versions).

A row counts once :meth:`Session.take` has returned. A program that is stopped before may leave a frame without a row.
That frame is kept, its number is not used again, and :attr:`Session.notices` reports it. Names that begin with a dot
are the program's own.
"""

from dockpose.app.experiment.record import SessionRecord, read_session
from dockpose.app.experiment.row import Measured, Row
from dockpose.app.experiment.session import Session, SessionError

__all__ = ["Measured", "Row", "Session", "SessionError", "SessionRecord", "read_session"]
