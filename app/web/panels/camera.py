"""The camera and the dock's size: what turns pixels into metres."""

from collections.abc import Callable
from functools import partial
from html import escape
from typing import Any

import viser
from dockpose import Camera
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state import camera as optics
from dockpose.app.state.changes import MAX_LIGHTS, angles_text, dropped_sentence, with_angles, with_lights
from dockpose.app.state.parameters import DISTORTION, DOCK, LENS, PORT, Parameter, put
from dockpose.app.state.view import View
from dockpose.app.web.live import LivePage
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import (
    Change,
    Panel,
    Slider,
    add_upload_button,
    loading,
    on_change,
    on_click,
    on_download,
    on_person,
    return_when_idle,
)
from dockpose.camera.files import FORMATS

_SMALL = "padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35"
_SAID = read_toml("controls.toml")["camera"]
_NAMED_INDICES = {"glass_index": optics.WINDOWS, "water_index": optics.WATERS}


def with_focal(view: View, name: str, value: Any, *, both: bool) -> View:
    """Set fx or fy in pixels, or both to the same number."""
    for one in ("fx", "fy") if both else (name,):
        view = put(view, one, value)
    return view


def field_of_view_html(camera: Camera) -> str:
    """How much the camera sees."""
    return f'<div style="{_SMALL}">{escape(optics.field_of_view_sentence(camera))}</div>'


class CameraPanel(Panel):
    """Sliders with typed values for lens, port and dock; camera files are loaded and saved."""

    def __init__(self, gui: viser.GuiApi, live: LivePage, change: Change) -> None:
        self._live, self._change = live, change
        self._sliders: dict[str, Slider] = {}
        self._putters = {name: partial(self._with_focal, name) for name in ("fx", "fy")}
        with gui.add_folder("Dock"):
            self._add_dock(gui)
        self._area = gui.add_folder("Camera")
        with self._area:
            live.place(gui, "field-of-view", order=2)
            with gui.add_folder("Focal length and image centre", expand_by_default=False, order=3):
                self._add_intrinsics(gui)
            with gui.add_folder("Lens distortion", expand_by_default=False, order=4):
                self._add_sliders(gui, DISTORTION)
            with gui.add_folder("Port and water", expand_by_default=False, order=5):
                self._add_port(gui)
            with gui.add_folder("Save, or go back", expand_by_default=False, order=6):
                self._add_buttons(gui)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to load a camera file."""
        add_upload_button(self._area, client, uploads, loading(self._change, optics.with_camera_file), **_SAID["load"])

    def load(self, view: View) -> None:
        """Set the sliders' ranges and values."""
        for slider in self._sliders.values():
            slider.load(view)
        if view.camera.fx != view.camera.fy:
            self._lock.value = False
        self._load_port(view)
        self._load_lights(view)
        self._angles.value = angles_text(view.dock)

    def show(self, analysis: Analysis) -> None:
        """Say how much the camera sees."""
        self._live.put_html("field-of-view", field_of_view_html(analysis.view.camera))

    def _add_sliders(self, gui: viser.GuiApi, parameters: dict[str, Parameter]) -> None:
        for name, parameter in parameters.items():
            self._sliders[name] = Slider(
                gui, parameter, self._change, self._putters.get(name), reload=name in _NAMED_INDICES
            )

    def _add_dock(self, gui: viser.GuiApi) -> None:
        self._add_sliders(gui, DOCK)
        self._lights = gui.add_number(**_SAID["lights"], max=MAX_LIGHTS)
        uneven = gui.add_folder("Lights that are not evenly spaced", expand_by_default=False)
        with uneven, gui.add_form(None) as spacing:
            self._angles = gui.add_text(**_SAID["angles"])
            set_angles = gui.add_button(**_SAID["set_angles"])
        for attach in (set_angles.on_click, spacing.on_submit):
            on_person(attach, lambda client: self._change(self._with_angles, client, reload=True))
        on_person(
            self._lights.on_update,
            lambda client: self._change(lambda view: self._with_lights(view, client), client),
        )

    def _add_intrinsics(self, gui: viser.GuiApi) -> None:
        self._add_sliders(gui, LENS)
        self._lock = gui.add_checkbox(**_SAID["lock"])
        on_change(self._lock, self._change, self._with_lock, reload=True)

    def _add_port(self, gui: viser.GuiApi) -> None:
        self._port = gui.add_checkbox(**_SAID["port"])
        self._add_sliders(gui, PORT)
        self._names = {
            name: gui.add_dropdown(**_SAID[name], options=(*named, optics.OTHER_INDEX))
            for name, named in _NAMED_INDICES.items()
        }
        on_change(self._port, self._change, lambda view: optics.with_port(view, self._port.value), reload=True)
        for name, handle in self._names.items():
            on_change(handle, self._change, self._with_named_index(name), reload=True)

    def _add_buttons(self, gui: viser.GuiApi) -> None:
        given, default = gui.add_button(**_SAID["given"]), gui.add_button(**_SAID["default"])
        self._format = gui.add_dropdown(**_SAID["format"], options=FORMATS)
        save = gui.add_button(**_SAID["save"])
        on_click(given, lambda client: self._change(optics.with_given_values, client, reload=True))
        on_click(default, lambda client: self._change(optics.with_default_values, client, reload=True))
        on_download(save, self._change, "camera.yaml", lambda view: optics.camera_file(view.camera, self._format.value))

    def _load_lights(self, view: View) -> None:
        self._lights.value = view.dock.lights or 0

    def _load_port(self, view: View) -> None:
        self._port.value = has_port = view.camera.port is not None
        for handle in (*(self._sliders[name].handle for name in PORT), *self._names.values()):
            handle.disabled = not has_port
        for name, handle in self._names.items():
            handle.value = optics.index_name(_NAMED_INDICES[name], PORT[name].get(view))

    def _with_lights(self, view: View, client: viser.ClientHandle) -> View:
        changed = with_lights(view, self._lights.value)
        if (changed.dock.lights or 0) != self._lights.value:
            return_when_idle(self._lights, self._change, client, self._load_lights)
        lost = dropped_sentence(view.dock, changed.dock)
        if lost:
            client.add_notification("Please check the lights", lost, color="yellow")
        self._angles.value = angles_text(changed.dock)
        return changed

    def _with_angles(self, view: View) -> View:
        return with_angles(view, self._angles.value)

    def _with_focal(self, name: str, view: View, value: Any) -> View:
        changed = with_focal(view, name, value, both=bool(self._lock.value))
        if self._lock.value:
            for one in ("fx", "fy"):
                if one != name:
                    self._sliders[one].load(changed)
        return changed

    def _with_lock(self, view: View) -> View:
        return with_focal(view, "fx", view.camera.fx, both=True) if self._lock.value else view

    def _with_named_index(self, name: str) -> Callable[[View], View]:
        def set_index(view: View) -> View:
            index = _NAMED_INDICES[name].get(self._names[name].value)
            return view if index is None or view.camera.port is None else put(view, name, index)

        return set_index
