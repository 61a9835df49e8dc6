"""Which picture is looked at: a sample scene or a file."""

from __future__ import annotations

import viser

from app.panels import Change, on_change
from app.reading import Reading
from app.resources import sample_names
from app.state import View, with_sample, with_upload
from app.uploads import ClientUploads

OWN_PICTURE = "(own picture)"


class SourcePanel:
    """A drop-down of sample scenes, and a button to upload a picture."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        self._change = change
        self._folder = gui.add_folder("Picture")
        with self._folder:
            self._sample = gui.add_dropdown(
                "Sample scene",
                (*sample_names(), OWN_PICTURE),
                hint="Simulated scenes that come with the program; their camera, dock and true pose are known.",
                order=1,
            )
        on_change(self._sample, change, self._with_sample, reload=True)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its upload button: a shared one would show each browser the others' uploads."""
        with self._folder:
            button = client.gui.add_upload_button(
                "Upload a picture",
                icon=viser.Icon.UPLOAD,
                mime_type="image/*",
                hint="PNG, JPEG, TIFF, BMP, WebP or PNM, 8 or 16 bit, at most 200 MB. It stays on this machine.",
                order=2,
            )

        def take(data: bytes, name: str) -> None:
            self._change(lambda view: with_upload(view, data, name), client, reload=True)

        uploads.receive(button, take)

    def load(self, view: View) -> None:
        """Show which sample it is, if it is one."""
        self._sample.value = view.sample or OWN_PICTURE

    def show(self, reading: Reading) -> None:
        """Nothing here depends on the result."""

    def _with_sample(self, view: View) -> View:
        return view if self._sample.value == OWN_PICTURE else with_sample(view, self._sample.value)
