"""The Compare tab: every threshold method side by side, and a sweep over the level, each on request."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from html import escape

import numpy as np
import viser
from dockpose import Estimate
from dockpose.app.drawing.montage import around_ring, montage
from dockpose.app.drawing.numbers import MISSING, number, pose_cells, status_words
from dockpose.app.export.words import short_method
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import COMPARED, compare_view, error_words, sweep_levels
from dockpose.app.state.detection import with_method
from dockpose.app.state.view import View
from dockpose.app.web.charts.sweep import SweepChart
from dockpose.app.web.html import help_link, row, small, table
from dockpose.app.web.widgets import BackgroundWork, Change, Panel, on_click
from dockpose.thresholds import LEVELS

COLUMNS = ("level", "groups", "lights", "centre x, y (px)", "z (cm)", "θx (°)", "θy (°)", "time (ms)", "off by")
_IN_A_ROW = 5
_ASK = "Every method is tried on this picture when this tab is opened, and not while sliders move."
_TABLE_NOTE = (
    "Off by: distance and angle from the truth, or else from the measured pose. Click a row, or a picture below, to "
    "use its method."
)
# static/page.js presses the button of that name; with the keyboard Enter does.
_PRESSED = 'role="button" tabindex="0" data-method="{name}" title="Use {name}"'
_OLD = "<b>Outdated:</b> the picture or the settings have changed since these results. Press the button again."


def compare_html(found: Mapping[str, Estimate], view: View) -> str:
    """Return a row a method: what it found, how long it took, and its error where the pose is known."""
    rows = [
        row(
            f"{short_method(name)}{', in use' if name == view.settings.method else ''}",
            method_cells(one, view),
            bold=name == view.settings.method,
            attributes=_PRESSED.format(name=short_method(name)),
        )
        for name, one in found.items()
    ]
    return table("methods", COLUMNS, rows, _TABLE_NOTE)


def method_cells(found: Estimate, view: View) -> list[str]:
    """Return the numbers of one method; without a pose, the reason stands in place of the centre."""
    level = MISSING if found.threshold is None or found.threshold.level >= LEVELS else str(found.threshold.level)
    groups = MISSING if found.markers is None else str(len(found.markers))
    counts = [level, groups, str(found.lights_on_ring or 0)]
    time_ms, pose = number(found.elapsed_ms), found.selected
    if pose is None:
        return [*counts, escape(status_words(found.status)), MISSING, MISSING, MISSING, time_ms, MISSING]
    x_px, y_px = map(number, pose.centre_px)
    return [*counts, f"{x_px},&nbsp;{y_px}", *pose_cells(pose)[2:], time_ms, error_words(found, view) or MISSING]


class ComparePanel(Panel):
    """Buttons that start and stop a comparison or a sweep, their results, and buttons to use a method."""

    def __init__(self, gui: viser.GuiApi, change: Change, on_error: Callable[[Exception], None]) -> None:
        self._analysis: Analysis | None = None
        self._worked_on: dict[str, View] = {}
        self._compare = gui.add_button(
            "Compare all methods",
            icon=viser.Icon.LAYOUT_GRID,
            hint="Try every threshold method on this picture, up to the pose.",
        )
        self._sweep = gui.add_button(
            "Sweep the level",
            icon=viser.Icon.CHART_LINE,
            hint="Try every fixed level from 1 to 255: how far is the dock's centre off by three ways to find it?",
        )
        self._task = BackgroundWork(gui, on_error, "Stop the work.")
        self._note = gui.add_html(small(_ASK))
        self._chart = SweepChart(gui)
        self._table = gui.add_html("")
        self._take_over = [
            gui.add_button_group(
                "Use method" if first == 0 else "or",
                tuple(short_method(name) for name in COMPARED[first : first + _IN_A_ROW]),
                visible=False,
                hint="Use this method for the picture.",
            )
            for first in range(0, len(COMPARED), _IN_A_ROW)
        ]
        self._montage = gui.add_image(np.zeros((3, 4, 3), np.uint8), format="jpeg", jpeg_quality=90, visible=False)
        gui.add_html(help_link("compare"))
        on_click(self._compare, lambda client: self._begin(self._do_compare))
        on_click(self._sweep, lambda client: self._begin(self._do_sweep))
        for group in self._take_over:
            on_click(group, partial(_take_over, group, change))

    def show(self, analysis: Analysis) -> None:
        """Keep what to compare, and say when the results shown are outdated."""
        self._analysis = analysis
        if self._worked_on:
            self._say_age()

    def close(self) -> None:
        """Stop whatever runs."""
        self._task.close()

    def _begin(self, work: Callable[[Analysis, Progress], None]) -> None:
        analysis = self._analysis
        if analysis is not None:
            self._task.start(lambda progress: self._work(work, analysis, progress))

    def _work(self, work: Callable[[Analysis, Progress], None], analysis: Analysis, progress: Progress) -> None:
        work(analysis, progress)
        self._say_age()

    def _say_age(self) -> None:
        """Say whether a result shown here is of an earlier view."""
        present = None if self._analysis is None else self._analysis.view
        is_old = any(view is not present for view in self._worked_on.values())
        self._note.content = small(_OLD if is_old else "", 'id="outdated"' if is_old else "")

    def _do_compare(self, analysis: Analysis, progress: Progress) -> None:
        view = analysis.view
        found = compare_view(view, progress)
        self._montage.image = montage(view.image, found, view.known_pose, around_ring(analysis.estimate))[:, :, ::-1]
        self._table.content = compare_html(found, view)
        for handle in (self._montage, *self._take_over):
            handle.visible = True
        self._worked_on["methods"] = view

    def _do_sweep(self, analysis: Analysis, progress: Progress) -> None:
        self._worked_on["sweep"] = analysis.view
        self._chart.show(sweep_levels(analysis.view, analysis.estimate, progress, show=self._chart.grow))


def _take_over(group: viser.GuiButtonGroupHandle, change: Change, client: viser.ClientHandle) -> None:
    method = {short_method(name): name for name in COMPARED}.get(group.value)
    change(lambda view: with_method(view, method), client, reload=True)
