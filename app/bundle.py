"""All results of one picture in one ZIP file, to take away."""

from __future__ import annotations

import csv
import io
import json
import re
import zipfile
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import yaml

from app.comparison import compare_view
from app.estimate_command import CSV_COLUMNS, to_row
from app.montage import montage
from app.reading import Reading
from app.task import Progress

_LONGEST_NAME = 60


def bundle(reading: Reading, progress: Progress, *, with_montage: bool = True) -> bytes:
    """Return a ZIP file of what was found.

    Parameters
    ----------
    reading : what to write.
    progress : told method by method while the montage is made.
    with_montage : whether to try every method for a montage, which takes longest.

    Returns
    -------
    The file's bytes: annotated.png, result.json (schema 1), result.csv (a row), settings.yaml (camera, dock and
    settings), and montage.png.
    """
    view, found = reading.view, reading.estimate
    line = found.to_dict(view.source, frame=0)
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("annotated.png", _png(reading.annotated))
        archive.writestr("result.json", json.dumps(line, allow_nan=False, indent=2) + "\n")
        archive.writestr("result.csv", _csv(line))
        archive.writestr("settings.yaml", settings_yaml(reading))
        if with_montage:
            known = view.truth if view.truth is not None else view.measured
            archive.writestr("montage.png", _png(montage(view.image, compare_view(view, progress), known)))
    return memory.getvalue()


def bundle_name(source: str) -> str:
    """File name of the bundle of a picture: nothing in it that any machine's file system would mind."""
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", Path(source).stem).strip("_")[:_LONGEST_NAME]
    return f"dockpose_{stem or 'picture'}.zip"


def settings_yaml(reading: Reading) -> str:
    """What the picture was read with, as YAML: settings, dock, camera, and the measured pose where there is one."""
    view = reading.view
    content: dict[str, Any] = {
        "source": view.source,
        "settings": _plain(view.settings),
        "dock": _plain(view.dock),
        "camera": _plain(view.camera),
    }
    if view.measured is not None:
        content["measured"] = view.measured
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def _plain(value: Any) -> Any:
    """Lists, dictionaries and numbers only, as a YAML file can hold them."""
    return msgspec.json.decode(msgspec.json.encode(value))


def _csv(line: dict[str, Any]) -> str:
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CSV_COLUMNS)
    table.writeheader()
    table.writerow(to_row(line))
    return text.getvalue()


def _png(picture: np.ndarray) -> bytes:
    return cv2.imencode(".png", picture)[1].tobytes()
