"""What was found: a sentence, a line that is always in view, and both candidates in a table."""

from __future__ import annotations

import math
from html import escape

import viser
from dockpose.app.export.words import status_line
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import MISSING, pose_name, row, table, wide_row
from dockpose.app.web.widgets import Panel
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose

COLUMNS = ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "likely (%)", "error (px)")
EXPLANATION = (
    "The dock's centre from the camera: x right, y down, z ahead. θx, θy: pitch and yaw of its face, 0 where it is "
    "square on. Error: how far off the lights are, root mean square."
)
# Along the bottom of the whole page, over whatever scrolls there; the panel at the left leaves STATUS_SPACE for it. The
# panel at the right covers its end, so that long words break before it.
_COVERED_PX = 385
_LINE = (
    "position: fixed; left: 0; right: 0; bottom: 0; z-index: 500; font-weight: 600; pointer-events: none; "
    f"padding: 0.25em {_COVERED_PX}px 0.25em 0.75em; "
    "background: var(--mantine-color-body); border-top: 1px solid rgba(128,128,128,0.5)"
)
STATUS_SPACE = '<div style="height: 2em"></div>'


def candidate_row(pose: CirclePose) -> list[str]:
    """One candidate's numbers as the table shows them."""
    return [
        *(f"{100 * value:.1f}" for value in pose.position_m),
        f"{math.degrees(pose.theta_x_rad):.1f}",
        f"{math.degrees(pose.theta_y_rad):.1f}",
        MISSING if pose.probability is None else f"{100 * pose.probability:.1f}",
        MISSING if pose.rms_px is None else f"{pose.rms_px:.2f}",
    ]


def known_row(known: KnownPose) -> list[str]:
    """A known pose in the same columns."""
    numbers = (*(100 * value for value in known.position_m), known.theta_x_deg, known.theta_y_deg)
    return [*(f"{number:.1f}" for number in numbers), MISSING, MISSING]


def status_html(analysis: Analysis) -> str:
    """The picture's name, what was found in it and what to try, in words; and the line of numbers along the bottom."""
    found = analysis.estimate
    verdict, colour = ("Dock found", "#009E73") if found.status == "ok" else ("No pose", "#D55E00")
    words = " ".join(text for text in (found.message, analysis.view.note) if text)
    return (
        f'<div role="status" style="padding: 0.2em 0.75em 0.4em; line-height: 1.35; min-height: 3em">'
        f'<b style="border-left: 0.35em solid {colour}; padding-left: 0.4em">{verdict}</b> in '
        f"{escape(analysis.view.source)} ({found.width} × {found.height}). {escape(words)}"
        f'<div id="status-line" style="{_LINE}; border-left: 0.6em solid {colour}">{escape(status_line(found))}</div>'
        "</div>"
    )


def table_html(analysis: Analysis) -> str:
    """Both candidates and, where they are known, the truth and the measured pose."""
    found = analysis.estimate
    rows = []
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        rows.append(row(pose_name(index, is_chosen), candidate_row(pose), bold=is_chosen))
    for name, known in (("Truth", analysis.view.truth), ("Measured", analysis.view.measured)):
        if known is not None:
            rows.append(row(name, known_row(known)))
    if not rows:
        rows.append(wide_row("No pose to show.", len(COLUMNS) + 1))
    return table("candidates", COLUMNS, rows, EXPLANATION)


class StatusPanel(Panel):
    """One line and a sentence, always shown."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._status = gui.add_html("")

    def show(self, analysis: Analysis) -> None:
        """Say what was found."""
        self._status.content = status_html(analysis)


class ResultPanel(Panel):
    """The table of both candidates."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._table = gui.add_html("")
        gui.add_html(STATUS_SPACE)

    def show(self, analysis: Analysis) -> None:
        """Fill the table."""
        self._table.content = table_html(analysis)
