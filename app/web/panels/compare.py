"""The Compare tab: every threshold method side by side."""

import base64
from collections.abc import Mapping
from functools import partial
from html import escape
from typing import Any

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.annotated import around_ring, kept_pixels
from dockpose.app.drawing.numbers import MISSING, number, percent, pose_cells, status_words
from dockpose.app.errors import UserError
from dockpose.app.export.bundle import to_zip
from dockpose.app.export.judged import judged_files
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, error_words, histogram_in, same_comparison
from dockpose.app.processing.judged import HEAD, Known, judged_by, judged_views, known_by_hand, summary
from dockpose.app.processing.losses import losses, ranks
from dockpose.app.state.changes import with_method
from dockpose.app.state.view import View, with_upload
from dockpose.app.web.choices import Client
from dockpose.app.web.html import help_link, row, table
from dockpose.app.web.live import data_html
from dockpose.app.web.page import Page
from dockpose.app.web.panels.view import LOOK, runs
from dockpose.app.web.widgets import Panel
from dockpose.app.web.work import BackgroundWork
from dockpose.camera.image import to_grey, to_levels
from dockpose.estimate import geometry
from dockpose.pose.known import pose_error
from dockpose.thresholds import LEVELS, METHODS

_AROUND = 1.25  # of the ring's size: what a crop shows
_WIDEST_PX = 800  # of a crop as it is sent
_OUTLINE_STEP = 4  # of the points on the ellipse


def comparison_numbers(found: Mapping[str, Estimate], view: View, known: Known | None = None) -> dict[str, Any]:
    """Return a crop around the ring, the histogram, and for each method, the best first, what it found there."""
    part = next(filter(None, (around_ring(one, _AROUND) for one in found.values())), None)
    left, top, right, bottom = part or (0, 0, view.image.shape[1], view.image.shape[0])
    scale = min(1.0, _WIDEST_PX / (right - left))
    size = max(1, round((right - left) * scale)), max(1, round((bottom - top) * scale))

    def cropped(pixels: np.ndarray, way: int) -> np.ndarray:
        return cv2.resize(pixels[top:bottom, left:right], size, interpolation=way)

    def placed(points: Any) -> list[list[float]]:
        array = np.asarray(points, dtype=float).reshape(-1, 2)
        inside = array[np.isfinite(array).all(axis=1)]
        return np.round((inside - [left - 0.5, top - 0.5]) * scale, 1).tolist()

    grey = cropped(to_levels(to_grey(view.image))[0], cv2.INTER_AREA)
    ranked, methods = ranks(found, view), []
    lost = losses(found, found[next(iter(ranked))], view.scene, None if known is None else known.lights_px)
    for name, rank in ranked.items():
        one = found[name]
        kept = cropped(255 * kept_pixels(view.image, one).astype(np.uint8), cv2.INTER_AREA)  # none is lost
        outline = geometry.outline(one)
        drawn = {
            "kept": runs(np.flatnonzero(kept)),
            "groups": [] if one.markers is None else placed(one.markers.points_px),
            "radii": np.round(geometry.light_radii(one) * scale, 1).tolist(),
            "onRing": geometry.on_ring(one).tolist(),
            "ellipse": [] if outline is None else placed(outline[::_OUTLINE_STEP]),
            "dock": [] if one.selected is None else placed(geometry.pose_lines(one.selected, one)[0]),
            "level": None if one.threshold is None or one.threshold.level >= LEVELS else one.threshold.level,
            "lost": lost[name].in_words() if name in lost else "",
        }
        methods.append({"name": name, "label": METHODS[name].label, "rank": rank} | method_words(one, view) | drawn)
    picture = base64.b64encode(cv2.imencode(".png", grey)[1].tobytes()).decode()
    counts = np.log1p(histogram_in(view, next(iter(found.values()))).counts)
    return {
        "source": view.source,
        "width": size[0],
        "height": size[1],
        "picture": picture,
        "histogram": np.round(100 * counts / counts.max(initial=1.0)).astype(int).tolist(),
        "methods": methods,
    }


