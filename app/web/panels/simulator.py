"""A simulated scene with a slider for all that matters in it; turning one shows the scene."""

from functools import partial

import msgspec
from dockpose.app.inputs.received import read_sent
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state import scene as scenes
from dockpose.app.state.parameters import SCENE_DISTURBANCES, SCENE_POSE, SCENE_WATER
from dockpose.app.state.view import View
from dockpose.app.web.widgets import App, Panel
from dockpose.files.yaml_file import to_yaml
from dockpose.simulate import Scene, load_scene
from dockpose.simulate.optics.water import PRESETS

_OTHER_WATER = "(own mixture)"


class SimulatorPanel(Panel):
    """Sliders for pose, water and disturbances; a scene file can be loaded and saved."""

    table = "simulator"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        area, shown = self.gui.add_folder(None), partial(self.changing, reload=False)
        with area:
            with self.gui.add_folder("Pose of the dock"):
                self.add_sliders(SCENE_POSE)
            with self.gui.add_folder("Water and light", expand_by_default=False):
                waters = *PRESETS, _OTHER_WATER
                self._water = self.add("dropdown", "water", self.changing(self._with_water), options=waters)
                with_psf = shown(lambda view: scenes.with_psf(view, self._psf.value))
                self._psf = self.add("dropdown", "psf", with_psf, options=scenes.PSF_MODELS)
                self.add_sliders(SCENE_WATER)
            with self.gui.add_folder("Disturbances", expand_by_default=False):
                self.add_sliders(SCENE_DISTURBANCES)
                with_missing = shown(lambda view: scenes.with_missing(view, self._missing.value))
                self._missing = self.add("text", "missing", with_missing)
                self._text = self.add("text", "text", shown(lambda view: scenes.with_text(view, self._text.value)))
            self.add("button", "own", self.changing(scenes.with_camera_in_use))
            self.add_download("save", "scene.yaml", lambda view: scene_bytes(scenes.scene_of(view)))
        self.add_upload(area, "load", self.changing_by_file(_with_scene_file))

    def load(self, view: View) -> None:
        """Set all controls to the scene shown, or to the default one."""
        scene = scenes.scene_of(view)
        super().load(view)
        self._water.value = scenes.preset_name(scene.water) or _OTHER_WATER
        self._psf.value = scene.psf.model if scene.psf.model in scenes.PSF_MODELS else scenes.PSF_MODELS[0]
        self._missing.value = ", ".join(map(str, scene.lights.missing))
        self._text.value = scene.texts[0].text if scene.texts else ""

    def show(self, analysis: Analysis) -> None:
        """The truth stands in the table of poses; here only the water's name follows the turbidity."""
        name = scenes.preset_name(scenes.scene_of(analysis.view).water) or _OTHER_WATER
        if self._water.value != name:
            self._water.value = name

    def _with_water(self, view: View) -> View:
        return view if self._water.value == _OTHER_WATER else scenes.with_water(view, self._water.value)


def scene_bytes(scene: Scene) -> bytes:
    """A scene file that :func:`dockpose.simulate.load_scene` reads back to the same numbers."""
    return to_yaml(msgspec.to_builtins(scene)).encode()


def _with_scene_file(view: View, data: bytes, name: str) -> View:
    return scenes.with_scene(view, read_sent(data, name, load_scene), keep=False)
