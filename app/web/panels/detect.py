"""The tab Detect: method, level, smallest group; and both candidates in full, and why this one."""

import math
from html import escape
from typing import Any

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import numbers
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import MISSING, QUANTITIES
from dockpose.app.export.words import why_this_one
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state import changes as choices
from dockpose.app.state.parameters import DETECTION
from dockpose.app.state.view import MeasuredPose, View
from dockpose.app.web.html import help_link, pose_name, row, small, tab_link, table, wide_row
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel, Slider
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose, pose_error
from dockpose.thresholds import LEVELS, METHODS


def threshold_sentence(found: Estimate) -> str:
    """The level in use, how many groups it keeps, and why this level."""
    threshold, markers = found.threshold, found.markers
    if threshold is None:
        return found.message if found.status == "method_failed" else "No threshold was reached."
    kept = "" if markers is None else f", which keeps {len(markers)} group{'s' if len(markers) != 1 else ''} of pixels"
    level = "above 255" if threshold.level >= LEVELS else str(threshold.level)
    return f"Threshold (orange line): level {level}{kept}. {threshold.reason}"


def thrown_out_sentence(found: Estimate) -> str:
    """What was masked or thrown out, and why."""
    parts = []
    masks = len(found.settings.masks)
    if masks:
        parts.append(f"{masks} mask{'s hide' if masks > 1 else ' hides'} a part of the picture.")
    thrown_out = 0 if found.markers is None else len(found.markers) - (found.lights_on_ring or 0)
    small = 0 if found.markers is None else found.markers.dropped
    if small:
        parts.append(f"{small} group{'s' if small > 1 else ''} below {found.settings.min_area_px} px ignored.")
    if found.ring is not None:
        parts.append(found.ring.reason)
    elif thrown_out:
        parts.append(f"{thrown_out} group{'s' if thrown_out > 1 else ''} kept, but no ring could be looked for.")
    return " ".join(parts) or "Nothing was masked or thrown out."


class DetectPanel(Panel):
    """Method, level, smallest group, and kind of centre."""

    table = "detect"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._labels = {entry.title: method for method, entry in METHODS.items()}
        self._method = self.add(
            "dropdown", "method", self.changing(self._with_method, reload=False), options=tuple(self._labels)
        )
        self._level = Slider(app, DETECTION["level"], self._with_fixed_level)
        self._min_area = Slider(app, DETECTION["min_area_px"])
        self.add_value("dropdown", "centroid")
        told = threshold_sentence, thrown_out_sentence
        app.live.place("detect", lambda now: small("<br>".join(escape(say(now.estimate)) for say in told)))

    def load(self, view: View) -> None:
        """Set the controls."""
        super().load(view)
        self._method.value = METHODS[view.settings.method].title
        self._level.load(view, with_value=view.settings.method == "fixed")
        self._min_area.load(view)
        # Most groups are small: a longer slider would be too coarse for them.
        self._min_area.handle.max = min(DETECTION["min_area_px"].range(view).high, max(100, view.settings.min_area_px))

    def show(self, analysis: Analysis) -> None:
        """Let the level's slider follow a level that was found."""
        threshold = analysis.estimate.threshold
        # A result of before the slider was moved must not move it back.
        if threshold and "fixed" not in (analysis.view.settings.method, self._labels.get(self._method.value)):
            self._level.handle.value = min(threshold.level, LEVELS - 1)

    def _with_method(self, view: View) -> View:
        """Under "fixed" the level starts where the method before it left it."""
        method = self._labels.get(self._method.value, self._method.value)
        return choices.with_method(view, method, self._level.handle.value)

    def _with_fixed_level(self, view: View, value: Any) -> View:
        changed = choices.with_method(view, "fixed", value)
        self._method.value = METHODS["fixed"].title
        return changed


