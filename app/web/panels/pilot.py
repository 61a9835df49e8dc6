"""The pilot view's numbers, and how old the newest picture is, which the page says too once a live source is silent."""

import math
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import msgspec
from dockpose import Dock, Entrance, Guidance, Vehicle, guide
from dockpose.app.drawing.numbers import MISSING, deviation_words, number, place_parts, sigma_words, way_parts
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import row, small, table
from dockpose.app.web.widgets import App, Panel
from dockpose.pose.circle import CirclePose

STALE_S = 2.0  # without a new picture
_LOOKED_EVERY_S = 0.25
# The corridor's half width at the dock's face, as a share of the ring's radius, and how it opens.
_ENTRANCE_SHARE, _OPENING = 0.5, math.tan(math.radians(10))
_LINK = '<a href="/pilot" target="_blank" rel="noopener">Pilot view</a>: large figures for the far end of the tank.'


class PilotPanel(Panel):
    """Keeps what the pilot view asks for."""

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._told: tuple[Analysis | None, dict[str, Any]] = None, {}  # and what is told of it
        self._seen_s = time.monotonic()
        app.live.place("guidance", partial(guidance_html, app.options.vehicle))
        self.gui.add_html(small(_LINK))

    def watch(self, say_stale: Callable[[int], object]) -> None:
        """From now on call ``say_stale`` with the seconds for which a live source gives no new picture, and 0 again."""
        ended = threading.Event()
        self.app.closing.callback(ended.set)
        threading.Thread(target=self._watch, args=(say_stale, ended), name="dockpose age", daemon=True).start()

    def show(self, analysis: Analysis) -> None:
        """Keep what the pilot is told of a result; of the same picture as before it is as old as before."""
        if self.analysis is None or analysis.view.image is not self.analysis.view.image:
            self._seen_s = time.monotonic() - analysis.estimate.elapsed_ms / 1000
        self.analysis = analysis

    def answer(self) -> bytes:
        """The newest numbers as JSON, which are worked out only where a pilot looks."""
        analysis, told = self._told
        if analysis is not self.analysis and self.analysis is not None:
            self._told = analysis, told = self.analysis, pilot_numbers(self.analysis, self.app.options.vehicle)
        return msgspec.json.encode(told | {"ageS": self._age_s, "isLive": self._is_live})

    @property
    def _age_s(self) -> float:
        return time.monotonic() - self._seen_s

    @property
    def _is_live(self) -> bool:
        player = self.app.sequence.player
        return player is not None and player.frames.is_live

    def _watch(self, say_stale: Callable[[int], object], ended: threading.Event) -> None:
        told = 0
        while not ended.wait(_LOOKED_EVERY_S):
            with self.app.live.held:  # or a picture that comes just now would be greyed out
                age_s = self._age_s if self.analysis is not None and self._is_live else 0.0
                old, told = told, int(age_s) if age_s > STALE_S else 0
                if told != old:
                    say_stale(told)


_WAY = "along (cm)", "across (cm)", "above (cm)", "yaw off (°)", "pitch off (°)"
_AXES = {
    frame: tuple(f"{name} (cm)" for name in names)
    for frame, names in {"frd": ("x ahead", "y right", "z down"), "flu": ("x ahead", "y left", "z up")}.items()
}
_TARGETS = {"entrance": "entrance", "standoff": "stand-off"}


def pilot_numbers(analysis: Analysis, vehicle: Vehicle | None = None) -> dict[str, Any]:
    """What the pilot view shows of a result: words, figures, and the way in; of an entrance, if the dock has one."""
    found, trust = analysis.estimate, analysis.trust
    told: dict[str, Any] = {"trust": trust.colour, "verdict": trust.verdict, "reason": "".join(trust.reasons[:1])}
    told |= {"source": analysis.view.source}
    pose = found.selected
    if pose is None:
        return told | {"reason": found.message}
    guidance = guide(pose, found.dock, found.camera, vehicle)
    if guidance is None:
        way_m, way = pose.position_m.tolist(), corridor(pose, found.dock.diameter / 2)
        *_, pitch, yaw = place_parts(pose)
    else:
        way_m, way = _from_camera(guidance.frame, guidance.target_m), corridor_of(guidance, found.dock)
        pitch, yaw = (f"{words}°" for words in (number(guidance.pitch_off_deg, 0), number(guidance.yaw_off_deg, 0)))
        told["target"] = f"to the {_TARGETS[guidance.target]}"
    figures = dict(zip(("ahead", "across", "along"), way_parts(*way_m), strict=True))
    figures |= {"pitch": pitch.removeprefix("pitch "), "yaw": yaw.removeprefix("yaw ")}
    figures["exact"] = "assumed" if analysis.view.assumed else MISSING
    if pose.errors is not None and not analysis.view.assumed:
        position_m, theta_rad = pose.errors.sigmas[None]
        sigmas_m = position_m if guidance is None else guidance.sigma_total_m or position_m
        known = deviation_words(max(sigmas_m)) or MISSING
        figures["exact"] = f"{known}, ± {sigma_words(math.degrees(max(theta_rad)))}°"
    right, down, ahead = way_m
    direction_deg = [math.degrees(math.atan2(right, ahead)), math.degrees(math.atan2(down, ahead))]
    return told | {"figures": figures, "directionDeg": direction_deg, "corridor": way}


def _from_camera(frame: str, place_m: Iterable[float]) -> tuple[float, float, float]:
    """A place in a frame of :class:`Guidance`, to the right, down and ahead."""
    x, y, z = place_m
    return {"camera": (x, y, z), "frd": (y, z, x), "flu": (-y, -z, x)}[frame]


def corridor(pose: CirclePose, radius_m: float) -> dict[str, float | bool]:
    """Where the camera is before the dock's face and where it heads, by the dock's axes without roll; the way in."""
    right, down, ahead = (-pose.rotation.T @ pose.position_m).tolist()
    x, y, z = pose.rotation[2]  # the camera's axis
    heading = {"headingRightDeg": math.degrees(math.atan2(x, z)), "headingDownDeg": math.degrees(math.atan2(y, z))}
    entrance = _ENTRANCE_SHARE * radius_m
    way = {"entrance": entrance, "opening": _OPENING, "ahead": -ahead, "right": right, "down": down}
    return way | heading | {"isInside": math.hypot(right, down) <= entrance - _OPENING * ahead}


def corridor_of(guidance: Guidance, dock: Dock) -> dict[str, float | bool]:
    """As :func:`corridor`, to the dock's entrance."""
    entrance = dock.entrance or Entrance()
    return {
        "entrance": entrance.radius_m,
        "opening": math.tan(math.radians(entrance.cone_deg)),
        "ahead": guidance.along_m,
        "right": guidance.across_m,
        "down": -guidance.above_m,
        "headingRightDeg": guidance.yaw_off_deg,
        "headingDownDeg": -guidance.pitch_off_deg,
        "isInside": guidance.inside_cone,
    }


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
