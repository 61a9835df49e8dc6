"""Reports on a picture, a sequence or a session, one HTML file each that opens offline and prints well; their plots."""

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, POSE_NAMES
from dockpose.app.drawing.figures import new_figure, to_svg
from dockpose.app.drawing.numbers import (
    MISSING,
    QUANTITIES,
    number,
    percent,
    pose_cells,
    pose_sigmas,
    sigma_words,
    status_words,
)
from dockpose.app.experiment import SessionRecord
from dockpose.app.experiment.record import Row
from dockpose.app.export.data import table
from dockpose.app.export.parts import page
from dockpose.app.export.words import why_this_one
from dockpose.app.processing.analysis import Analysis, estimate_again
from dockpose.app.resources import versions
from dockpose.app.state.trust import headline_of
from dockpose.camera import mark
from dockpose.camera.image import decode, turned
from dockpose.pose.known import pose_error
from dockpose.thresholds import LEVELS, Threshold
from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PICTURES, MOST_ROWS = 24, 500
_WIDEST_PX, _WIDEST_OF_MANY_PX = 1600, 640
Item = TypeVar("Item")
_STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "^"), (BLUE, "o"), (ORANGE, "s"))  # one for each of QUANTITIES


def picture_report(analysis: Analysis, sha256: str | None = None) -> str:
    """Return the report of one picture: both poses, the histogram, and all settings."""
    view, found = analysis.view, analysis.estimate
    facts = {
        "Source": view.source,
        "Result": found.message,
        "Trust": analysis.trust.sentence,
        "Choice": why_this_one(found),
    }
    facts |= {"SHA-256 of the file": sha256} if sha256 else {}
    error = pose_error(found.selected, view.known_pose)
    facts |= {"Against the known pose": str(error)} if error is not None else {}
    threshold, picture = found.threshold, annotate(view.image, found, headline=headline_of(analysis.trust))
    return html_of(
        **{"title": view.source, "kind": "picture", "note": " ".join(view.notes), "facts": facts},
        groups=_groups(found.to_dict(view.source)) | {"Versions": versions()},
        tables=[_candidates_table(found)] if found.candidates else [],
        plots=[("Histogram and threshold", as_svg(histogram_figure(threshold), "histogram"))] if threshold else [],
        pictures=[(view.source, data_uri(picture, _WIDEST_PX))],
    )


def session_report(record: SessionRecord) -> str:
    """Return the report of a session: the table "estimated (measured)", errors against range, and its pictures."""
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
            pictures.append((f"{row.number}: {row.source}", annotated_uri(image, line)))
        except ValueError:
            missing += 1
    note = _left_out(len(record.rows), MOST_PICTURES, "pictures")
    note += f" {missing} of the pictures cannot be read." if missing else ""
    groups["Versions, when the session was made"] = _texts(record.info.get("program"))
    groups["Versions, of this report"] = versions()
    shown = {"head": content.head, "body": content.body, "foot": content.foot}
    return html_of(
        **{"title": record.name, "kind": "session", "note": note.strip(), "facts": facts, "groups": groups},
        tables=[{"title": "Estimated (measured)", **shown, "note": "Δ: estimated minus measured."}],
        plots=[("Error against range", as_svg(error_figure(record.rows), "errors"))] if record.rows else [],
        pictures=pictures,
    )


def sequence_report(path: Path, lines: Sequence[dict[str, Any]]) -> str:
    """Return the report of a sequence from lines of schema 1 as ``dockpose estimate --json`` writes them."""
    ok = sum(line["status"] == "ok" for line in lines)
    facts = {"File": path.name, "Frames": f"{len(lines)}, a dock in {ok}"}
    times = [line["time_s"] for line in lines if line.get("time_s") is not None]
    facts |= {"Time": f"{min(times):.3f} to {max(times):.3f} s"} if times else {}
    pictures = [
        (f"{line['source']}, frame {line['frame']}", annotated_uri(image, line))
        for line in _spread(lines, MOST_PICTURES)
        if (image := _picture_of(line, path.parent)) is not None
    ]
    poses = {
        "title": "Chosen poses",
        "head": ("Frame", "Time (s)", *QUANTITIES, "likely (%)", "Track", "Source"),
        "body": [_sequence_row(line) for line in _spread(lines, MOST_ROWS)],
        "note": _left_out(len(lines), MOST_ROWS, "frames"),
    }
    return html_of(
        **{"title": path.name, "kind": "sequence", "note": "", "facts": facts, "pictures": pictures},
        groups=_groups(lines[0] if lines else {}) | {"Versions, of this report": versions()},
        tables=[poses],
        plots=[("Pose over the sequence", as_svg(sequence_figure(lines), "sequence"))] if lines else [],
    )


