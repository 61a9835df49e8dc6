"""Choose a picture: a sample scene, an upload, or a file of a folder on this machine; or open a video."""

from html import escape
from pathlib import Path
from typing import Any

import viser
from dockpose.app.inputs.folder import below, folders_below, pictures_in, step
from dockpose.app.inputs.pictures import sample_names
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state.view import View, with_file, with_sample, with_upload
from dockpose.app.web.html import small
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Panel, Parts, add_upload_button, loading, offer, on_change, on_click

OWN_PICTURE = "(own picture)"
NONE_CHOSEN = "(none)"
_SAID = read_toml("controls.toml")["source"]
SAMPLE_WORDS = _SAID["samples"]


class SourcePanel(Panel):
    """Samples, uploads, pictures below ``root`` or ``beside`` the given one, and buttons that turn their pages."""

    def __init__(self, gui: viser.GuiApi, parts: Parts) -> None:
        change, root = parts.change, parts.root
        self._change, self._uploads, self._root, self._beside = change, parts.uploads, root, parts.beside
        self._sequence, self._memory = parts.sequence, parts.memory
        self._area = gui.add_folder(None)
        with self._area:
            self._sample = gui.add_dropdown(**_SAID["sample"], options=(*sample_names(), OWN_PICTURE))
            self._words = gui.add_html("", order=3.1)
            self._uploaded: Any = gui.add_dropdown(**_SAID["uploaded"], options=(NONE_CHOSEN,))
            self._forget = gui.add_button(**_SAID["forget"])
            folders, is_there = ["."] if root is None else folders_below(root), root is not None
            self._folder = gui.add_dropdown(**_SAID["folder"], options=tuple(folders), visible=is_there)
            self._file: Any = gui.add_dropdown(**_SAID["file"], options=(NONE_CHOSEN,), visible=is_there)
            pages = gui.add_button_group(**_SAID["pages"])
        on_change(self._sample, change, self._with_sample, reload=True)
        on_change(self._uploaded, change, self._with_uploaded, reload=True)
        on_change(self._file, change, self._with_file, reload=True)
        on_click(
            self._forget, lambda client: change(lambda view: self._without_uploads(view, client), client, reload=True)
        )
        on_change(self._folder, change, self._with_folder)
        on_click(pages, lambda client: self.turn(-1 if pages.value == "Previous" else 1, client))

    def turn(self, by: int, client: viser.ClientHandle) -> None:
        """Show the picture ``by`` places further in the list."""
        self._change(lambda view: self._turned(view, by), client, reload=True)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its upload buttons."""
        take = loading(self._change, self._with_new_upload)
        add_upload_button(self._area, client, uploads, take, **_SAID["upload"])
        add_upload_button(self._area, client, uploads, self._sequence.take, **_SAID["upload_video"])

    def load(self, view: View) -> None:
        """Show which list the picture is from."""
        self._sample.value = view.sample or OWN_PICTURE
        self._words.content = small(escape(SAMPLE_WORDS.get(view.sample or "", "")))
        uploaded = self._uploads.names()
        self._uploaded.visible = bool(uploaded)
        self._forget.visible = bool(uploaded) or view.list_name == "uploads" or self._sequence.is_sent
        self._forget.label = f"Forget uploads ({_megabytes(self._uploads.kept_bytes)})"
        _fill(self._uploaded, uploaded, view.item if view.list_name == "uploads" else None)
        if self._root is not None:
            files = pictures_in(self._root, self._folder.value)
            _fill(self._file, files, view.item if view.list_name == "folder" else None)

    def show(self, analysis: Analysis) -> None:
        """Deselect the sample once its scene was changed."""
        name = analysis.view.sample or OWN_PICTURE
        if self._sample.value != name:
            self._sample.value = name

    def _with_sample(self, view: View) -> View:
        return view if self._sample.value == OWN_PICTURE else with_sample(view, self._sample.value)

    def _with_new_upload(self, view: View, data: bytes, name: str) -> View:
        shown = with_upload(view, data, name)
        self._uploads.add(name, data)  # only what can be read is kept
        return shown

    def _without_uploads(self, view: View, client: viser.ClientHandle) -> View:
        """Forget all that was sent; a sample takes the place of what is shown of it."""
        sentence = forgotten_sentence(len(self._uploads.names()), self._uploads.kept_bytes)
        self._uploads.make_room(0)
        self._memory.forget_picture()
        client.add_notification("Uploads forgotten", sentence, color="green")
        return with_sample(view, sample_names()[0]) if view.list_name == "uploads" or self._sequence.is_sent else view

    def _with_uploaded(self, view: View) -> View:
        name = self._uploaded.value
        return view if name == NONE_CHOSEN else with_upload(view, self._uploads.get(name), name)

    def _with_file(self, view: View) -> View:
        name = self._file.value
        return view if name == NONE_CHOSEN or self._root is None else with_file(view, below(self._root, name), name)

    def _with_folder(self, view: View) -> View:
        """List the pictures of the chosen folder; the picture that is shown stays."""
        if self._root is not None:
            _fill(self._file, pictures_in(self._root, self._folder.value), None)
        return view

    def _turned(self, view: View, by: int) -> View:
        if view.list_name == "samples":
            name = step(sample_names(), view.item, by)
            return view if name is None else with_sample(view, name)
        if view.list_name == "uploads":
            name = step(self._uploads.names(), view.item, by)
            return view if name is None else with_upload(view, self._uploads.get(name), name)
        root = {"folder": self._root, "beside": self._beside}.get(view.list_name)
        if root is None:
            return view
        name = step(pictures_in(root, Path(view.item).parent.as_posix()), view.item, by)
        return view if name is None else with_file(view, below(root, name), name, view.list_name)


def forgotten_sentence(pictures: int, size: int) -> str:
    """Say how many pictures were forgotten and how much memory that frees."""
    return f"{pictures} picture{'' if pictures == 1 else 's'} forgotten, which frees {_megabytes(size)} of memory."


def _megabytes(size: int) -> str:
    return f"{size / 2**20:.1f} MB"


def _fill(dropdown: Any, names: list[str], chosen: str | None) -> None:
    """Offer "(none)" and the names in a drop-down."""
    offer(dropdown, (NONE_CHOSEN, *names), chosen if chosen in names else NONE_CHOSEN)
