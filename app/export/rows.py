"""What ``dockpose estimate`` writes for each frame at once: a line of JSON, a row of a table, an annotated picture."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from dockpose.app.commands.output import VIDEO_CODECS, open_text, write_line
from dockpose.app.drawing.colours import POSE_NAMES

_CANDIDATE_COLUMNS = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "probability", "rms_px")
_TRACK_KEYS = ("probability", "age", "predicted", "lost")
CSV_COLUMNS = (
    *("source", "frame", "time_s", "status", "method", "level", "groups", "lights_on_ring"),
    *("selected", "selected_by"),
    *(f"{name.lower()}_{column}" for name in POSE_NAMES for column in _CANDIDATE_COLUMNS),
    *(f"track_{key}" for key in _TRACK_KEYS),
    *("elapsed_ms", "message"),
)


@dataclass(frozen=True)
class Outputs:
    """Where results go; None for nowhere.

    Attributes
    ----------
    json : file for a line a frame; "-" for standard output.
    csv : file for a row a frame.
    annotate : folder for annotated pictures; or of one sequence a video, by its ending.
    """

    json: str | None = None
    csv: str | None = None
    annotate: Path | None = None

    @property
    def none_asked(self) -> bool:
        """Whether the results are only to be read on the screen."""
        return self.json is None and self.csv is None and self.annotate is None

    @property
    def video_asked(self) -> bool:
        """Whether the annotated pictures are to become a video."""
        return self.annotate is not None and self.annotate.suffix.lower() in VIDEO_CODECS


class Results:
    """Writes the results of frame after frame, so that a run that is stopped keeps all that it did.

    Parameters
    ----------
    outputs : where to write.
    files : closes what is opened here.
    before_each : called before a frame is written; may raise.

    Attributes
    ----------
    frames : how many were written.
    """

    def __init__(
        self, outputs: Outputs, files: contextlib.ExitStack, before_each: Callable[[], None] = lambda: None
    ) -> None:
        self._outputs, self._before_each = outputs, before_each
        self._json = open_text(outputs.json, files)
        self._table_file = open_text(outputs.csv, files)
        self._table = None if self._table_file is None else _table(self._table_file)
        self.frames = 0

    def write(self, line: dict[str, Any], label: str, draw: Callable[[], None]) -> None:
        """Write one frame.

        Parameters
        ----------
        line : its JSON object.
        label : what to call it on the screen.
        draw : writes its annotated picture; called where those are wanted.
        """
        self._before_each()
        if self._json is not None:
            write_line(self._json, line)
        if self._table is not None and self._table_file is not None:
            self._table.writerow(to_row(line))
            self._table_file.flush()
        if self._outputs.annotate is not None:
            draw()
        if self._outputs.none_asked:
            print(f"{label}: {line['message']}", flush=True)
        self.frames += 1


def to_row(line: dict[str, Any]) -> dict[str, Any]:
    """One row of the table from one JSON object."""
    threshold, track = line["threshold"] or {}, line.get("track") or {}
    row: dict[str, Any] = {
        **{key: line[key] for key in ("source", "frame", "time_s", "status", "selected_by", "elapsed_ms", "message")},
        **{key: threshold.get(key) for key in ("method", "level", "groups")},
        "lights_on_ring": sum(marker["on_ring"] is True for marker in line["markers"]),
        "selected": None if line["selected"] is None else POSE_NAMES[line["selected"]],
        **{f"track_{key}": track.get(key) for key in _TRACK_KEYS},
    }
    for name, candidate in zip(POSE_NAMES, line["candidates"], strict=False):
        values = (*candidate["position_m"], *(candidate[key] for key in _CANDIDATE_COLUMNS[3:]))
        row |= {f"{name.lower()}_{key}": value for key, value in zip(_CANDIDATE_COLUMNS, values, strict=True)}
    return row


def _table(file: TextIO) -> csv.DictWriter[str]:
    table = csv.DictWriter(file, CSV_COLUMNS)
    table.writeheader()
    file.flush()
    return table
