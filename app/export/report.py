"""Reports on a picture or a session, one HTML file each that opens offline and prints well; their plots."""

import base64
import re
from collections.abc import Mapping, Sequence
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
from dockpose.pose.known import pose_error
from dockpose.thresholds import LEVELS, Threshold
from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PICTURES = 24
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
    both = figure.subplots(2, 1, sharex=True)
    ranges = np.array([row.range_cm for row in rows], dtype=float) / 100  # None becomes NaN
    errors = np.array([row.errors for row in rows], dtype=float).reshape(-1, 5)
    for index, (colour, shape) in enumerate(_STYLES):
        if np.isfinite(errors[:, index]).any():
            label = QUANTITIES[index].split()[0]
            both[index // 3].plot(ranges, errors[:, index], shape, color=colour, markersize=2.5, label=label)
    for axes, unit in zip(both, ("cm", "°"), strict=True):
        axes.set_ylabel(f"estimated − measured ({unit})")
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8)
        else:
            axes.text(0.5, 0.6, "nothing was measured", transform=axes.transAxes, ha="center")
    both[1].set_xlabel("range (m)")
    return figure
