"""Where dock and entrance are for the vehicle, and how old the newest picture is once a live source is silent."""

import threading
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial

from dockpose import Vehicle, guide
from dockpose.app.drawing.numbers import number, sigma_words, way_parts
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import row, table
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel

STALE_S = 2.0  # without a new picture
_LOOKED_EVERY_S = 0.25


class GuidancePanel(Panel):
    """Leads to the entrance, and knows how old the picture is."""

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._seen_s = time.monotonic()
        app.live.place("guidance", partial(guidance_html, app.options.vehicle))

    def watch(self, say_stale: Callable[[int], object]) -> None:
        """From now on call ``say_stale`` with the seconds for which a live source gives no new picture, and 0 again."""
        ended = threading.Event()
        self.app.closing.callback(ended.set)
        threading.Thread(target=self._watch, args=(say_stale, ended), name="dockpose age", daemon=True).start()

    def show(self, analysis: Analysis) -> None:
        """Note when a result came; of the same picture as before it is as old as before."""
        if self.analysis is None or analysis.view.image is not self.analysis.view.image:
            self._seen_s = time.monotonic() - analysis.estimate.elapsed_ms / 1000
        self.analysis = analysis

    @property
    def _age_s(self) -> float:
        return time.monotonic() - self._seen_s

    def _watch(self, say_stale: Callable[[int], object], ended: threading.Event) -> None:
        told = 0
        while not ended.wait(_LOOKED_EVERY_S):
            with self.app.live.held:  # or a picture that comes just now would be greyed out
                player = None if self.analysis is None else self.app.player
                age_s = self._age_s if player is not None and player.frames.is_live else 0.0
                old, told = told, int(age_s) if age_s > STALE_S else 0
                if told != old:
                    say_stale(told)


_WAY = "along (cm)", "across (cm)", "above (cm)", "yaw off (°)", "pitch off (°)"
_AXES = {"frd": ("x ahead (cm)", "y right (cm)", "z down (cm)"), "flu": ("x ahead (cm)", "y left (cm)", "z up (cm)")}
_TARGETS = {"entrance": "entrance", "standoff": "stand-off"}


def _from_camera(frame: str, place_m: Iterable[float]) -> tuple[float, float, float]:
    """A place in a frame of :class:`Guidance`, to the right, down and ahead."""
    x, y, z = place_m
    return {"camera": (x, y, z), "frd": (y, z, x), "flu": (-y, -z, x)}[frame]


def guidance_html(vehicle: Vehicle | None, analysis: Analysis) -> str:
    """The dock's pose in the vehicle's frame, and the way to its entrance; empty where neither is known."""
    found, html = analysis.estimate, ""
    if (vehicle is None and found.dock.entrance is None) or found.selected is None:
        return html
    if vehicle is not None:
        body = vehicle.pose(found.selected)
        told, normal = body.to_dict(), [number(part, 2) for part in -body.rotation[:, 2]]
        rows = [row("Dock", _centimetres(body.position_m)), row("Its normal", normal)]
        html = _with_sigmas("vehicle", _AXES[body.frame], rows, told["sigma_total_position_m"], analysis)
    guidance = guide(found.selected, found.dock, found.camera, vehicle)
    if guidance is None:
        return html
    off = [number(guidance.yaw_off_deg), number(guidance.pitch_off_deg)]
    place = [*_centimetres((guidance.along_m, guidance.across_m, guidance.above_m)), *off]
    rows = [row("Camera" if vehicle is None else "Vehicle", place)]
    cone = (
        f"{'Inside' if guidance.inside_cone else 'Outside'} the cone, {number(guidance.off_axis_deg, 0)}° off its axis"
    )
    where = ", ".join(way_parts(*_from_camera(guidance.frame, guidance.target_m)))
    words = f"{cone}: go to the {_TARGETS[guidance.target]}, {where}."
    return html + _with_sigmas("way", _WAY, rows, guidance.sigma_total_m, analysis, words)


def _centimetres(place_m: Iterable[float]) -> list[str]:
    return [number(100 * part) for part in place_m]


def _with_sigmas(
    name: str,
    columns: Sequence[str],
    rows: list[str],
    sigmas_m: Sequence[float] | None,
    analysis: Analysis,
    words: str = "",
) -> str:
    """A table, with the standard errors of its lengths where camera and dock are known."""
    if sigmas_m is not None and not analysis.view.assumed:
        rows.insert(1, row("±, one sigma", [sigma_words(100 * sigma) for sigma in sigmas_m]))
    return table(name, columns, rows, words)
