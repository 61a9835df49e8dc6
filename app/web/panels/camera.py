"""The camera and the dock's size: what turns pixels into metres."""

from functools import partial
from html import escape
from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state import camera as optics
from dockpose.app.state.changes import MAX_LIGHTS, angles_text, dropped_sentence, with_angles, with_lights
from dockpose.app.state.parameters import DISTORTION, DOCK, LENS, PORT, put
from dockpose.app.state.view import View
from dockpose.app.web.widgets import App, Panel, on_person, return_when_idle
from dockpose.camera.files import FORMATS
from dockpose.camera.tone import TONES

_SMALL = "padding: 0 0.75em 0.5em; font-size: 0.85em; line-height: 1.35"
_NAMED_INDICES = {"glass_index": optics.WINDOWS, "water_index": optics.WATERS}


def with_focal(view: View, name: str, value: Any, *, both: bool) -> View:
    """Set fx or fy in pixels, or both to the same number."""
    for one in ("fx", "fy") if both else (name,):
        view = put(view, one, value)
    return view


def field_of_view_html(analysis: Analysis) -> str:
    """How much the camera sees."""
    return f'<div style="{_SMALL}">{escape(optics.field_of_view_sentence(analysis.view.camera))}</div>'


class CameraPanel(Panel):
    """Sliders with typed values for lens, port and dock; camera files are loaded and saved."""

    table = "camera"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        with self.gui.add_folder("Dock"):
            self._add_dock()
        area = self.gui.add_folder("Camera")
        with area:
            app.live.place("field-of-view", field_of_view_html, order=2)
            with self.gui.add_folder("Focal length and image centre", expand_by_default=False, order=3):
                self.add_sliders(LENS, {name: partial(self._with_focal, name) for name in ("fx", "fy")})
                self._lock = self.add("checkbox", "lock", self.changing(self._with_lock))
            with self.gui.add_folder("Lens distortion", expand_by_default=False, order=4):
                self.add_sliders(DISTORTION)
            with_tone = self.changing(lambda view: optics.with_tone(view, str(self._tone.value)))
            self._tone = self.add("dropdown", "tone", with_tone, options=TONES, order=2.5)
            with self.gui.add_folder("Port and water", expand_by_default=False, order=5):
                self._add_port()
            with self.gui.add_folder("Save, or go back", expand_by_default=False, order=6):
                self.add("button", "given", self.changing(optics.with_given_values))
                self.add("button", "default", self.changing(optics.with_default_values))
                kind = self.add("dropdown", "format", options=FORMATS)
                self.add_download("save", "camera.yaml", lambda view: optics.camera_file(view.camera, kind.value))
        self.add_upload(area, "load", self.changing_by_file(optics.with_camera_file))

    def load(self, view: View) -> None:
        """Set the sliders' ranges and values."""
        super().load(view)
        if view.camera.fx != view.camera.fy:
            self._lock.value = False
        self._tone.options, self._tone.value = optics.tone_names(view.camera), str(view.camera.tone)
        self._load_port(view)
        self._load_lights(view)
        self._angles.value = angles_text(view.dock)

    def _add_dock(self) -> None:
        self.add_sliders(DOCK)
        self._lights = self.add(
            "number", "lights", lambda client: self.change(partial(self._with_lights, client), client), max=MAX_LIGHTS
        )
        uneven = self.gui.add_folder("Lights that are not evenly spaced", expand_by_default=False)
        with uneven, self.gui.add_form(None) as spacing:
            set_angles = self.changing(lambda view: with_angles(view, self._angles.value))
            self._angles = self.add("text", "angles")
            self.add("button", "set_angles", set_angles)
        on_person(spacing.on_submit, set_angles)

    def _add_port(self) -> None:
        with_port = self.changing(lambda view: optics.with_port(view, self._port.value))
        self._port = self.add("checkbox", "port", with_port)
        self.add_sliders(PORT, reloading=_NAMED_INDICES)
        self._names = {
            name: self.add(
                "dropdown",
                name,
                self.changing(partial(self._with_named_index, name)),
                options=(*named, optics.OTHER_INDEX),
            )
            for name, named in _NAMED_INDICES.items()
        }

    def _load_lights(self, view: View) -> None:
        self._lights.value = view.dock.lights or 0

    def _load_port(self, view: View) -> None:
        self._port.value = has_port = view.camera.port is not None
        for handle in (*(self.sliders[name].handle for name in PORT), *self._names.values()):
            handle.disabled = not has_port
        for name, handle in self._names.items():
            handle.value = optics.index_name(_NAMED_INDICES[name], PORT[name].get(view))

    def _with_lights(self, client: viser.ClientHandle, view: View) -> View:
        changed = with_lights(view, self._lights.value)
        if (changed.dock.lights or 0) != self._lights.value:
            return_when_idle(self._lights, self.change, client, self._load_lights)
        lost = dropped_sentence(view.dock, changed.dock)
        if lost:
            client.add_notification("Please check the lights", lost, color="yellow")
        self._angles.value = angles_text(changed.dock)
        return changed

    def _with_focal(self, name: str, view: View, value: Any) -> View:
        changed = with_focal(view, name, value, both=bool(self._lock.value))
        if self._lock.value:
            for one in ("fx", "fy"):
                if one != name:
                    self.sliders[one].load(changed)
        return changed

    def _with_lock(self, view: View) -> View:
        return with_focal(view, "fx", view.camera.fx, both=True) if self._lock.value else view

    def _with_named_index(self, name: str, view: View) -> View:
        index = _NAMED_INDICES[name].get(self._names[name].value)
        return view if index is None or view.camera.port is None else put(view, name, index)