def details_html(found: Estimate) -> str:
    """Both candidates, a column each, with one-sigma; then the ellipse, and why this one was chosen."""
    if not found.candidates:
        return small(escape(found.message))
    columns = [pose_name(index, pose is found.selected) for index, pose in enumerate(found.candidates)]
    described = [_described(pose) for pose in found.candidates]
    rows = list(map(row, described[0], zip(*map(dict.values, described), strict=True)))
    note = "±: one-sigma; twice that to either side holds the truth 19 times in 20."
    words = small(f"{escape(_ellipse_words(found))}<br><b>{escape(why_this_one(found))}</b>")
    return table("pose-details", columns, rows, note) + words


def errors_html(analysis: Analysis, name: str) -> str:
    """How far both candidates are from the "truth" or the "measured" pose; empty where there is none."""
    found, known = analysis.estimate, getattr(analysis.view, name)
    if known is None:
        return ""
    rows = []
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        rows.append(row(pose_name(index, is_chosen), error_cells(pose, known), bold=is_chosen))
    words = ""
    error = pose_error(found.selected, known.pose if isinstance(known, MeasuredPose) else known)
    if error is not None:
        words = f"The chosen pose is {escape(str(error))}."
    if not rows:
        rows.append(
            wide_row(f"No pose to compare: try another level above, or {tab_link('Compare', 'all methods')}.", 6)
        )
    return table(f"errors-{name}", QUANTITIES, rows, f"Estimated minus {name}. {words}")


def error_cells(pose: CirclePose, known: KnownPose | MeasuredPose) -> list[str]:
    """Estimated minus known, with a sign: x, y, z in centimetres, the angles in degrees; a dash where not known."""
    known_values = known.values if isinstance(known, MeasuredPose) else numbers.pose_values(known)
    errors = np.array(numbers.pose_values(pose)) - np.array(known_values, dtype=float)
    errors[3:] = (errors[3:] + 180) % 360 - 180
    return [MISSING if math.isnan(error) else f"{round(error, 1) + 0.0:+.1f}" for error in errors.tolist()]


def _described(pose: CirclePose) -> dict[str, str]:
    sigmas = map(numbers.sigma_words, numbers.pose_sigmas(pose))
    cells = {
        name: value if sigma == MISSING else f"{value} ± {sigma}"
        for name, value, sigma in zip(QUANTITIES, numbers.pose_cells(pose, 2), sigmas, strict=True)
    }
    return cells | {
        "roll (°)": numbers.number(None if pose.roll_rad is None else math.degrees(pose.roll_rad)),
        "dock centre (px)": f"{pose.centre_px[0]:.1f}, {pose.centre_px[1]:.1f}",
        "likely (%)": numbers.percent(pose.probability),
        "reprojection error (px)": numbers.number(pose.rms_px, 3),
    }


def _ellipse_words(found: Estimate) -> str:
    ellipse = found.ellipse
    if ellipse is None:
        return ""
    (x, y), (major, minor) = ellipse.centre_px, ellipse.semi_axes_px
    return (
        f"Ellipse: centre {x:.1f}, {y:.1f} px; semi-axes {major:.1f} and {minor:.1f} px; eccentricity "
        f"{ellipse.eccentricity:.3f} (0 is a circle); lights off it by {ellipse.rms_px:.2f} px."
    )


class PosePanel(Panel):
    """Tables, and three buttons to overrule the choice."""

    table = "pose"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        with self.gui.add_folder("Which of the two poses", expand_by_default=False):
            app.live.place("pose", lambda analysis: details_html(analysis.shown))
            with_pose = self.changing(self._with_pose, reload=False)
            self._use = self.add("button_group", "use", with_pose, options=("The program's", *POSE_NAMES))
            app.live.place("errors", lambda now: errors_html(now, "truth") + errors_html(now, "measured"))
            self.gui.add_html(help_link("pose"))

    def _with_pose(self, view: View) -> View:
        candidates = () if self.analysis is None else self.analysis.estimate.candidates
        named = dict(zip(POSE_NAMES, candidates, strict=False))
        return choices.with_pose_by_hand(view, named.get(self._use.value))
