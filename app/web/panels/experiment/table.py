"""The running table "estimated (measured)" as HTML: a page of rows, the newest first, and a summary of all."""

import math
from collections.abc import Sequence
from html import escape
from pathlib import Path

from dockpose.app.drawing.numbers import status_words
from dockpose.app.experiment import Row
from dockpose.app.experiment.table import QUANTITIES, summaries, table
from dockpose.app.web.html import SMALL
from dockpose.app.web.html import table as html_table

ROWS_A_PAGE = 10
_CELL = "padding: 0.1em 0.25em; text-align: right; font-variant-numeric: tabular-nums; vertical-align: top"
_LINE = "border-top: 1px solid rgba(128,128,128,0.35)"
_LONGEST_NOTE = 200
_NOTE = (
    "Each row: estimated, (measured), and by how much the estimate is off. Mean and RMS are over all rows, also those "
    "on other pages."
)
_TO_BEGIN = "To begin, take a frame: that starts a session called after the day. Or name one, or choose one, below."
_NO_ROWS = "No frame was taken yet."


def pages(number: int) -> int:
    """How many pages so many rows have."""
    return max(1, math.ceil(number / ROWS_A_PAGE))


def rows_on_page(rows: Sequence[Row], page: int) -> list[Row]:
    """The rows of a page, from 1, the newest first."""
    last = len(rows) - (page - 1) * ROWS_A_PAGE
    return list(reversed(rows[max(0, last - ROWS_A_PAGE) : max(0, last)]))


def session_table(rows: Sequence[Row], page: int) -> str:
    """The table, with the number of rows shown and in all."""
    if not rows:
        return f'<div style="{SMALL}">{_NO_ROWS}</div>'
    shown = rows_on_page(rows, page)
    lines = [_summary_line(name, cells) for name, cells in summaries(rows).items()]
    lines += [_row_lines(row) for row in shown]
    words = f"{len(shown)} of {len(rows)} row{'' if len(rows) == 1 else 's'}, newest first. {_NOTE}"
    return html_table("experiment-rows", QUANTITIES, lines, words)


def _summary_line(name: str, cells: Sequence[str]) -> str:
    columns = "".join(f'<td style="{_CELL}">{cell}</td>' for cell in cells)
    short = name.replace(" error", "")
    return f'<tr data-summary="{short}" style="{_LINE}; font-weight: 600"><td>{short}</td>{columns}</tr>'


def _row_lines(row: Row) -> str:
    """A row of the table: estimated, measured and error below each other."""
    first, *cells = table([row]).body[0]
    count, notes = len(QUANTITIES), row.notes
    columns = ""
    for pair, error in zip(cells[:count], cells[count : 2 * count], strict=True):
        estimated, _, measured = pair.partition(" ")
        below = f"<br>{measured}<br><b>{error}</b>" if measured else ""
        columns += f'<td style="{_CELL}; white-space: nowrap">{estimated}{below}</td>'
    if row.status != "ok":
        notes = f"No pose: {status_words(row.status)}. {notes}"
    short = notes if len(notes) <= _LONGEST_NOTE else f"{notes[:_LONGEST_NOTE]}…"
    under = f'<tr data-notes="{first}"><td colspan="{count + 1}">{escape(short)}</td></tr>' if short else ""
    return f'<tr data-row="{first}" style="{_LINE}"><td style="vertical-align: top">{first}</td>{columns}</tr>{under}'


def taken_words(row: Row) -> str:
    """A sentence about a frame that was taken."""
    distance = "without a pose" if row.z_cm is None else f"z {row.z_cm:.1f} cm"
    measured = any(number is not None for number in (*row.measured, row.distance_cm))
    return f"Frame {row.number} is on disk: {row.source}, {distance}, {'' if measured else 'not yet '}measured."


def state_html(folder: Path | None, rows: int, said: str) -> str:
    """Which session is open, where it is on the disk, and what was done last."""
    where = _TO_BEGIN if folder is None else f"{rows} frame{'' if rows == 1 else 's'} in {folder}."
    return f'<div id="experiment" style="{SMALL}"><b>{escape(said)}</b> {escape(where)}</div>'
