"""The picture: annotated, as the threshold sees it, and as it came."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
import viser
from dockpose.app.drawing.canvas import to_bgr8
from dockpose.app.drawing.thresholded import threshold_picture
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import help_link
from dockpose.app.web.widgets import Panel

_JPEG_QUALITY = 90
_TALLEST = 3 / 4  # height to width: a taller picture would push the table below it off a small screen
_KEY = (
    '<div style="padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35">Pixels at least as bright as the '
    "threshold. <b style='color: #009E73'>Green in a circle</b>: a light on the ring. "
    "<b style='color: #D55E00'>Orange under a cross</b>: thrown out. Grey, unmarked: smaller than the minimum area."
    "</div>"
)


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

    Parameters
    ----------
    gui : to add to.
    flush : sends what waits to be sent.

    Attributes
    ----------
    compare_tab : a tab between them for the comparison of methods to fill.
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
        """Show the pictures; the original is sent only where it is another one.

        The annotated one goes out at once: it is what people wait for, and together with changes of the 3D scene the
        browser would hold it back until that is drawn.
        """
        self.show_annotated(analysis)
        self._binary.image = _rgb(widen(threshold_picture(analysis.view.image, analysis.estimate)))
        if self._pictured is not analysis.view.image:
            self._original.image = _rgb(widen(to_bgr8(analysis.view.image)))
            self._pictured = analysis.view.image

    def show_annotated(self, analysis: Analysis) -> None:
        """Show the annotated picture alone."""
        self._annotated.image = _rgb(widen(analysis.annotated))
        self._flush()


def _rgb(picture: np.ndarray) -> np.ndarray:
    """The BGR picture as RGB, in one piece: a reversed view takes three times as long to encode."""
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
