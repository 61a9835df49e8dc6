"""Boxes for what was measured by hand; a blank one was not measured."""

from __future__ import annotations

import math
from typing import Any

import viser
from dockpose.app.experiment import Measured, Row
from dockpose.app.experiment.row import EDITABLE, MEASURED_COLUMNS
from dockpose.pose.known import KnownPose

LABELS = dict(zip(MEASURED_COLUMNS, ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "Distance (cm)"), strict=True))
_HINTS = {
    "theta": "Turn of the dock's face, 0 where it is square on: θx pitch, θy yaw. Leave it blank if not measured.",
    "distance": "From the camera straight to the dock's centre, as the tape lies. Leave it blank if not measured.",
}
_PLACE = "Of the dock's centre, from the camera: x right, y down, z ahead. Leave it blank if not measured."

# Contents of the boxes, by column of results.csv, "notes" included.
Texts = dict[str, str]
BLANK: Texts = dict.fromkeys(EDITABLE, "")


def texts_of(row: Row) -> Texts:
    """Contents of the boxes for a stored row."""
    return measured_texts([getattr(row, name) for name in MEASURED_COLUMNS]) | {"notes": row.notes}


def texts_of_pose(known: KnownPose) -> Texts:
    """Contents of the boxes for a measured pose; distance and notes are blank."""
    pose = Measured.of_pose(known)
    return measured_texts([pose.x_cm, pose.y_cm, pose.z_cm, pose.theta_x_deg, pose.theta_y_deg, None]) | {"notes": ""}


def measured_texts(numbers: list[float | None]) -> Texts:
    """Numbers, in the order of the columns, as people type them."""
    shown = ("" if number is None else f"{number:.6f}".rstrip("0").rstrip(".") for number in numbers)
    return dict(zip(MEASURED_COLUMNS, shown, strict=True))


def values_of(texts: Texts) -> dict[str, Any]:
    """Values of a row, by column: a number or None, and the notes.

    A decimal comma is accepted. Raises ValueError that names the box and its content.
    """
    return {name: _number(name, texts[name]) for name in MEASURED_COLUMNS} | {"notes": texts["notes"]}


def measured_of(values: dict[str, Any]) -> Measured:
    """The numbers of :func:`values_of`, as a session takes them."""
    return Measured(*(values[name] for name in MEASURED_COLUMNS))


def _number(name: str, text: str) -> float | None:
    text = text.strip()
    if not text:
        return None
    try:
        number = float(text.replace(",", ".").replace("−", "-"))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"Measured {LABELS[name]} is {text!r}; it must be a number, or blank where not measured.")
    return number


class MeasuredFields:
    """The boxes themselves."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._boxes = {
            name: gui.add_text(label, "", hint=next((_HINTS[key] for key in _HINTS if key in name), _PLACE))
            for name, label in LABELS.items()
        }
        self._boxes["notes"] = gui.add_text(
            "Notes", "", multiline=True, hint="Whatever belongs to this frame; it is kept with the row."
        )

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