def method_words(found: Estimate, view: View) -> dict[str, Any]:
    """Return what one method found in words: a verdict, whole and brief, its kind, and lines of numbers."""
    level = MISSING if found.threshold is None or found.threshold.level >= LEVELS else str(found.threshold.level)
    groups = 0 if found.markers is None else len(found.markers)
    lines = [
        ("Level", level),
        ("Groups, lights", f"{groups}, {found.lights_on_ring or 0}"),
        ("Time", f"{number(found.elapsed_ms)} ms" if found.elapsed_ms < 1000 else f"{found.elapsed_ms / 1000:.1f} s"),
    ]
    pose = found.selected
    if pose is None:
        why = found.message if found.status == "method_failed" else f"No dock: {status_words(found.status)}"
        return {"verdict": why, "brief": "no dock", "kind": "wrong", "lines": lines}
    _, _, z, theta_x, theta_y = pose_cells(pose)
    lines[2:2] = [
        ("z", f"{z} cm"),
        ("θx, θy", f"{theta_x}°, {theta_y}°"),
        ("Likely", f"{percent(pose.probability, 0)} %" if pose.probability is not None else MISSING),
        ("Lights off", f"{number(pose.rms_px, 2)} px"),
    ]
    error, brief = pose_error(pose, view.known_pose), {"brief": f"{z}\N{NO-BREAK SPACE}cm", "lines": lines}
    if error is None:
        return brief | {"verdict": "Dock found", "kind": "found"}
    word = "Right" if error.agrees else "Wrong"
    return brief | {"verdict": f"{word}: off by {error_words(found, view)}", "kind": word.lower()}


class ComparePanel(Panel):
    """The cards of the methods, which static/compare.js draws."""

    table = "compare"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._compared: View | None = None
        self._state: dict[str, Any] = {}
        # Of its own: a file that is saved does not hold it up.
        gui, self._work = self.gui, BackgroundWork(None, app.report, app.notify)
        app.closing.callback(self._work.close)
        gui.add_html(f'<dockpose-compare style="{LOOK}"></dockpose-compare>')
        self._cards, self._states = gui.add_html(""), gui.add_html("")
        self.add("button", "judge", self._judge)
        self._table = gui.add_html("")
        gui.add_html(help_link("compare"))
        gui.add_html(help_link("study", "Which method when, by a study of 2,000 scenes; the paper, reproduced"))

    def show(self, analysis: Analysis) -> None:
        """Say which method is in use, and whether the results are of something else by now."""
        self.analysis = analysis
        self._tell()

    def _judge(self, client: Client) -> None:
        """Judge the methods on all pictures whose lights are set, and send the files of that."""
        kept, remembered = self.app.kept, self.app.memory.with_lights

        def work(progress: Progress) -> None:
            view = self.app.view
            others = [with_upload(view, kept.get(name), name) for name in kept.names()]
            rows = judged_views([view, *(remembered(one) for one in others if one.item != view.item)], progress)
            if not rows:
                raise UserError("No lights are set: press Set lights over a picture, click them, and do so in others.")
            lines = [row(escape(name), cells) for name, *cells in summary(rows)]
            self._table.content = table("methods", HEAD[1:], lines)
            client.send_file_download("methods.zip", to_zip(judged_files(rows)), save_immediately=True)

        self.app.work.start(work, client)

    def compare(self, asked: Any, client: Client) -> None:
        """Compare the methods on what is shown, unless the results there are of it."""
        if self.analysis is not None and not self._is_fresh:
            self._work.start(partial(self._do_compare, self.analysis))

    def use(self, asked: Any, client: Client) -> None:
        """Take a method for the picture."""
        self.change(lambda view: with_method(view, asked.method), client, reload=True)

    @property
    def _is_fresh(self) -> bool:
        present = None if self.analysis is None else self.analysis.view
        return self._compared is not None and present is not None and same_comparison(self._compared, present)

    def _tell(self) -> None:
        with self.app.live.held:  # which whoever shows a result has: the newest state is what is sent last
            in_use = None if self.analysis is None else self.analysis.view.settings.method
            threshold = None if self.analysis is None else self.analysis.estimate.threshold
            steps_in = threshold.method if threshold is not None and threshold.method != in_use else None
            state = {"inUse": in_use, "stepsIn": steps_in, "isOld": self._compared is not None and not self._is_fresh}
            if state != self._state:
                self._state, self._states.content = state, data_html("compare-state", state)

    def _do_compare(self, analysis: Analysis, progress: Progress) -> None:
        known, view = known_by_hand(analysis.estimate), judged_by(analysis)
        numbers = comparison_numbers(compare_view(analysis.view, progress), view, known)
        self._cards.content, self._compared = data_html("compare", numbers), analysis.view
        self._tell()
