"""Lights that are set by hand in the picture, which static/lights.js tells, and the spot under the pointer."""

from collections import deque
from functools import partial
from typing import Any

import numpy as np
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.changes import with_set_lights
from dockpose.app.state.view import View
from dockpose.app.web.choices import Client
from dockpose.app.web.live import Acts, data_html, request_to
from dockpose.app.web.page import Page
from dockpose.estimate import geometry
from dockpose.estimate.by_hand import spot_at
from dockpose.estimate.flow import picture_in
from dockpose.estimate.stages import Picture
from dockpose.lights.by_hand import ByHand

_OTHER_PX = 4.0  # from a point on, a light there is another one


class SetLights:
    """Takes what browsers set; ``acts`` are done for their requests."""

    def __init__(self, app: Page) -> None:
        self._app = app
        self._seen: Picture | None = None
        self._analysis: Analysis | None = None
        self._serial = 0  # of the picture that is shown
        self._heard, self._newest = deque[int](maxlen=16), None  # numbers of requests, and the lights of the newest
        self._goes_on = False  # whether that moved a light on by an arrow key
        lights: dict[str, Any] = {"picture": int, "at": list[tuple[float, float]] | None, "snap": list[bool]}
        self.acts: Acts = {
            request_to("lights", **lights, goesOn=bool): self._take,
            request_to("spot", picture=int, at=tuple[float, float]): self._tell_spot,
            request_to("hold"): lambda asked, client: self._hold(),
        }

    def begin(self) -> None:
        """Add to the page what carries the spot."""
        self._spot = self._app.server.gui.add_html("")

    def show(self, analysis: Analysis, serial: int) -> None:
        """Keep what is shown, and say which of the requests it has heeded."""
        if serial != self._serial:
            self._app.live.put(lightsRefused="")
        self._analysis, self._serial = analysis, serial
        if analysis.view.set_lights is self._newest:
            self._app.live.put(lightsHeard=[*self._heard])

    def _hold(self) -> None:
        """Pause a sequence, so that lights are set in the frame that is seen."""
        if self._app.player is not None and self._app.is_playing:
            self._app.player.play(False)
            self._app.on_rest()

    def _take(self, asked: Any, client: Client) -> None:
        """Take all lights as a browser has set them, or by None the search's; each step is undone by itself."""
        app, before = self._app, self._app.view.set_lights
        if asked.picture == self._serial:
            if not (asked.goesOn and self._goes_on):
                app.history.end_move()
            self._goes_on = asked.goesOn
            app.live.put(lightsRefused="")
            app.change(partial(self._with, asked), client, reload=True)
        if app.view.set_lights is before:  # refused, or as it was: the browser shows again what holds
            app.live.put(lightsHeard=[*self._heard, asked.number])
            app.live.send()

    def _with(self, asked: Any, view: View) -> View:
        try:
            after = with_set_lights(view, asked.at, asked.snap)
        except ValueError as error:  # said at the picture, once, however many are clicked
            self._app.live.put(lightsRefused=str(error))
            return view
        self._newest: ByHand | None = after.set_lights
        self._heard.append(asked.number)
        return after

    def _tell_spot(self, asked: Any, client: Client) -> None:
        """Send where a light would be that is set at a point."""
        analysis, (x, y) = self._analysis, asked.at
        if analysis is None or asked.picture != self._serial:
            return
        view, found = analysis.view, analysis.estimate
        if not (-0.5 <= x < found.width - 0.5 and -0.5 <= y < found.height - 0.5):
            return
        if self._seen is None or self._seen.image is not view.image:
            self._seen = picture_in(view.image, view.camera, view.settings)
        lights = np.empty((0, 2)) if found.markers is None else found.markers.points_px[geometry.on_ring(found)]
        spot = spot_at(self._seen, view.camera, asked.at, lights[np.hypot(*(lights - asked.at).T) > _OTHER_PX])
        told = {"at": spot.points_px[0].tolist(), "radius": float(np.sqrt(spot.areas_px[0] / np.pi))}
        self._spot.content = data_html("spot", told)
