"""The camera and the dock's size: what turns pixels into metres."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.camera import (
    COEFFICIENTS,
    OTHER_INDEX,
    PORT_LIMITS,
    WATERS,
    WINDOWS,
    camera_file,
    coefficient_limits,
    coefficients_of,
    field_of_view_sentence,
    index_name,
    with_camera_file,
    with_coefficient,
    with_default_values,
    with_focal,
    with_port,
    with_port_value,
)
from dockpose.app.state.dock import angles_text, dropped_sentence, with_angles
from dockpose.app.state.view import (
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
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Change, add_file_button, add_slider, on_change, on_click, set_slider
from dockpose.camera.files import FORMATS

_HINTS = {
    "fx": "Focal length in pixels, horizontally. Larger: a narrower view, so the dock is taken to be further away.",
    "fy": "Focal length in pixels, vertically. Nearly the same as fx in most cameras.",
    "cx": "Where the optical axis meets the picture, in pixels from the left. Usually near the middle.",
    "cy": "Where the optical axis meets the picture, in pixels from the top. Usually near the middle.",
}
_COEFFICIENT_HINTS = {
    "k1": "Barrel (below 0) or pincushion (above 0) distortion; no unit.",
    "k2": "Distortion that grows with the fourth power of the distance from the middle; no unit.",
    "p1": "Lens tilted against the sensor, up and down; no unit.",
    "p2": "Lens tilted against the sensor, sideways; no unit.",
    "k3": "Distortion that grows with the sixth power of the distance from the middle; no unit.",
}
_SMALL = "padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35"


class CameraPanel:
    """Sliders with typed values for lens, port and dock; camera files are loaded and saved."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        self._change = change
        self._area = gui.add_folder("Camera and dock")
        with self._area:
            self._add_dock(gui)
            self._add_intrinsics(gui)
            with gui.add_folder("Lens distortion", expand_by_default=False):
                self._coefficients = [add_slider(gui, name, _COEFFICIENT_HINTS[name]) for name in COEFFICIENTS]
            with gui.add_folder("Port and water", expand_by_default=False):
                self._add_port(gui)
            self._field = gui.add_html("")
            self._add_buttons(gui)
        for index, slider in enumerate(self._coefficients):
            on_change(slider, change, _set(with_coefficient, index, slider))

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to load a camera file."""

        def take(data: bytes, name: str) -> None:
            self._change(lambda view: with_camera_file(view, data, name), client, reload=True)

        hint = "ROS camera_info, OpenCV FileStorage, or our own, as YAML."
        add_file_button(self._area, client, uploads, take, "Load a camera file", hint)

    def load(self, view: View) -> None:
        """Set the sliders' ranges and values."""
        for name, limits in intrinsic_limits(view).items():
            set_slider(self._intrinsics[name], limits, getattr(view.camera, name))
        if view.camera.fx != view.camera.fy:
            self._lock.value = False
        numbers = zip(self._coefficients, coefficient_limits(view), coefficients_of(view.camera), strict=True)
        for slider, limits, number in numbers:
            set_slider(slider, limits, number)
        self._load_port(view)
        set_slider(self._diameter, diameter_limits_cm(view), 100 * view.dock.diameter)
        self._lights.value = view.dock.lights or 0
        self._angles.value = angles_text(view.dock)

    def show(self, analysis: Analysis) -> None:
        """Say how much the camera sees."""
        self._field.content = f'<div style="{_SMALL}">{escape(field_of_view_sentence(analysis.view.camera))}</div>'

    def _add_dock(self, gui: viser.GuiApi) -> None:
        self._diameter = add_slider(
            gui, "Diameter (cm)", "Of the dock: the circle through the middles of the lights, measured on the dock."
        )
        self._lights = gui.add_number(
            "Number of lights",
            0,
            min=0,
            max=MAX_LIGHTS,
            step=1,
            hint="How many lights the dock has. 0: not known; the lights seen are taken to be all. Changing it spaces "
            "them evenly.",
        )
        with gui.add_form(None) as spacing:
            self._angles = gui.add_text(
                "Light angles (°)",
                "",
                hint="Where each light is around the ring, clockwise as the camera sees it, as 0, 36, 72, 108; then "
                "Enter or the button. Blank: evenly spaced.",
            )
            set_angles = gui.add_button(
                "Set the angles", icon=viser.Icon.CIRCLE_DOTTED, hint="Take over what is typed above."
            )
        on_change(self._diameter, self._change, lambda view: with_diameter_cm(view, self._diameter.value))
        on_click(set_angles, lambda client: self._change(self._with_angles, client, reload=True))

        @self._lights.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            client = event.client
            if client is not None:
                self._change(lambda view: self._with_lights(view, client), client)

        @spacing.on_submit
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                self._change(self._with_angles, event.client, reload=True)

    def _add_intrinsics(self, gui: viser.GuiApi) -> None:
        self._intrinsics = {name: add_slider(gui, f"{name} (px)", _HINTS[name]) for name in INTRINSICS}
        self._lock = gui.add_checkbox(
            "Lock fx = fy", False, hint="Pixels of nearly all cameras are square: moving one focal length moves both."
        )
        for name in ("fx", "fy"):
            on_change(self._intrinsics[name], self._change, self._with_focal(name))
        for name in ("cx", "cy"):
            on_change(self._intrinsics[name], self._change, _set(with_intrinsic, name, self._intrinsics[name]))
        on_change(self._lock, self._change, self._with_lock, reload=True)

    def _add_port(self, gui: viser.GuiApi) -> None:
        self._port = gui.add_checkbox(
            "Flat port",
            False,
            hint="The camera was calibrated in air and looks through a flat window. Off: calibrated in the water, or "
            "behind a dome.",
        )
        self._lengths = {
            "air_gap_m": add_slider(gui, "Air gap (mm)", "From the lens's centre of projection to the window."),
            "glass_m": add_slider(gui, "Window (mm)", "Thickness of the window."),
        }
        self._indices = {
            "glass_index": (add_slider(gui, "Window index", "Refractive index of the window; no unit."), WINDOWS),
            "water_index": (add_slider(gui, "Water index", "Refractive index of the water; no unit."), WATERS),
        }
        self._names = {
            "glass_index": gui.add_dropdown("Window of", (*WINDOWS, OTHER_INDEX), hint="Sets the window's index."),
            "water_index": gui.add_dropdown("Water is", (*WATERS, OTHER_INDEX), hint="Sets the water's index."),
        }
        on_change(self._port, self._change, lambda view: with_port(view, self._port.value), reload=True)
        for name, slider in self._lengths.items():
            on_change(slider, self._change, _set(with_port_value, name, slider))
        for name, (slider, _) in self._indices.items():
            on_change(slider, self._change, _set(with_port_value, name, slider), reload=True)
            on_change(self._names[name], self._change, self._with_named_index(name), reload=True)

    def _add_buttons(self, gui: viser.GuiApi) -> None:
        given = gui.add_button(
            "Back to the given values",
            icon=viser.Icon.ARROW_BACK_UP,
            hint="Camera and dock as they came with this picture, or from the camera file.",
        )
        default = gui.add_button(
            "Back to the default", icon=viser.Icon.RESTORE, hint="A camera of 60 degrees and a dock of 30 cm."
        )
        self._format = gui.add_dropdown(
            "Camera file as", FORMATS, hint="dockpose holds everything; ros and opencv have no place for a port."
        )
        save = gui.add_button("Save the camera", icon=viser.Icon.DOWNLOAD, hint="The camera as it stands here.")
        on_click(given, lambda client: self._change(with_given_values, client, reload=True))
        on_click(default, lambda client: self._change(with_default_values, client, reload=True))
        on_click(save, lambda client: self._change(self._saver(client), client))

    def _load_port(self, view: View) -> None:
        port = view.camera.port
        self._port.value = port is not None
        handles = [*self._lengths.values(), *(slider for slider, _ in self._indices.values()), *self._names.values()]
        for handle in handles:
            handle.disabled = port is None
        if port is None:
            return
        for name, slider in self._lengths.items():
            set_slider(slider, PORT_LIMITS[name], 1000 * getattr(port, name))
        for name, (slider, names) in self._indices.items():
            set_slider(slider, PORT_LIMITS[name], getattr(port, name))
            self._names[name].value = index_name(names, getattr(port, name))

    def _with_lights(self, view: View, client: viser.ClientHandle) -> View:
        changed = with_lights(view, self._lights.value)
        lost = dropped_sentence(view.dock, changed.dock)
        if lost:
            client.add_notification("Please check the lights", lost, color="yellow")
        self._angles.value = angles_text(changed.dock)
        return changed

    def _with_angles(self, view: View) -> View:
        return with_angles(view, self._angles.value)

    def _with_focal(self, name: str) -> Callable[[View], View]:
        def set_focal(view: View) -> View:
            changed = with_focal(view, name, self._intrinsics[name].value, both=bool(self._lock.value))
            other = "fy" if name == "fx" else "fx"
            value = round(getattr(changed.camera, other), 4)
            if self._lock.value and self._intrinsics[other].value != value:
                self._intrinsics[other].value = value
            return changed

        return set_focal

    def _with_lock(self, view: View) -> View:
        return with_focal(view, "fx", view.camera.fx, both=True) if self._lock.value else view

    def _with_named_index(self, name: str) -> Callable[[View], View]:
        def set_index(view: View) -> View:
            index = self._indices[name][1].get(self._names[name].value)
            return view if index is None or view.camera.port is None else with_port_value(view, name, index)

        return set_index

    def _saver(self, client: viser.ClientHandle) -> Callable[[View], View]:
        def save(view: View) -> View:
            content = camera_file(view.camera, self._format.value)
            client.send_file_download("camera.yaml", content, save_immediately=True)
            return view

        return save


def _set(function: Callable[[View, Any, Any], View], name: Any, slider: Any) -> Callable[[View], View]:
    return lambda view: function(view, name, slider.value)
