"""The picture in all its forms, what was found in it, and the viewpoint of the 3D scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from html import escape

import cv2
import numpy as np
import viser
from dockpose.app.drawing.canvas import to_bgr8
from dockpose.app.drawing.colours import TRUST_COLOURS
from dockpose.app.drawing.numbers import QUANTITIES
from dockpose.app.export.words import advice
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import help_link, pose_name, result_cells, row, table, wide_row
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.scene.viewpoints import NAMES
from dockpose.app.web.widgets import Panel, on_click

COLUMNS = (*QUANTITIES, "likely (%)", "error (px)")
EXPLANATION = (
    "The dock's centre from the camera: x right, y down, z ahead. θx, θy: pitch and yaw of its face, 0 where it is "
    "square on. Error: how far off the lights are, root mean square."
)
_JPEG_QUALITY = 90
_TALLEST = 3 / 4  # height to width: a taller picture would push the table below it off a small screen
_KEY = (
    '<div style="padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35">Pixels at least as bright as the '
    "threshold. <b style='color: #009E73'>Green in a circle</b>: a light on the ring. "
    "<b style='color: #D55E00'>Orange under a cross</b>: thrown out. Grey, unmarked: smaller than the minimum area."
    "</div>"
)


def status_html(analysis: Analysis) -> str:
    """The picture's name, what was found in it and what to try, in words."""
    found, trust = analysis.estimate, analysis.trust
    colour = TRUST_COLOURS[trust.colour]
    notes = analysis.view.notes[analysis.view.camera_of == "guess" :]  # of a guess the reasons tell already
    words = " ".join(text for text in (*trust.reasons, found.message, *notes, advice(found)) if text)
    return (
        f'<div role="status" style="padding: 0.2em 0.75em 0.4em; line-height: 1.35; min-height: 3em">'
        f'<b id="trust" data-trust="{trust.colour}" style="border-left: 0.35em solid {colour}; padding-left: 0.4em">'
        f"{trust.verdict}</b> in "
        f"{escape(analysis.view.source)} ({found.width} × {found.height}). {escape(words)}"
        "</div>"
    )


def table_html(analysis: Analysis) -> str:
    """Both candidates and, where they are known, the truth and the measured pose."""
    found = analysis.estimate
    rows = []
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        rows.append(row(pose_name(index, is_chosen), result_cells(pose), bold=is_chosen))
    for name, known in (("Truth", analysis.view.truth), ("Measured", analysis.view.measured)):
        if known is not None:
            rows.append(row(name, result_cells(known)))
    if not rows:
        rows.append(wide_row("No pose to show.", len(COLUMNS) + 1))
    return table("candidates", COLUMNS, rows, EXPLANATION)


def widen(picture: np.ndarray) -> np.ndarray:
    """Put grey beside a tall picture (H, W, 3), so that it is at most 3/4 as tall as wide."""
    height, width = picture.shape[:2]
    missing = math.ceil(height / _TALLEST) - width
    if missing <= 0:
        return picture
    left = missing // 2
    return np.pad(picture, ((0, 0), (left, missing - left), (0, 0)), constant_values=128)


class PicturePanel(Panel):
    """Tabs of pictures; hovering over one shows the button that enlarges it.

    ``flush`` sends queued messages at once. ``compare_tab`` is left for the comparison of methods to fill.
    """

    def __init__(self, gui: viser.GuiApi, flush: Callable[[], None]) -> None:
        self._flush = flush
        tabs = gui.add_tab_group()
        black = np.zeros((3, 4, 3), dtype=np.uint8)
        with tabs.add_tab("Annotated", viser.Icon.SCAN_EYE):
            self._annotated = gui.add_image(black, format="jpeg", jpeg_quality=_JPEG_QUALITY)
            gui.add_html(help_link("annotated"))
        with tabs.add_tab("Threshold", viser.Icon.CONTRAST):
            self._binary = gui.add_image(black, format="jpeg", jpeg_quality=_JPEG_QUALITY)
            gui.add_html(_KEY)
            gui.add_html(help_link("threshold"))
        self.compare_tab = tabs.add_tab("Compare", viser.Icon.LAYOUT_GRID)
        with tabs.add_tab("Original", viser.Icon.PHOTO):
            self._original = gui.add_image(black, format="jpeg", jpeg_quality=_JPEG_QUALITY)
            gui.add_html(help_link("original", "What is done with the picture before lights are looked for"))
        self._pictured: np.ndarray | None = None

    def show(self, analysis: Analysis) -> None:
        """Show the pictures; the original is sent only if it changed.

        The annotated one, which people wait for, is sent at once, unless all of a frame is sent as one: in one batch
        with the 3D scene, the browser would hold it back until the scene is drawn.
        """
        self._annotated.image = _rgb(widen(analysis.annotated))
        self._flush()
        self._binary.image = _rgb(widen(analysis.thresholded))
        if self._pictured is not analysis.view.image:
            self._original.image = _rgb(widen(to_bgr8(analysis.view.image)))
            self._pictured = analysis.view.image


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

    def show(self, analysis: Analysis) -> None:
        """Fill the table."""
        self._table.content = table_html(analysis)


class ViewpointPanel(Panel):
    """One button a viewpoint; each moves only the browser it was pressed in."""

    def __init__(self, gui: viser.GuiApi, scene: Scene3D) -> None:
        buttons = gui.add_button_group(
            "3D view from",
            NAMES,
            hint="Drag the scene to turn it, scroll to zoom, drag with the right button to shift.",
        )

        def look(client: viser.ClientHandle) -> None:
            if buttons.value in NAMES:
                scene.look_from(client, buttons.value)

        on_click(buttons, look)


def _rgb(picture: np.ndarray) -> np.ndarray:
    """The BGR picture as RGB, in one piece: a reversed view takes three times as long to encode."""
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
