"""What the calibration panel shows: the board in the picture, what is covered, and how well each picture fits."""

from collections.abc import Sequence
from html import escape

import cv2
import numpy as np
from dockpose.app.drawing.colours import BLUE, bgr
from dockpose.app.export.calibration import advice, outcome
from dockpose.app.web.html import row, table
from dockpose.camera.board import Board, Sighting
from dockpose.camera.calibrate import BoardView
from dockpose.camera.coverage import Coverage

SMALL = "padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35"
WIDTH_PX = 340
_SEEN_BGR = bgr(BLUE)
_CELL = "width: 2.2em; height: 1.6em; text-align: center; border: 1px solid rgba(128,128,128,0.5)"


def picture_with_board(grey: np.ndarray, found: Sighting | None, board: Board, counted_as: str) -> np.ndarray:
    """A small RGB copy of a grey picture (H, W), with the board's corners where one was found."""
    scale = WIDTH_PX / grey.shape[1]
    small = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    shown = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)
    if found is not None:
        corners = ((found.picture_px + 0.5) * scale - 0.5).astype(np.float32)
        across, down = board.inner(counted_as)
        if len(corners) == across * down:
            grid = corners.reshape(down, across, 2)
            for line in [*grid, *grid.transpose(1, 0, 2)]:
                cv2.polylines(shown, [np.rint(line * 8).astype(np.int32)], False, _SEEN_BGR, 1, cv2.LINE_AA, 3)
        for x, y in corners.tolist():
            cv2.circle(shown, (round(x), round(y)), 2, _SEEN_BGR, -1, cv2.LINE_AA)
    return cv2.cvtColor(shown, cv2.COLOR_BGR2RGB)


def seen_html(name: str, found: Sighting | None, dropped: str) -> str:
    """Whether the board was seen in the newest picture, and whether that counts."""
    if found is None:
        text = f"{escape(name)}: {escape(dropped)}."
    elif dropped:
        text = f"{escape(name)}: board seen, not taken: {escape(dropped)}."
    else:
        text = f"{escape(name)}: <b>board seen and taken</b>, {len(found.picture_px)} corners."
    return f'<div id="calibration-seen" style="{SMALL}">{text}</div>'


def coverage_html(covered: Coverage) -> str:
    """The parts of the picture that boards reached and how often, tilts, distances, and what to add."""
    rows = "".join(
        "<tr>" + "".join(f'<td style="{_CELL}; {_shade(count)}">{count}</td>' for count in cells) + "</tr>"
        for cells in covered.cells.tolist()
    )
    parts = [f"{covered.pictures} {'view' if covered.pictures == 1 else 'views'}"]
    if covered.pictures:
        (left, top), (right, bottom) = covered.tilts_deg.min(axis=0), covered.tilts_deg.max(axis=0)
        parts.append(f"tilts {left:.0f}° to {right:.0f}° sideways, {top:.0f}° to {bottom:.0f}° up and down")
        parts.append(f"farthest {covered.distances.max():.1f} times the nearest")
    words = "That is enough." if covered.is_enough else f"Still wanted: {escape(advice(covered))}."
    return (
        f'<div id="calibration-covered" style="{SMALL}"><table style="border-collapse: collapse; margin: 0.3em 0">'
        f"{rows}</table>{escape(', '.join(parts))}. {words}</div>"
    )


def _shade(count: int) -> str:
    return f"background: rgba(0,114,178,{min(count, 4) / 8:.2f})"


def pictures_html(views: Sequence[BoardView]) -> str:
    """A table of the pictures: the error of each, or why it was dropped."""
    rows = [row(escape(view.name), [escape(outcome(view))]) for view in views]
    return table("calibration-pictures", ["error"], rows)


def result_html(lines: Sequence[str]) -> str:
    """The camera in sentences."""
    return "".join(f'<div class="calibration-line" style="{SMALL}">{escape(line)}</div>' for line in lines)
