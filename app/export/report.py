"""One HTML file that says it all, of a picture, a sequence or a session; it opens offline and prints well."""

from __future__ import annotations

import base64
import datetime
import functools
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import cv2
import jinja2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.figures import to_svg
from dockpose.app.drawing.overlay import LAYERS
from dockpose.app.experiment import SessionRecord
from dockpose.app.experiment.table import MISSING, table
from dockpose.app.experiment.versions import versions
from dockpose.app.export.plots import error_figure, histogram_figure, sequence_figure
from dockpose.app.export.words import why_this_one
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.replay import estimate_again
from dockpose.app.resources import static_path
from dockpose.camera.image import decode
from dockpose.pose.known import pose_error
from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PICTURES, MOST_ROWS = 24, 500
_WIDEST_PX = {1: 1600, MOST_PICTURES: 640}
Item = TypeVar("Item")


@dataclass(frozen=True)
class ReportTable:
    """A table of the report; cells are plain text. ``note`` stands below it."""

    title: str
    head: Sequence[str]
    body: Sequence[Sequence[str]]
    foot: Sequence[Sequence[str]] = ()
    note: str = ""


@dataclass(frozen=True)
class Report:
    """What the template is filled in with; every text is plain and is escaped there.

    Attributes
    ----------
    title, kind : what it is of, and whether that is a picture, a sequence or a session.
    facts : name and value, to stand at the top.
    groups : title and names and values: set-up, camera, dock, settings, versions.
    tables, plots, pictures : in the order in which they stand; plots are our own SVG, pictures data addresses.
    """

    title: str
    kind: str
    facts: Mapping[str, str]
    groups: Mapping[str, Mapping[str, str]]
    tables: Sequence[ReportTable] = ()
    plots: Sequence[tuple[str, Markup]] = ()
    pictures: Sequence[tuple[str, str]] = ()
    note: str = ""

    def html(self) -> str:
        """The file's text."""
        made = datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")
        return _template().render(report=self, made=made)


def picture_report(analysis: Analysis, sha256: str | None = None) -> str:
    """Report of one picture: both poses, the histogram, and all that it was read with."""
    view, found = analysis.view, analysis.estimate
    facts = {"Source": view.source, "Result": found.message, "Choice": why_this_one(found)}
    facts |= {"SHA-256 of the file": sha256} if sha256 else {}
    error = pose_error(found.selected, view.known_pose)
    facts |= {"Against the known pose": str(error)} if error is not None else {}
    plots = []
    if found.threshold is not None:
        plots.append(("Histogram and threshold", _svg(histogram_figure(found.threshold), "histogram")))
    line = found.to_dict(view.source)
    return Report(
        view.source,
        "picture",
        facts,
        _groups(line) | {"Versions": versions()},
        [_candidates_table(found)] if found.candidates else [],
        plots,
        [(view.source, _data_uri(annotate(view.image, found, layers=LAYERS), 1))],
        view.note,
    ).html()


def session_report(record: SessionRecord) -> str:
    """Report of a session: the table "estimated (measured)", errors against range, and its pictures."""
    content = table(record.rows)
    ok = sum(row.status == "ok" for row in record.rows)
    facts = {
        "Session": record.name,
        "Made": str(record.info.get("created", MISSING)),
        "Frames": f"{len(record.rows)}, a dock in {ok}",
        "Notes": str(record.info.get("notes") or MISSING),
    }
    pictures, groups, missing = [], {}, 0
    for row in _spread(record.rows, MOST_PICTURES):
        try:
            line = record.line(row)
            groups = groups or _groups(line)
            image = record.picture(row)
            pictures.append((f"{row.number}: {row.source}", _annotated_uri(image, line, MOST_PICTURES)))
        except ValueError:
            missing += 1
    note = _left_out(len(record.rows), MOST_PICTURES, "pictures")
    note += f" {missing} of the pictures cannot be read." if missing else ""
    groups["Versions, when the session was made"] = _texts(record.info.get("program"))
    groups["Versions, of this report"] = versions()
    return Report(
        record.name,
        "session",
        facts,
        groups,
        [ReportTable("Estimated (measured)", content.head, content.body, content.foot, "Δ: estimated minus measured.")],
        [("Error against range", _svg(error_figure(record.rows), "errors"))] if record.rows else [],
        pictures,
        note.strip(),
    ).html()


