"""Boxes for what was measured by hand; a blank one was not measured."""

from typing import Any

import viser
from dockpose.app.experiment import Measured, Row
from dockpose.app.experiment.row import EDITABLE, MEASURED_COLUMNS
from dockpose.app.resources import read_toml
from dockpose.app.state.measured import MeasuredPose, number_text, typed_number

LABELS = dict(zip(MEASURED_COLUMNS, ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "Distance (cm)"), strict=True))
_SAID = read_toml("controls.toml")["measured"]

# Contents of the boxes, by column of results.csv, "notes" included.
Texts = dict[str, str]
BLANK: Texts = dict.fromkeys(EDITABLE, "")


def texts_of(row: Row) -> Texts:
    """Contents of the boxes for a stored row."""
    return measured_texts([getattr(row, name) for name in MEASURED_COLUMNS]) | {"notes": row.notes}


def texts_of_pose(pose: MeasuredPose) -> Texts:
    """Contents of the boxes for a measured pose; distance and notes are blank."""
    return measured_texts([*pose.values, None]) | {"notes": ""}


def after_change(texts: Texts, before: MeasuredPose | None, now: MeasuredPose | None) -> Texts:
    """Contents after the measured pose has changed: what stood there only from before, and is not typed over, goes."""
    old, new = (BLANK if pose is None else texts_of_pose(pose) for pose in (before, now))
    return texts | {
        name: new[name] or ("" if texts[name] == old[name] else texts[name])
        for name in MEASURED_COLUMNS
        if name != "distance_cm"
    }


def measured_texts(numbers: list[float | None]) -> Texts:
    """Numbers, in the order of the columns, as people type them."""
    return dict(zip(MEASURED_COLUMNS, map(number_text, numbers), strict=True))


def values_of(texts: Texts) -> dict[str, Any]:
    """Values of a row, by column: a number or None, and the notes."""
    numbers = {name: typed_number(f"Measured {LABELS[name]}", texts[name]) for name in MEASURED_COLUMNS}
    return numbers | {"notes": texts["notes"]}


def measured_of(values: dict[str, Any]) -> Measured:
    """The numbers of :func:`values_of`, as a session takes them."""
    return Measured(*(values[name] for name in MEASURED_COLUMNS))


class MeasuredFields:
    """The boxes themselves."""

    def __init__(self, gui: viser.GuiApi) -> None:
        kinds = [*["place"] * 3, *["turn"] * 2, "distance"]
        self._boxes = {
            name: gui.add_text(label, "", hint=_SAID[kind])
            for (name, label), kind in zip(LABELS.items(), kinds, strict=True)
        }
        self._boxes["notes"] = gui.add_text(**_SAID["notes"])

    @property
    def texts(self) -> Texts:
        """Their contents; a browser may send anything, and what is not text is blank."""
        values = {name: box.value for name, box in self._boxes.items()}
        return {name: value if isinstance(value, str) else "" for name, value in values.items()}

    @texts.setter
    def texts(self, texts: Texts) -> None:
        for name, box in self._boxes.items():
            if box.value != texts[name]:
                box.value = texts[name]
