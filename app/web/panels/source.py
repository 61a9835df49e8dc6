"""Of the tab Source: a sample, an upload, a file of a folder on this machine, or a simulated scene."""

from html import escape
from pathlib import Path
from typing import Any

import msgspec
from dockpose.app.drawing.numbers import count
from dockpose.app.inputs.received import below, clean_name, folders_below, pictures_in, read_sent, step
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state import scene as scenes
from dockpose.app.state.parameters import SCENE_DISTURBANCES, SCENE_POSE, SCENE_WATER
from dockpose.app.state.view import View, with_file, with_sample, with_upload
from dockpose.app.web.choices import Act, Client
from dockpose.app.web.html import small
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel, offer
from dockpose.files import to_yaml
from dockpose.sidecar import sample_names
from dockpose.simulate import Scene, load_scene

OWN_PICTURE = "(own picture)"
NONE_CHOSEN = "(none)"
SAMPLE_WORDS = read_toml("controls.toml")["source"]["samples"]


class SourcePanel(Panel):
    """Samples, uploads, and pictures below ``root`` or ``beside`` the given one."""

    table = "source"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._kept, root, self._together = app.kept, app.options.folder, list[str]()
        self._roots = {"folder": root, "beside": app.beside}
        area = self.gui.add_folder(None)
        with area:
            samples, none = (*sample_names(), OWN_PICTURE), (NONE_CHOSEN,)
            self._sample = self.add("dropdown", "sample", self._opening("samples"), options=samples)
            self._words = self.gui.add_html("", order=3.1)
            self._uploaded = self.add("dropdown", "uploaded", self._opening("uploads"), options=none)
            self._forget = self.add("button", "forget", self._forget_uploads)
            self._choices = {"samples": self._sample, "uploads": self._uploaded}
            if root is not None:
                with_folder = self.changing(lambda view: (self._list_files(None), view)[1], reload=False)
                self._folder = self.add("dropdown", "folder", with_folder, options=tuple(folders_below(root)))
                self._choices["folder"] = self.add("dropdown", "file", self._opening("folder"), options=none)
        self.add_upload(area, "upload", self.changing_by_file(self._with_new_upload))

    def turn(self, by: int, client: Client) -> None:
        """Show the picture ``by`` places further in the list; at its end, say so."""
        self.change(lambda view: self._turned(view, by, client), client, reload=True)

    def expect(self, asked: Any, client: Client) -> None:
        """Take note of pictures that are sent together: of these the first is to be shown."""
        self._together = [clean_name(name) for name in asked.names]

    def load(self, view: View) -> None:
        """Show which list the picture is from."""
        self._sample.value = view.sample or OWN_PICTURE
        self._words.content = small(escape(SAMPLE_WORDS.get(view.sample or "", "")))
        uploaded = self._kept.names()
        self._uploaded.visible = bool(uploaded)
        is_sent = self.app.opened is not None and self.app.opened.folder is not None
        self._forget.visible = bool(uploaded) or view.list_name == "uploads" or is_sent
        self._forget.label = f"Forget uploads ({_megabytes(self._kept.kept_bytes)})"
        _fill(self._uploaded, uploaded, view.item if view.list_name == "uploads" else None)
        self._list_files(view.item if view.list_name == "folder" else None)

    def show(self, analysis: Analysis) -> None:
        """Deselect the sample once its scene was changed."""
        name = analysis.view.sample or OWN_PICTURE
        if self._sample.value != name:
            self._sample.value = name

    def _opening(self, list_name: str) -> Act:
        return self.changing(lambda view: self._opened(view, list_name, self._choices[list_name].value))

    def _opened(self, view: View, list_name: str, name: str | None) -> View:
        if name in (None, OWN_PICTURE, NONE_CHOSEN):
            return view
        if list_name == "samples":
            return with_sample(view, name)
        if list_name == "uploads":
            return with_upload(view, self._kept.get(name), name)
        root = self._roots[list_name]
        return view if root is None else with_file(view, below(root, name), name, list_name)

    def _with_new_upload(self, view: View, data: bytes, name: str) -> View:
        shown, together = with_upload(view, data, name), self._together
        self._kept.add(name, data)  # only what can be read is kept
        is_later = view.list_name == "uploads" and {name, view.item} <= {*together}
        return view if is_later and together.index(view.item) < together.index(name) else shown

    def _forget_uploads(self, client: Client) -> None:
        """Forget all that was sent; a sample takes the place of what is shown of it."""

        def without_uploads(view: View) -> View:
            pictures, freed = count(len(self._kept.names()), "picture"), _megabytes(self._kept.kept_bytes)
            self._kept.make_room(0)
            self.app.memory.forget_picture()
            self.app.notify("Uploads forgotten", f"{pictures}, which frees {freed} of memory.", "green", client)
            is_sent = self.app.opened is not None and self.app.opened.folder is not None
            is_forgotten = view.list_name == "uploads" or is_sent
            return with_sample(view, sample_names()[0]) if is_forgotten else view

        self.change(without_uploads, client, reload=True)

    def _list_files(self, chosen: str | None) -> None:
        root = self._roots["folder"]
        if root is not None:
            _fill(self._choices["folder"], pictures_in(root, self._folder.value), chosen)

    def _turned(self, view: View, by: int, client: Client) -> View:
        root = self._roots.get(view.list_name)
        if root is not None:
            names = pictures_in(root, Path(view.item).parent.as_posix())
        else:
            names = {"samples": sample_names(), "uploads": self._kept.names()}.get(view.list_name, [])
        name = step(names, view.item, by)
        if name is None:
            place = f"{view.source} is the {'last' if by > 0 else 'first'} of {len(names)} pictures."
            words = place if view.item in names else f"{view.source} is in no list of pictures."
            self.app.notify("No other picture", words, "yellow", client)
        return self._opened(view, view.list_name, name)


def _megabytes(size: int) -> str:
    return f"{size / 2**20:.1f} MB"


def _fill(dropdown: Any, names: list[str], chosen: str | None) -> None:
    offer(dropdown, (NONE_CHOSEN, *names), chosen if chosen in names else NONE_CHOSEN)


class SimulatorPanel(Panel):
    """Sliders for pose, water and disturbances; a scene file can be loaded and saved."""

    table = "simulator"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        area = self.gui.add_folder("Simulate", expand_by_default=False)
        with area:
            self._paper = self.add_value("dropdown", "paper")
            with self.gui.add_folder("Pose of the dock"):
                self.add_sliders(SCENE_POSE)
            with self.gui.add_folder("Water and light", expand_by_default=False):
                self.add_sliders(SCENE_WATER)
            with self.gui.add_folder("Disturbances", expand_by_default=False):
                self.add_sliders(SCENE_DISTURBANCES)
                self.add_value("text", "missing", reload=False)
                self.add_value("text", "text", reload=False)
            self.add("button", "own", self.changing(scenes.with_camera_in_use))
            self.add_download("save", "scene.yaml", lambda view: scene_bytes(scenes.scene_of(view)))
        self.add_upload(area, "load", self.changing_by_file(_with_scene_file))

    def show(self, analysis: Analysis) -> None:
        """Deselect the paper's scene once it was changed."""
        self._paper.value = scenes.paper_scene(analysis.view)


def scene_bytes(scene: Scene) -> bytes:
    """A scene file that :func:`dockpose.simulate.load_scene` reads back to the same numbers."""
    return to_yaml(msgspec.to_builtins(scene)).encode()


def _with_scene_file(view: View, data: bytes, name: str) -> View:
    return scenes.with_scene(view, read_sent(data, name, load_scene), keep=False)
