"""``results.csv`` of an open session."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dockpose.app.experiment.record import RESULTS
from dockpose.app.experiment.row import COLUMNS, Row, row_to_csv, to_csv_line
from dockpose.files.durable_files import sync_folder, write_whole
from dockpose.files.yaml_file import FileError

EMPTY = to_csv_line(COLUMNS).encode()


class ResultsFile:
    """The rows, the same in memory as on the disk; each change replaces the file, lest half a row be left."""

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
        """Replace the row at ``index``."""
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
            # If even this fails, the new rows stay on the disk, and they are whole too.
            write_whole(self._path, before[2])
            self.rows, self._lines, self._content = before
            raise
