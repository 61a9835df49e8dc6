"""Results of a picture as JSON and CSV, and its settings as YAML."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable
from typing import Any

import cv2
import msgspec
import numpy as np
import yaml
from dockpose.app.experiment.versions import with_versions
from dockpose.app.export.rows import CSV_COLUMNS, to_row
from dockpose.app.processing.analysis import Analysis


def result_line(analysis: Analysis, sha256: str | None = None) -> dict[str, Any]:
    """Return the JSON object of schema 1, with version numbers; ``sha256`` is the checksum of the picture's file."""
    return with_versions(analysis.estimate.to_dict(analysis.view.source, frame=0, sha256=sha256))


def to_json(line: dict[str, Any]) -> bytes:
    """Return a JSON object as an indented file."""
    return (json.dumps(line, allow_nan=False, indent=2) + "\n").encode()


def to_csv(lines: Iterable[dict[str, Any]]) -> bytes:
    """Return a table with one row per JSON object and the columns of ``dockpose estimate --csv``."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CSV_COLUMNS)
    table.writeheader()
    table.writerows(to_row(line) for line in lines)
    return text.getvalue().encode()


def settings_yaml(analysis: Analysis) -> str:
    """Return the settings, dock and camera that were used and, where there is one, the measured pose as YAML."""
    view, found = analysis.view, analysis.estimate
    content: dict[str, Any] = {
        "source": view.source,
        "settings": _plain(found.settings),
        "dock": _plain(found.dock),
        "camera": _plain(found.camera),
    }
    if view.measured is not None:
        content["measured"] = _plain(view.measured)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def to_png(picture: np.ndarray) -> bytes:
    """Encode a picture as PNG, losslessly."""
    return cv2.imencode(".png", picture)[1].tobytes()


def _plain(value: Any) -> Any:
    """Convert to the plain lists, dictionaries and numbers that YAML can hold."""
    return msgspec.json.decode(msgspec.json.encode(value))
