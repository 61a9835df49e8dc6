"""``dockpose estimate``: pictures in, JSON lines, a table and annotated pictures out."""

from __future__ import annotations

import contextlib
import csv
import hashlib
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import cv2
import numpy as np

from app.annotate import POSE_NAMES, annotate
from app.samples import read_sidecar
from app.sources import UsageError
from pipeline import Camera, Dock, Estimate, Settings, estimate
from pipeline.camera_files import FileError
from pipeline.image import decode

EXIT_ALL_READ, EXIT_SOME_UNREADABLE = 0, 1
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


@dataclass(frozen=True)
class _Job:
    path: Path
    camera: Camera
    dock: Dock


def estimate_sources(
    pictures: Sequence[Path], camera: Camera | None, dock: Dock | None, settings: Settings, outputs: Outputs
) -> int:
    """Estimate every picture and write what was asked for.

    Parameters
    ----------
    pictures : files, in order.
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
    jobs, unreadable = _jobs(pictures, camera, dock)
    with contextlib.ExitStack() as files:
        json_file = _open(outputs.json, files)
        table = _open_table(outputs.csv, files)
        taken = {path.resolve() for path in pictures}
        if outputs.annotate is not None:
            _make_folder(outputs.annotate)
        for job in jobs:
            try:
                image, found, line = _estimate_one(job, settings)
            except ValueError as error:
                unreadable = True
                _complain(str(error) if str(job.path) in str(error) else f"{job.path}: {error}")
                continue
            if json_file is not None:
                print(json.dumps(line, allow_nan=False), file=json_file, flush=True)
            if table is not None:
                table.writerow(_row(line))
            if outputs.annotate is not None:
                _write_picture(_free_path(outputs.annotate, job.path, taken), annotate(image, found))
            if outputs.none_asked:
                print(f"{job.path}: {found.message}")
    return EXIT_SOME_UNREADABLE if unreadable else EXIT_ALL_READ


def _jobs(pictures: Sequence[Path], camera: Camera | None, dock: Dock | None) -> tuple[list[_Job], bool]:
    """Pair every picture with its camera and dock; also tells whether some YAML beside a picture was unusable."""
    jobs, unusable = [], False
    for path in pictures:
        own_camera, own_dock = camera, dock
        if camera is None or dock is None:
            try:
                sidecar = read_sidecar(path)
            except FileError as error:
                _complain(str(error))
                unusable = True
                continue
            own_camera, own_dock = camera or sidecar.camera, dock or sidecar.dock
        if own_camera is None and path.is_file():
            raise UsageError(f"{path}: which camera? Give --camera C.yaml, or {path.stem}.yaml beside the picture")
        if own_dock is None and path.is_file():
            raise UsageError(f"{path}: how large is the dock? Give --dock-diameter in metres")
        if own_camera is None or own_dock is None:
            _complain(f"{path}: there is no such file")
            unusable = True
            continue
        jobs.append(_Job(path, own_camera, own_dock))
    return jobs, unusable


def _estimate_one(job: _Job, settings: Settings) -> tuple[np.ndarray, Estimate, dict[str, Any]]:
    try:
        data = job.path.read_bytes()
    except OSError as error:
        raise FileError(f"{job.path}: cannot be read ({error.strerror or error})") from error
    image = decode(data, str(job.path))
    found = estimate(image, job.camera, job.dock, settings)
    return image, found, found.to_dict(str(job.path), frame=0, sha256=hashlib.sha256(data).hexdigest())


def _row(line: dict[str, Any]) -> dict[str, Any]:
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


def _open(target: str | None, files: contextlib.ExitStack) -> TextIO | None:
    if target is None:
        return None
    if target == "-":
        return sys.stdout
    try:
        return files.enter_context(open(target, "w", encoding="utf-8", newline=""))
    except OSError as error:
        raise UsageError(f"{target}: cannot be written ({error.strerror or error})") from error


def _open_table(target: str | None, files: contextlib.ExitStack) -> csv.DictWriter[str] | None:
    file = _open(target, files)
    if file is None:
        return None
    table = csv.DictWriter(file, CSV_COLUMNS)
    table.writeheader()
    return table


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: cannot be made ({error.strerror or error})") from error


def _free_path(folder: Path, picture: Path, taken: set[Path]) -> Path:
    """Path for the annotated copy of a picture that overwrites neither another copy nor a picture, now taken."""
    path, number = folder / f"{picture.stem}.png", 1
    while path.resolve() in taken:
        number += 1
        path = folder / f"{picture.stem}-{number}.png"
    taken.add(path.resolve())
    return path


def _write_picture(path: Path, picture: np.ndarray) -> None:
    try:
        path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror or error})") from error


def _complain(text: str) -> None:
    print(f"dockpose: {text}", file=sys.stderr)
