"""The pilot view's numbers, and how old the newest picture is, which the page says too once a live source is silent."""

import math
import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec
from dockpose.app.drawing.numbers import MISSING, deviation_words, place_parts, sigma_words
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import small
from dockpose.app.web.widgets import App, Panel
from dockpose.pose.circle import CirclePose, rotation_from_angles

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
            self._told = analysis, told = self.analysis, pilot_numbers(self.analysis)
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


def pilot_numbers(analysis: Analysis) -> dict[str, Any]:
    """What the pilot view shows of a result: words, figures, where the dock is seen, and the way to it."""
    pose, trust = analysis.estimate.selected, analysis.trust
    told = {"trust": trust.colour, "verdict": trust.verdict, "reason": "".join(trust.reasons[:1])}
    told |= {"source": analysis.view.source}
    if pose is None:
        return told | {"reason": analysis.estimate.message}
    ahead, across, along, pitch, yaw = place_parts(pose)
    figures = {
        "ahead": ahead,
        "across": across,
        "along": along,
        "exact": "assumed" if analysis.view.assumed else MISSING,
    }
    figures |= {"pitch": pitch.removeprefix("pitch "), "yaw": yaw.removeprefix("yaw ")}
    if pose.errors is not None and not analysis.view.assumed:
        position_m, theta_rad = pose.errors.sigmas()
        known = deviation_words(max(position_m)) or MISSING
        figures["exact"] = f"{known}, ± {sigma_words(math.degrees(max(theta_rad)))}°"
    x, y, z = pose.position_m.tolist()
    direction_deg = [math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, z))]
    way = corridor(pose, analysis.estimate.dock.diameter / 2)
    return told | {"figures": figures, "directionDeg": direction_deg, "corridor": way}


def corridor(pose: CirclePose, radius_m: float) -> dict[str, float | bool]:
    """Where the camera is before the dock's face and where it heads, by the dock's axes without roll; the way in."""
    rotation = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)
    right, down, ahead = (-rotation.T @ pose.position_m).tolist()
    x, y, z = rotation[2]  # the camera's axis
    heading = {"headingRightDeg": math.degrees(math.atan2(x, z)), "headingDownDeg": math.degrees(math.atan2(y, z))}
    entrance = _ENTRANCE_SHARE * radius_m
    way = {"entrance": entrance, "opening": _OPENING, "ahead": -ahead, "right": right, "down": down}
    return way | heading | {"isInside": math.hypot(right, down) <= entrance - _OPENING * ahead}
