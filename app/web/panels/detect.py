"""Settings of the detection: the threshold method, its level, the smallest group, and masks."""

from html import escape
from typing import Any

from dockpose import Estimate
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.changes import mask_labels, with_centroid, with_mask, with_method, without_mask, without_masks
from dockpose.app.state.parameters import DETECTION
from dockpose.app.state.view import View
from dockpose.app.web.html import SMALL
from dockpose.app.web.widgets import App, Panel, Slider
from dockpose.thresholds import LEVELS, METHODS

NO_MASK = "(no mask)"
_CENTROIDS = {"Weighed by brightness": "grey", "Middle of the pixels kept": "binary"}


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


def detect_html(found: Estimate) -> str:
    """What the threshold keeps, and what was left out of it."""
    return f'<div style="{SMALL}">{escape(threshold_sentence(found))}<br>{escape(thrown_out_sentence(found))}</div>'


class DetectPanel(Panel):
    """Method, level, smallest group, kind of centre, and masks."""

    table = "detect"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._labels = {METHODS.title(method): method for method in METHODS}
        self._method = self.add(
            "dropdown", "method", self.changing(self._with_method, reload=False), options=tuple(self._labels)
        )
        self._level = Slider(app, DETECTION["level"], self._with_fixed_level)
        self._min_area = Slider(app, DETECTION["min_area_px"])
        self._centroid = self.add(
            "dropdown",
            "centroid",
            self.changing(lambda view: with_centroid(view, _CENTROIDS.get(self._centroid.value)), reload=False),
            options=tuple(_CENTROIDS),
        )
        app.live.place("detect", lambda analysis: detect_html(analysis.estimate))
        with self.gui.add_folder("Masks: parts not looked at", expand_by_default=False):
            corner, size = self.add("vector2", "corner"), self.add("vector2", "size")
            self.add("button", "add", self.changing(lambda view: with_mask(view, *corner.value, *size.value)))
            self._mask = self.add("dropdown", "mask", options=[NO_MASK])
            self.add("button", "remove", self.changing(lambda view: without_mask(view, self._mask.value)))
            self.add("button", "clear", self.changing(without_masks))

    def load(self, view: View) -> None:
        """Set the controls."""
        self._method.value = METHODS.title(view.settings.method)
        self._level.load(view, with_value=view.settings.method == "fixed")
        self._min_area.load(view)
        # Most groups are small: a longer slider would be too coarse for them.
        self._min_area.handle.max = min(DETECTION["min_area_px"].range(view).high, max(100, view.settings.min_area_px))
        masks = tuple(mask_labels(view.settings.masks)) or (NO_MASK,)
        if masks != self._mask.options:
            self._mask.options, self._mask.value = masks, masks[-1]
        self._centroid.value = next(label for label, kind in _CENTROIDS.items() if kind == view.settings.centroid)

    def show(self, analysis: Analysis) -> None:
        """Let the level's slider follow a level that was found."""
        threshold = analysis.estimate.threshold
        # A result of before the slider was moved must not move it back.
        if threshold and "fixed" not in (analysis.view.settings.method, self._labels.get(self._method.value)):
            self._level.handle.value = min(threshold.level, LEVELS - 1)

    def _with_method(self, view: View) -> View:
        """Under "fixed" the level starts where the method before it left it."""
        method = self._labels.get(self._method.value, self._method.value)
        return with_method(view, method, self._level.handle.value)

    def _with_fixed_level(self, view: View, value: Any) -> View:
        changed = with_method(view, "fixed", value)
        self._method.value = METHODS.title("fixed")
        return changed
