"""The Export tab: one file of what was found; and all of them in a ZIP file, for the button beneath the strip."""

from functools import partial
from typing import Any

import cv2
from dockpose.app.drawing.annotated import DRAWN, LAYERS
from dockpose.app.errors import UserError
from dockpose.app.export.bundle import Files, bundle_name, picture_files, to_zip
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.resources import read_toml
from dockpose.app.web.choices import Client
from dockpose.app.web.html import small
from dockpose.app.web.page import Page
from dockpose.app.web.server.viser_private import page_of_scene
from dockpose.app.web.widgets import Panel
from dockpose.camera import mark

WHAT = read_toml("controls.toml")["export"]["files"]
_RENDER_S = 20.0
_NOT_DRAWN = f"The browser did not draw the 3D view in {_RENDER_S:.0f} s. Keep this page in front while it is saved."
_WORDS = (
    "Files go to this browser's downloads and hold the picture and the numbers as shown now; the annotated picture has "
    "the layers that are shown over the picture here."
)


class ExportPanel(Panel):
    """A list of files."""

    table = "export"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self.gui.add_html(small(_WORDS))
        self._what = self.add("dropdown", "what", options=tuple(WHAT))
        self.add("button", "save", self._save)
        self._layers: dict[int, list[str]] = {}  # by browser, where it shows others than usual

    def follow(self, asked: Any, client: Client) -> None:
        """Draw on the annotated picture what a browser shows over its own, and the numbers."""
        self._layers[client.client_id] = [name for name in LAYERS if name in (*asked.of, "scale", "text")]

    def _save(self, client: Client) -> None:
        analysis, name = self.analysis, WHAT.get(self._what.value)
        if analysis is None or name is None:
            return

        def make(progress: Progress) -> bytes:
            files = self._files(analysis, client)
            if name not in files:
                raise UserError(f"{analysis.view.source}: there is no {name}: {analysis.estimate.message}")
            return files[name]()

        self.app.work.save(client, bundle_name(analysis.view.source, f"_{name}"), make)

    def save_all(self, asked: Any, client: Client) -> None:
        """Save everything as one ZIP file, in the downloads of this browser."""
        analysis = self.analysis
        if analysis is None:
            return

        def make(progress: Progress) -> bytes:
            files = self._files(analysis, client)
            try:
                seen = files["view_3d.png"]()
                files["view_3d.png"] = lambda: seen
            except UserError as error:
                del files["view_3d.png"]
                self.app.notify("The ZIP file lacks a picture", str(error), "yellow", client)
            return to_zip(files, progress)

        self.app.work.save(client, bundle_name(analysis.view.source), make)

    def _files(self, analysis: Analysis, client: Client) -> Files:
        layers = self._layers.get(client.client_id, DRAWN)
        files = picture_files(analysis, layers=layers, sha256=analysis.view.sha256)
        server = self.app.server
        saved = {"view_3d.png": partial(view_picture, client), "view_3d.html": lambda: page_of_scene(server).encode()}
        return files | saved


def view_picture(client: Client) -> bytes:
    """Return the 3D view as one browser shows it, as PNG without a background."""
    size = client.camera.image_height, client.camera.image_width
    try:
        picture = client.get_render(*size, transport_format="png", timeout=_RENDER_S)
    except (TimeoutError, RuntimeError) as error:
        raise UserError(_NOT_DRAWN) from error
    return mark.to_png(cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA))
