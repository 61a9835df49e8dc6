"""The Export tab: one file of what was found, or all of them in a ZIP file."""

from collections.abc import Callable
from functools import partial

import cv2
import viser
from dockpose.app.drawing.annotated import LAYERS
from dockpose.app.errors import UserError
from dockpose.app.export.bundle import Files, bundle_name, picture_files, to_zip
from dockpose.app.export.data import to_png
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.web.html import small
from dockpose.app.web.notifications import Notify
from dockpose.app.web.widgets import Panel, Saver, on_click

WHAT = {
    "Annotated picture (PNG)": "annotated.png",
    "Annotated picture for papers (SVG)": "annotated.svg",
    "Annotated picture for papers (PDF)": "annotated.pdf",
    "Picture as it came (PNG)": "picture.png",
    "Report (HTML)": "report.html",
    "Numbers (CSV)": "result.csv",
    "Numbers (JSON)": "result.json",
    "Pose for ROS (YAML)": "pose_ros.yaml",
    "Camera, dock and settings (YAML)": "settings.yaml",
    "Histogram (PNG)": "histogram.png",
    "Histogram for papers (SVG)": "histogram.svg",
    "All methods side by side (PNG)": "montage.png",
    "3D view as you see it (PNG)": "view_3d.png",
    "3D view to turn and zoom (HTML)": "view_3d.html",
}
# What each layer is called, and what it is.
LAYER_WORDS = {
    "lights": ("Lights", "The dock's lights with their numbers, and the groups that were thrown out."),
    "ellipse": ("Ellipse", "The ellipse through the lights."),
    "centres": ("Centres", "The ellipse's centre and where the dock's centre is seen."),
    "axes": ("Axes", "The axes of both poses."),
    "normals": ("Normals", "The direction in which the dock faces in each pose."),
    "text": ("Numbers", "Threshold and both poses in numbers; in SVG and PDF they stand in the legend."),
    "scale": ("Scale", "A bar as long as a round length at the dock's distance."),
}
_RENDER_S = 20.0
_NOT_DRAWN = (
    f"The browser did not draw the 3D view within {_RENDER_S:.0f} s. Keep this page in front while it is saved."
)
_WORDS = "Files go to this browser's downloads and hold the picture and the numbers as shown now."


class ExportPanel(Panel):
    """A list of files, the layers of the annotated picture, and two buttons."""

    def __init__(self, server: viser.ViserServer, notify: Notify, on_error: Callable[[Exception], None]) -> None:
        self._server, self._notify = server, notify
        self._analysis: Analysis | None = None
        gui = server.gui
        gui.add_html(small(_WORDS))
        self._what = gui.add_dropdown("What", tuple(WHAT), hint="SVG and PDF stay sharp at any size.")
        save = gui.add_button("Save", icon=viser.Icon.DOWNLOAD, hint="Save what is chosen above.")
        self._montage = gui.add_checkbox(
            "With the montage of all methods",
            True,
            hint="Also try every threshold method and put the pictures side by side; takes about a second longer.",
        )
        save_all = gui.add_button(
            "Save all as one ZIP file", icon=viser.Icon.FILE_ZIP, hint="Everything that can be chosen above."
        )
        self._saver = Saver(gui, notify, on_error)
        with gui.add_folder("Drawn on the annotated picture", expand_by_default=False):
            self._layers = {
                name: gui.add_checkbox(LAYER_WORDS[name][0], True, hint=LAYER_WORDS[name][1]) for name in LAYERS
            }
        on_click(save, self._save)
        on_click(save_all, self.save_all)

    @property
    def layers(self) -> list[str]:
        """The layers to draw on the annotated picture."""
        return [name for name, box in self._layers.items() if box.value]

    def show(self, analysis: Analysis) -> None:
        """Keep what to save."""
        self._analysis = analysis

    def close(self) -> None:
        """Stop whatever runs."""
        self._saver.close()

    def _save(self, client: viser.ClientHandle) -> None:
        analysis, layers, name = self._analysis, self.layers, WHAT.get(self._what.value)
        if analysis is None or name is None:
            return

        def make(progress: Progress) -> bytes:
            files = self._files(analysis, client, layers, progress)
            if name not in files:
                raise UserError(f"{analysis.view.source}: there is no {name}: {analysis.estimate.message}")
            return files[name]()

        self._saver.save(client, bundle_name(analysis.view.source, f"_{name}"), make)

    def save_all(self, client: viser.ClientHandle) -> None:
        """Save everything as one ZIP file, in the downloads of this browser."""
        analysis, layers, with_montage = self._analysis, self.layers, bool(self._montage.value)
        if analysis is None:
            return

        def make(progress: Progress) -> bytes:
            files = self._files(analysis, client, layers, progress.silent())
            if not with_montage:
                del files["montage.png"]
            try:
                seen = files["view_3d.png"]()
                files["view_3d.png"] = lambda: seen
            except UserError as error:
                del files["view_3d.png"]
                self._notify("The ZIP file lacks a picture", str(error), "yellow", client)
            return to_zip(files, progress)

        self._saver.save(client, bundle_name(analysis.view.source), make)

    def _files(self, analysis: Analysis, client: viser.ClientHandle, layers: list[str], progress: Progress) -> Files:
        files = picture_files(analysis, layers=layers, sha256=analysis.view.sha256, progress=progress)
        scene = self._server.scene
        return files | {"view_3d.png": partial(view_picture, client), "view_3d.html": lambda: scene.as_html().encode()}


def view_picture(client: viser.ClientHandle) -> bytes:
    """Return the 3D view as one browser shows it, as PNG without a background."""
    size = client.camera.image_height, client.camera.image_width
    try:
        picture = client.get_render(*size, transport_format="png", timeout=_RENDER_S)
    except (TimeoutError, RuntimeError) as error:
        raise UserError(_NOT_DRAWN) from error
    return to_png(cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA))
