"""Rows of the log: boxes for what was measured by hand, and the table "estimated (measured)" as HTML, by pages."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import viser
from dockpose.app.drawing.numbers import QUANTITIES, status_words
from dockpose.app.errors import UserError
from dockpose.app.experiment import Row
from dockpose.app.experiment.record import EDITABLE, MEASURED_COLUMNS
from dockpose.app.export.data import summaries, table
from dockpose.app.resources import read_toml
from dockpose.app.state.view import number_text, typed_number
from dockpose.app.web.choices import Act, Choices
from dockpose.app.web.html import small
from dockpose.app.web.html import table as html_table
from dockpose.app.web.server.viser_private import identity

LABELS = dict(zip(MEASURED_COLUMNS, ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "Distance (cm)"), strict=True))
_SAID = read_toml("controls.toml")["measured"]

# Contents of the boxes, by column of results.csv, "notes" included.
Texts = dict[str, str]
BLANK: Texts = dict.fromkeys(EDITABLE, "")
MOST_ROWS = 100  # in the table, which is sent anew with each
_CELL = "padding: 0.1em 0.25em; text-align: right; font-variant-numeric: tabular-nums; vertical-align: top"
_LINE = "border-top: 1px solid rgba(128,128,128,0.35)"
_LONGEST_NOTE = 200
_NOTE = "Each row: estimated, (measured), and by how much the estimate is off. Mean and RMS are over all rows."
_TO_BEGIN = "To begin, take a frame: that starts a session called after the day. Or name one, or choose one, below."


def texts_of(row: Row) -> Texts:
    """Contents of the boxes for a stored row."""
    return {name: number_text(getattr(row, name)) for name in MEASURED_COLUMNS} | {"notes": row.notes}


def pose_of(texts: Texts) -> dict[str, float | None] | None:
    """What is typed of the pose, by the quantities' names; None where nothing is, or is still being typed."""
    numbers = {}
    for name, quantity in zip(MEASURED_COLUMNS, QUANTITIES, strict=False):  # all but the distance
        try:
            numbers[quantity] = typed_number(quantity, texts[name])
        except UserError:
            return None
    return numbers if any(number is not None for number in numbers.values()) else None


def values_of(texts: Texts) -> dict[str, Any]:
    """Values of a row, by column: a number or None, and the notes."""
    numbers = {name: typed_number(f"Measured {LABELS[name]}", texts[name]) for name in MEASURED_COLUMNS}
    return numbers | {"notes": texts["notes"]}


class MeasuredFields:
    """The boxes themselves."""

    def __init__(self, gui: viser.GuiApi) -> None:
        kinds = [*["place"] * 3, *["turn"] * 2, "distance"]
        named = zip(LABELS.items(), kinds, strict=True)
        self._boxes = {name: gui.add_text(label, "", hint=_SAID[kind]) for (name, label), kind in named}
        self._boxes["notes"] = gui.add_text(**_SAID["notes"])

    @property
    def ids(self) -> dict[str, str | None]:
        """By which the page knows them."""
        return {name: identity(box) for name, box in self._boxes.items()}

    def on_update(self, choices: Choices, act: Act) -> None:
        """Call an act whenever a person typed into one of a pose's."""
        for name in MEASURED_COLUMNS:
            choices.on_update(self._boxes[name], act)

    @property
    def texts(self) -> Texts:
        """Their contents."""
        return {name: box.value for name, box in self._boxes.items()}

    @texts.setter
    def texts(self, texts: Texts) -> None:
        for name, box in self._boxes.items():
            if box.value != texts[name]:
                box.value = texts[name]


def session_table(rows: Sequence[Row]) -> str:
    """The table of the newest rows, with the number of these and of all."""
    if not rows:
        return small("No frame was taken yet.")
    shown = rows[: -MOST_ROWS - 1 : -1]
    lines = []
    for name, cells in summaries(rows).items():
        columns, short = "".join(f'<td style="{_CELL}">{cell}</td>' for cell in cells), name.replace(" error", "")
        lines.append(f'<tr data-summary="{short}" style="{_LINE}; font-weight: 600"><td>{short}</td>{columns}</tr>')
    lines += [_row_lines(row) for row in shown]
    words = f"{len(shown)} of {len(rows)} row{'' if len(rows) == 1 else 's'}, newest first. {_NOTE}"
    return html_table("experiment-rows", QUANTITIES, lines, words)


def _row_lines(row: Row) -> str:
    """A row of the table: estimated, measured and error below each other."""
    first, *cells = table([row]).body[0]
    count, notes = len(QUANTITIES), row.notes
    columns = ""
    for pair, error in zip(cells[:count], cells[count : 2 * count], strict=True):
        estimated, _, measured = pair.partition(" ")
        below = f"<br> {measured}<br> <b>{error}</b>" if measured else ""
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
    return small(f"<b>{escape(said)}</b> {escape(where)}", 'id="experiment"')