def sequence_report(path: Path, lines: Sequence[dict[str, Any]]) -> str:
    """Report of a sequence: lines of schema 1 as ``dockpose estimate --json`` writes them."""
    ok = sum(line["status"] == "ok" for line in lines)
    facts = {"File": path.name, "Frames": f"{len(lines)}, a dock in {ok}"}
    times = [line["time_s"] for line in lines if line.get("time_s") is not None]
    facts |= {"Time": f"{min(times):.3f} to {max(times):.3f} s"} if times else {}
    pictures = []
    for line in _spread(lines, MOST_PICTURES):
        image = _picture_of(line, path.parent)
        if image is not None:
            caption = f"{line['source']}, frame {line['frame']}"
            pictures.append((caption, _annotated_uri(image, line, MOST_PICTURES)))
    shown = [_sequence_row(line) for line in _spread(lines, MOST_ROWS)]
    head = ("Frame", "Time (s)", "x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "likely (%)", "Track", "Source")
    first = lines[0] if lines else {}
    return Report(
        path.name,
        "sequence",
        facts,
        _groups(first) | {"Versions, of this report": versions()},
        [ReportTable("Chosen poses", head, shown, note=_left_out(len(lines), MOST_ROWS, "frames"))],
        [("Pose over the sequence", _svg(sequence_figure(lines), "sequence"))] if lines else [],
        pictures,
    ).html()


@functools.cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    return environment.from_string(static_path("report.html").read_text(encoding="utf-8"))


def _groups(line: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    titles = {"image": "Picture", "camera": "Camera", "dock": "Dock", "settings": "Settings"}
    return {title: _texts(line[name]) for name, title in titles.items() if name in line}


def _texts(values: Any) -> dict[str, str]:
    """Names and values as text, those within others by a dot."""
    texts: dict[str, str] = {}
    for name, value in values.items() if isinstance(values, dict) else ():
        if isinstance(value, dict):
            texts |= {f"{name}.{inner}": text for inner, text in _texts(value).items()}
        else:
            texts[str(name)] = MISSING if value is None or value == [] else str(value)
    return texts


def _candidates_table(found: Estimate) -> ReportTable:
    head = ("", "x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "likely (%)", "error (px)")
    body = []
    for index, pose in enumerate(found.to_dict()["candidates"]):
        values = [*(100 * value for value in pose["position_m"]), pose["theta_x_deg"], pose["theta_y_deg"]]
        sigmas = [100 * value for value in pose["sigma_position_m"] or ()] + list(pose["sigma_theta_deg"] or ())
        cells = [f"{value:.2f}" for value in values]
        if len(sigmas) == len(cells):
            cells = [f"{cell} ± {sigma:.2f}" for cell, sigma in zip(cells, sigmas, strict=True)]
        chosen = found.choice is not None and index == found.choice.selected
        name = f"{POSE_NAMES[index]}{', chosen' if chosen else ''}"
        body.append((name, *cells, _number(pose["probability"], 100, 1), _number(pose["rms_px"], 1, 3)))
    return ReportTable("Both poses", head, body, note="±: one-sigma. Position in the camera's frame: x right, y down.")


def _sequence_row(line: Mapping[str, Any]) -> list[str]:
    cells = [str(line["frame"]), _number(line["time_s"], 1, 3)]
    if line["selected"] is None:
        cells += [line["status"].replace("_", " "), *[""] * 5]
    else:
        pose = line["candidates"][line["selected"]]
        cells += [_number(value, 100, 2) for value in pose["position_m"]]
        cells += [_number(pose["theta_x_deg"], 1, 2), _number(pose["theta_y_deg"], 1, 2)]
        cells.append(_number(pose["probability"], 100, 1))
    track = line.get("track")
    state = "" if not track else "lost" if track.get("lost") else "predicted" if track.get("predicted") else "seen"
    chance = _number(track.get("probability"), 100, 1) if track else ""
    return [*cells, f"{state} {chance} %" if state and chance != MISSING else state, str(line["source"] or "")]


def _number(value: float | None, factor: float, decimals: int) -> str:
    return MISSING if value is None else f"{factor * value:.{decimals}f}"


def _picture_of(line: Mapping[str, Any], folder: Path) -> np.ndarray | None:
    """The picture of a line, where its file is still there and still the same."""
    if not line.get("source") or not line.get("sha256"):
        return None
    for path in (Path(line["source"]), folder / line["source"]):
        try:
            data = path.read_bytes()
            if hashlib.sha256(data).hexdigest() == line["sha256"]:
                return decode(data, str(path))
        except (OSError, ValueError):
            continue
    return None


def _annotated_uri(image: np.ndarray, line: dict[str, Any], pictures: int) -> str:
    return _data_uri(annotate(image, estimate_again(image, line), layers=LAYERS), pictures)


def _data_uri(picture: np.ndarray, pictures: int) -> str:
    """A picture as an address that holds it, scaled down to the width that so many pictures are given."""
    scale = min(1.0, _WIDEST_PX[pictures] / picture.shape[1])
    size = (max(1, round(scale * picture.shape[1])), max(1, round(scale * picture.shape[0])))
    scaled = picture if scale == 1 else cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    data = cv2.imencode(".jpg", scaled, [cv2.IMWRITE_JPEG_QUALITY, 88])[1].tobytes()
    return f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"


def _svg(figure: Figure, name: str) -> Markup:
    """A figure to stand within HTML: without the lines in front that a file has, and without numbers for width."""
    text = to_svg(figure, name).decode()
    return Markup(re.sub(r' width="[\d.]+pt" height="[\d.]+pt"', "", text[text.index("<svg") :], count=1))


def _spread(items: Sequence[Item], most: int) -> Iterable[Item]:
    """At most so many of them, evenly spread, the first and the last included."""
    if len(items) <= most:
        return items
    return [items[round(index * (len(items) - 1) / (most - 1))] for index in range(most)]


def _left_out(number: int, most: int, what: str) -> str:
    return f"{most} of the {number} {what} are shown, evenly spread." if number > most else ""
