"""``results.csv`` of a session that is being added to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dockpose.app.experiment.durable_files import sync_folder, write_whole
from dockpose.app.experiment.record import RESULTS
from dockpose.app.experiment.row import COLUMNS, Row, row_to_csv, to_csv_line
from dockpose.camera.files import FileError

EMPTY = to_csv_line(COLUMNS).encode()


class ResultsFile:
    """The rows, in memory and on the disk, where both always agree.

    Each change writes all rows anew and puts the file in the old one's place. That is a few milliseconds at 2,000 rows,
    and there is no moment at which the file ends in half a row, as there is when one is appended.

    Parameters
    ----------
    folder : of the session.
    rows : that its file holds.

    Raises
    ------
    OSError
        if a missing file cannot be made.
    FileError
        if the file has columns that would be lost.
    """

    def __init__(self, folder: Path, rows: Sequence[Row]) -> None:
        self._path = folder / RESULTS
        self.rows = list(rows)
        self._lines = [row_to_csv(row) for row in rows]
        if not self._path.exists():
            write_whole(self._path, EMPTY)
            sync_folder(folder)
        self._content = self._path.read_bytes()
        first = self._content.partition(b"\n")[0].decode("utf-8-sig").strip().split(",")
        unknown = [name for name in first if name not in COLUMNS]
        if unknown:
            raise FileError(f"{self._path}: the column {unknown[0]} would be lost; move it to a file of its own")

    def add(self, row: Row) -> None:
        """Add a row at the end; see :meth:`replace`."""
        self._write([*self.rows, row], [*self._lines, row_to_csv(row)])

    def replace(self, index: int, row: Row) -> None:
        """Put another row in the place of one.

        Raises
        ------
        OSError
            if it cannot be written; the rows are as before then, on the disk as well.
        FileError
            if someone else changed the file meanwhile, whose work would be lost.
        """
        rows, lines = self.rows.copy(), self._lines.copy()
        rows[index], lines[index] = row, row_to_csv(row)
        self._write(rows, lines)

    def _write(self, rows: list[Row], lines: list[str]) -> None:
        if self._path.exists() and self._path.read_bytes() != self._content:
            raise FileError(f"{self._path}: was changed by another program; close the session and open it again")
        before = self.rows, self._lines, self._content
        content = EMPTY + "".join(lines).encode()
        write_whole(self._path, content)
        self.rows, self._lines, self._content = rows, lines, content
        try:
            sync_folder(self._path.parent)
        except OSError:
            # Where not even this can be written, the new rows stay, which are whole too.
            write_whole(self._path, before[2])
            self.rows, self._lines, self._content = before
            raise
