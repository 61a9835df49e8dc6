"""The camera's intrinsics and the dock's size: what turns pixels into metres."""

from __future__ import annotations

from typing import Any

import viser

from app.panels import Change, add_slider, on_change, set_slider
from app.reading import Reading
from app.state import (
    INTRINSICS,
    MAX_LIGHTS,
    View,
    diameter_limits_cm,
    intrinsic_limits,
    with_diameter_cm,
    with_given_values,
    with_intrinsic,
    with_lights,
)

_HINTS = {
    "fx": "Focal length in pixels, horizontally. Larger: a narrower view, so the dock is taken to be further away.",
    "fy": "Focal length in pixels, vertically. Nearly the same as fx in most cameras.",
    "cx": "Where the optical axis meets the picture, in pixels from the left. Usually near the middle.",
    "cy": "Where the optical axis meets the picture, in pixels from the top. Usually near the middle.",
}


class CameraPanel:
    """Sliders with typed values for fx, fy, cx, cy and the dock's diameter, and the number of lights."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        with gui.add_folder("Camera and dock"):
            self._intrinsics = {name: add_slider(gui, f"{name} (px)", _HINTS[name]) for name in INTRINSICS}
            self._diameter = add_slider(
                gui,
                "Diameter (cm)",
                "Of the dock: the circle through the middles of the lights, measured on the dock.",
            )
            self._lights = gui.add_number(
                "Number of lights",
                0,
                min=0,
                max=MAX_LIGHTS,
                step=1,
                hint="How many lights the dock has, evenly spaced. 0: not known; the lights seen are taken to be all.",
            )
            given = gui.add_button(
                "Back to the given values",
                icon=viser.Icon.ARROW_BACK_UP,
                hint="Camera and dock as they came with this picture.",
            )
        for name, slider in self._intrinsics.items():
            on_change(slider, change, _set_intrinsic(name, slider))
        on_change(self._diameter, change, lambda view: with_diameter_cm(view, self._diameter.value))
        on_change(self._lights, change, lambda view: with_lights(view, self._lights.value))

        @given.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                change(with_given_values, event.client, reload=True)

    def load(self, view: View) -> None:
        """Set the sliders' ranges and values."""
        for name, limits in intrinsic_limits(view).items():
            set_slider(self._intrinsics[name], limits, getattr(view.camera, name))
        set_slider(self._diameter, diameter_limits_cm(view), 100 * view.dock.diameter)
        self._lights.value = view.dock.lights or 0

    def show(self, reading: Reading) -> None:
        """Nothing here depends on the result."""


def _set_intrinsic(name: str, slider: viser.GuiSliderHandle[float]) -> Any:
    return lambda view: with_intrinsic(view, name, slider.value)