def html_of(**report: Any) -> str:
    """Return a report's page."""
    return page("report.html", report=report)


def _groups(line: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    titles = {"image": "Picture", "camera": "Camera", "dock": "Dock", "settings": "Settings"}
    return {title: _texts(line[name]) for name, title in titles.items() if name in line}


def _texts(values: Any) -> dict[str, str]:
    """Return names and values as text; nested names are joined by dots."""
    texts: dict[str, str] = {}
    for name, value in values.items() if isinstance(values, dict) else ():
        if isinstance(value, dict):
            texts |= {f"{name}.{inner}": text for inner, text in _texts(value).items()}
        else:
            texts[str(name)] = MISSING if value is None or value == [] else str(value)
    return texts


def _candidates_table(found: Estimate) -> dict[str, Any]:
    body = []
    for name, pose in zip(POSE_NAMES, found.candidates, strict=False):
        cells, sigmas = pose_cells(pose, 2), pose_sigmas(pose)
        if None not in sigmas:
            cells = [f"{cell} ± {sigma_words(sigma)}" for cell, sigma in zip(cells, sigmas, strict=True)]
        chosen = ", chosen" if pose is found.selected else ""
        body.append((f"{name}{chosen}", *cells, percent(pose.probability), number(pose.rms_px, 3)))
    note = "±: one-sigma, with what camera and dock may be off. Position in the camera's frame: x right, y down."
    return {"title": "Both poses", "head": ("", *QUANTITIES, "likely (%)", "error (px)"), "body": body, "note": note}


def _sequence_row(line: Mapping[str, Any]) -> list[str]:
    cells, track = [status_words(line["status"]), *[""] * 5], line.get("track") or {}
    if (pose := chosen_of(line)) is not None:
        cells = [*(number(value, 2) for value in pose[:5]), percent(pose[5])]
    state = "" if not track else "lost" if track.get("lost") else "predicted" if track.get("predicted") else "seen"
    likely = track.get("probability")
    state += f" {percent(likely)} %" if likely is not None else ""
    return [str(line["frame"]), number(line["time_s"], 3), *cells, state, str(line["source"] or "")]


def _picture_of(line: Mapping[str, Any], folder: Path) -> np.ndarray | None:
    """Return the picture of a line if its file is still there, unchanged."""
    if not line.get("source") or not line.get("sha256"):
        return None
    for path in (Path(line["source"]), folder / line["source"]):
        try:
            data = path.read_bytes()
            if hashlib.sha256(data).hexdigest() == line["sha256"]:
                return turned(decode(data, str(path)), line.get("rotate_deg") or 0)
        except (OSError, ValueError):
            continue
    return None


def annotated_uri(image: np.ndarray, line: dict[str, Any]) -> str:
    """Return a picture of many with what its line found drawn over it."""
    return data_uri(annotate(image, estimate_again(image, line)))


def data_uri(picture: np.ndarray, widest_px: int = _WIDEST_OF_MANY_PX) -> str:
    """Return a picture to embed in HTML, made smaller where it is wider than that."""
    scale = min(1.0, widest_px / picture.shape[1])
    size = (max(1, round(scale * picture.shape[1])), max(1, round(scale * picture.shape[0])))
    scaled = picture if scale == 1 else cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    return f"data:image/jpeg;base64,{base64.b64encode(mark.to_jpeg(scaled, 88)).decode()}"


def as_svg(figure: "Figure", name: str) -> Markup:
    """Return a figure as SVG to embed in HTML: without the XML header, and without a fixed size."""
    text = to_svg(figure, name).decode()
    return Markup(re.sub(r' width="[\d.]+pt" height="[\d.]+pt"', "", text[text.index("<svg") :], count=1))


def _spread(items: Sequence[Item], most: int) -> list[Item]:
    """At most so many of the items, evenly spread, with the first and the last."""
    return [items[index] for index in np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)]


def _left_out(number: int, most: int, what: str) -> str:
    return f"{most} of the {number} {what} are shown, evenly spread." if number > most else ""


