"""What was found: a sentence that is always there, and both candidates in a table."""

from __future__ import annotations

import math
from html import escape
from typing import Any

import viser

from app.annotate import POSE_COLOURS, POSE_NAMES
from app.reading import Reading
from app.state import View
from pipeline.circle_pose import CirclePose

COLUMNS = ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "likely (%)", "error (px)")
EXPLANATION = (
    "Position of the dock's centre seen from the camera: x right, y down, z ahead. θx, θy: pitch and yaw of the dock's "
    "face, 0 where it is square on. Error: how far off the lights are, root mean square."
)
_MISSING = "–"
_NUMBERS = "padding: 0.15em 0.4em; text-align: right; font-variant-numeric: tabular-nums"


def candidate_row(pose: CirclePose) -> list[str]:
    """One candidate's numbers as the table shows them."""
    return [
        *(f"{100 * value:.1f}" for value in pose.position_m),
        f"{math.degrees(pose.theta_x_rad):.1f}",
        f"{math.degrees(pose.theta_y_rad):.1f}",
        _MISSING if pose.probability is None else f"{100 * pose.probability:.1f}",
        _MISSING if pose.rms_px is None else f"{pose.rms_px:.2f}",
    ]


def truth_row(truth: dict[str, Any] | None) -> list[str] | None:
    """What a simulated picture really shows, in the same columns; None where it is not known."""
    if truth is None or not {"position_m", "theta_x_deg", "theta_y_deg"} <= truth.keys():
        return None
    return [
        *(f"{100 * value:.1f}" for value in truth["position_m"]),
        f"{truth['theta_x_deg']:.1f}",
        f"{truth['theta_y_deg']:.1f}",
        _MISSING,
        _MISSING,
    ]


def status_html(reading: Reading) -> str:
    """The picture's name and what was found in it, in words."""
    found = reading.estimate
    verdict, colour = ("Dock found", "#009E73") if found.status == "ok" else ("No pose", "#D55E00")
    note = f" {escape(reading.view.note)}" if reading.view.note else ""
    return (
        f'<div role="status" style="padding: 0.2em 0.75em 0.5em; line-height: 1.4; min-height: 3em">'
        f'<b style="border-left: 0.35em solid {colour}; padding-left: 0.4em">{verdict}</b> in '
        f"{escape(reading.view.source)} ({found.width} × {found.height}, {found.elapsed_ms:.0f} ms). "
        f"{escape(found.message)}{note}</div>"
    )


def table_html(reading: Reading) -> str:
    """Both candidates and, where it is known, the truth."""
    found = reading.estimate
    head = "".join(f'<th style="{_NUMBERS}">{name}</th>' for name in COLUMNS)
    rows = []
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        rows.append(_row(_pose_name(index, is_chosen), candidate_row(pose), bold=is_chosen))
    truth = truth_row(reading.view.truth)
    if truth is not None:
        rows.append(_row("Truth", truth, bold=False))
    if not rows:
        rows.append(f'<tr><td colspan="{len(COLUMNS) + 1}">No pose to show.</td></tr>')
    return (
        '<div style="padding: 0 0.75em 0.5em; font-size: 0.85em">'
        f'<table id="candidates" style="width: 100%; border-collapse: collapse"><thead><tr><th></th>{head}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table>"
        f'<div style="opacity: 0.75; padding-top: 0.4em; line-height: 1.35">{EXPLANATION}</div></div>'
    )


class StatusPanel:
    """One sentence, always shown."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._status = gui.add_html("")

    def load(self, view: View) -> None:
        """There are no controls here."""

    def show(self, reading: Reading) -> None:
        """Say what was found."""
        self._status.content = status_html(reading)


class ResultPanel:
    """The table of both candidates."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._table = gui.add_html("")

    def load(self, view: View) -> None:
        """There are no controls here."""

    def show(self, reading: Reading) -> None:
        """Fill the table."""
        self._table.content = table_html(reading)


def _pose_name(index: int, is_chosen: bool) -> str:
    blue, green, red = POSE_COLOURS[index]
    mark = f'<span style="color: rgb({red},{green},{blue})">{"●" if is_chosen else "○"}</span>'
    return f"{mark} {POSE_NAMES[index]}{', chosen' if is_chosen else ''}"


def _row(name: str, cells: list[str], *, bold: bool) -> str:
    style = "border-top: 1px solid rgba(128,128,128,0.35)" + ("; font-weight: 600" if bold else "")
    columns = "".join(f'<td style="{_NUMBERS}">{cell}</td>' for cell in cells)
    return f'<tr style="{style}"><td style="white-space: nowrap">{name}</td>{columns}</tr>'
