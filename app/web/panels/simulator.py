"""A simulated scene with a slider for all that matters in it; turning one shows the scene."""

import msgspec
import viser
from dockpose.app.inputs.received import read_sent
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state import scene as scenes
from dockpose.app.state.parameters import SCENE_DISTURBANCES, SCENE_POSE, SCENE_WATER, Parameter
from dockpose.app.state.view import View
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Change, Panel, Slider, add_upload_button, loading, on_change, on_click, on_download
from dockpose.files.yaml_file import to_yaml
from dockpose.simulate import Scene, load_scene
from dockpose.simulate.optics.water import PRESETS

_OTHER_WATER = "(own mixture)"
_SAID = read_toml("controls.toml")["simulator"]


class SimulatorPanel(Panel):
    """Sliders for pose, water and disturbances; a scene file can be loaded and saved."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        self._change = change
        self._sliders: list[Slider] = []
        self._area = gui.add_folder(None)
        with self._area:
            with gui.add_folder("Pose of the dock"):
                self._add_sliders(gui, SCENE_POSE)
            with gui.add_folder("Water and light", expand_by_default=False):
                self._add_water(gui)
            with gui.add_folder("Disturbances", expand_by_default=False):
                self._add_disturbances(gui)
            own, save = gui.add_button(**_SAID["own"]), gui.add_button(**_SAID["save"])
        on_click(own, lambda client: change(scenes.with_camera_in_use, client, reload=True))
        on_download(save, change, "scene.yaml", lambda view: scene_bytes(scenes.scene_of(view)))
        on_change(self._water, change, self._with_water, reload=True)
        on_change(self._psf, change, lambda view: scenes.with_psf(view, self._psf.value))
        on_change(self._missing, change, lambda view: scenes.with_missing(view, self._missing.value))
        on_change(self._text, change, lambda view: scenes.with_text(view, self._text.value))

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to load a scene."""
        add_upload_button(self._area, client, uploads, loading(self._change, _with_scene_file), **_SAID["load"])

    def load(self, view: View) -> None:
        """Set all controls to the scene shown, or to the default one."""
        scene = scenes.scene_of(view)
        for slider in self._sliders:
            slider.load(view)
        self._water.value = scenes.preset_name(scene.water) or _OTHER_WATER
        self._psf.value = scene.psf.model if scene.psf.model in scenes.PSF_MODELS else scenes.PSF_MODELS[0]
        self._missing.value = ", ".join(map(str, scene.lights.missing))
        self._text.value = scene.texts[0].text if scene.texts else ""

    def show(self, analysis: Analysis) -> None:
        """The truth stands in the table of poses; here only the water's name follows the turbidity."""
        name = scenes.preset_name(scenes.scene_of(analysis.view).water) or _OTHER_WATER
        if self._water.value != name:
            self._water.value = name

    def _add_sliders(self, gui: viser.GuiApi, parameters: dict[str, Parameter]) -> None:
        self._sliders += [Slider(gui, parameter, self._change) for parameter in parameters.values()]

    def _add_water(self, gui: viser.GuiApi) -> None:
        self._water = gui.add_dropdown(**_SAID["water"], options=(*PRESETS, _OTHER_WATER))
        self._psf = gui.add_dropdown(**_SAID["psf"], options=scenes.PSF_MODELS)
        self._add_sliders(gui, SCENE_WATER)

    def _add_disturbances(self, gui: viser.GuiApi) -> None:
        self._add_sliders(gui, SCENE_DISTURBANCES)
        self._missing, self._text = gui.add_text(**_SAID["missing"]), gui.add_text(**_SAID["text"])

    def _with_water(self, view: View) -> View:
        return view if self._water.value == _OTHER_WATER else scenes.with_water(view, self._water.value)


def scene_bytes(scene: Scene) -> bytes:
    """A scene file that :func:`dockpose.simulate.load_scene` reads back to the same numbers."""
    return to_yaml(msgspec.to_builtins(scene)).encode()


def _with_scene_file(view: View, data: bytes, name: str) -> View:
    return scenes.with_scene(view, read_sent(data, name, load_scene), keep=False)