def histogram_figure(threshold: Threshold) -> "Figure":
    """Return a plot of the pixels at each grey level, the threshold, the peaks, and the groups each level leaves."""
    from dockpose.app.export.plots import SMALL, canvas, draw_histogram, legend_above

    figure = canvas(6.5, 3.0)
    axes = figure.add_subplot()
    draw_histogram(axes, threshold.histogram, threshold.level)
    axes.set_xlabel("grey level (0 to 255)", fontsize=SMALL)
    peaks = [peak.level for peak in threshold.peaks]
    if peaks:
        axes.plot(peaks, threshold.histogram[peaks] + 1, "v", color=colours.PEAKS_COLOUR, label="peaks")
    groups = np.where(threshold.groups_at_level < 0, np.nan, threshold.groups_at_level)
    if np.isfinite(groups).any():
        right = axes.twinx()
        right.plot(np.arange(LEVELS), groups, "--", color=colours.GROUPS_COLOUR, drawstyle="steps-mid")
        axes.plot([], [], "--", color=colours.GROUPS_COLOUR, label="groups (right)")
        at_level = groups[threshold.level] if threshold.level < LEVELS else np.nan
        right.set_ylim(0, max(10.0, 2 * np.nan_to_num(at_level)))
        right.set_ylabel("groups", fontsize=SMALL)
        right.tick_params(labelsize=SMALL - 1)
    legend_above(figure, axes, ncols=4, fontsize=SMALL)
    return figure


def error_figure(rows: Sequence[Row]) -> "Figure":
    """Return a plot of estimated minus measured against range: position above, angles below."""
    figure = new_figure(6.5, 4.8, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    ranges = _numbers(row.range_cm for row in rows) / 100
    errors = np.array([row.errors for row in rows], dtype=float).reshape(-1, 5)
    _draw_quantities((above, below), ranges, errors, "nothing was measured")
    above.set_ylabel("estimated − measured (cm)")
    below.set(xlabel="range (m)", ylabel="estimated − measured (°)")
    return figure


def sequence_figure(lines: Sequence[dict[str, Any]]) -> "Figure":
    """Return a plot of the chosen pose of each line of schema 1 over time, or over frames where times are unknown."""
    times = [line.get("time_s") for line in lines]
    timed = all(time is not None for time in times) and len(set(times)) == len(times)
    across = _numbers(times if timed else range(len(lines)))
    poses = np.array([chosen_of(line) or (None,) * 6 for line in lines], dtype=float).reshape(-1, 6)
    figure = new_figure(6.5, 6.4, layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    _draw_quantities((top, middle), across, poses, "no dock was found")
    bottom.plot(across, poses[:, 5], "o", color=BLUE, markersize=2.5, label="of the chosen pose, from its frame alone")
    tracked = _numbers((line.get("track") or {}).get("probability") for line in lines)
    if np.isfinite(tracked).any():
        bottom.plot(across, tracked, "^", color=ORANGE, markersize=2.5, label="with earlier frames")
    for axes, label in ((top, "position (cm)"), (middle, "attitude (°)"), (bottom, "probability")):
        axes.set_ylabel(label)
    bottom.legend(fontsize=8)
    bottom.set(ylim=(-0.05, 1.05), xlabel="time (s)" if timed else "frame")
    return figure


def _draw_quantities(both: "tuple[Axes, Axes]", across: np.ndarray, values: np.ndarray, otherwise: str) -> None:
    """Draw values (N, 5 or more) of ``QUANTITIES``, positions above and angles below; or say why there are none."""
    for index, (colour, shape) in enumerate(_STYLES):
        if np.isfinite(values[:, index]).any():
            label = QUANTITIES[index].split()[0]
            both[index // 3].plot(across, values[:, index], shape, color=colour, markersize=2.5, label=label)
    for axes in both:
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8)
        else:
            axes.text(0.5, 0.6, otherwise, transform=axes.transAxes, ha="center")


def _numbers(values: Iterable[float | None]) -> np.ndarray:
    """Numbers (N,); NaN for None."""
    return np.array(list(values), dtype=float)


def chosen_of(line: Mapping[str, Any]) -> list[Any] | None:
    """Return a line's chosen pose in the order and units of ``QUANTITIES``, then its probability; None without one."""
    if line["selected"] is None:
        return None
    pose = line["candidates"][line["selected"]]
    lengths = (100 * value for value in pose["position_m"])
    return [*lengths, pose["theta_x_deg"], pose["theta_y_deg"], pose["probability"]]
