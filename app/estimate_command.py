"""``dockpose estimate``: pictures in, JSON lines, a table and annotated pictures out."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from app.annotate import POSE_NAMES, annotate
from app.batch import Batch, Picture, say
from app.outputs import PictureFolder, open_text, write_line
from pipeline import Camera, Dock, Estimate, Settings, estimate
from pipeline.masks import StillGroups

_CANDIDATE_COLUMNS = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "probability", "rms_px")
CSV_COLUMNS = (
    *("source", "frame", "time_s", "status", "method", "level", "groups", "lights_on_ring"),
    *("selected", "selected_by"),
    *(f"{name.lower()}_{column}" for name in POSE_NAMES for column in _CANDIDATE_COLUMNS),
    *("elapsed_ms", "message"),
)


@dataclass(frozen=True)
class Outputs:
    """Where results go; None for nowhere. ``json`` may be "-" for standard output."""

    json: str | None = None
    csv: str | None = None
    annotate: Path | None = None

    @property
    def none_asked(self) -> bool:
        """Whether the results are only to be read on the screen."""
        return self.json is None and self.csv is None and self.annotate is None


def estimate_sources(
    paths: Sequence[Path], camera: Camera | None, dock: Dock | None, settings: Settings, outputs: Outputs
) -> int:
    """Estimate every picture and write what was asked for.

    Parameters
    ----------
    paths : of the pictures, in order.
    camera, dock : for all pictures; where None, each picture's own, from the YAML beside it.
    settings : how to search.
    outputs : where results go; a line for each picture is printed where nothing is asked for.

    Returns
    -------
    Exit status: 0 where every picture was read, 1 where some could not be; a line on standard error tells which.

    Raises
    ------
    UsageError
        if a picture has no camera or dock, or an output cannot be written.
    """
    batch = Batch(paths, camera, dock)
    watched = _Watched(settings)
    with contextlib.ExitStack() as files:
        json_file = open_text(outputs.json, files)
        table = _open_table(outputs.csv, files)
        folder = None if outputs.annotate is None else PictureFolder(outputs.annotate, paths)
        for picture, found in batch.run(watched.estimate):
            line = found.to_dict(str(picture.path), frame=0, sha256=picture.sha256)
            if json_file is not None:
                write_line(json_file, line)
            if table is not None:
                table.writerow(to_row(line))
            if folder is not None:
                folder.write(picture.path, annotate(picture.image, found))
            if outputs.none_asked:
                print(f"{picture.path}: {found.message}")
    return batch.exit_status


class _Watched:
    """Estimates picture after picture, and masks what stays put in those that belong together.

    Pictures belong together as long as their size, camera and dock are the same.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._still = StillGroups()
        self._belongs: tuple[Any, ...] = ()

    def estimate(self, picture: Picture) -> Estimate:
        """Estimate the next picture; what is masked from the one after it on is told on standard error."""
        belongs = (picture.image.shape[:2], picture.camera, picture.dock)
        if belongs != self._belongs:
            self._belongs, self._still = belongs, StillGroups()
        settings = msgspec.structs.replace(self._settings, masks=(*self._settings.masks, *self._still.masks))
        found = estimate(picture.image, picture.camera, picture.dock, settings)
        on_ring = found.ring.on_ring if found.status == "ok" and found.ring is not None else None
        masks = self._still.see(found.markers, on_ring)
        if masks:
            where = "; ".join(",".join(f"{number:g}" for number in mask) for mask in masks)
            say(
                f"{picture.path}: something bright stays put while the rest moves, as burnt-in text does; "
                f"from the next picture on it is masked (x, y, width, height in pixels): {where}"
            )
        return found


def to_row(line: dict[str, Any]) -> dict[str, Any]:
    """One row of the table from one JSON object."""
    threshold = line["threshold"] or {}
    row: dict[str, Any] = {
        **{key: line[key] for key in ("source", "frame", "time_s", "status", "selected_by", "elapsed_ms", "message")},
        **{key: threshold.get(key) for key in ("method", "level", "groups")},
        "lights_on_ring": sum(marker["on_ring"] is True for marker in line["markers"]),
        "selected": None if line["selected"] is None else POSE_NAMES[line["selected"]],
    }
    for name, candidate in zip(POSE_NAMES, line["candidates"], strict=False):
        values = (*candidate["position_m"], *(candidate[key] for key in _CANDIDATE_COLUMNS[3:]))
        row |= {f"{name.lower()}_{key}": value for key, value in zip(_CANDIDATE_COLUMNS, values, strict=True)}
    return row


def _open_table(target: str | None, files: contextlib.ExitStack) -> csv.DictWriter[str] | None:
    file = open_text(target, files)
    if file is None:
        return None
    table = csv.DictWriter(file, CSV_COLUMNS)
    table.writeheader()
    return table
