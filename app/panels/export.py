"""Everything that was found, in one file to take away."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from app.export.bundle import bundle, bundle_name
from app.panels.detect import SMALL
from app.reading import Reading
from app.state import View
from app.task import Progress, Task

_CONTENTS = (
    "One ZIP file with the annotated picture (PNG), all numbers as JSON and as a CSV table, and the camera, dock and "
    "settings that they were found with (YAML). It goes to this browser's downloads."
)


class ExportPanel:
    """A button that makes the file and sends it to the browser that asked for it.

    Parameters
    ----------
    gui : where to build it.
    on_error : told what goes wrong in the background.
    """

    def __init__(self, gui: viser.GuiApi, on_error: Callable[[Exception], None]) -> None:
        self._reading: Reading | None = None
        gui.add_html(f'<div style="{SMALL}">{_CONTENTS}</div>')
        self._montage = gui.add_checkbox(
            "With the montage of all methods",
            True,
            hint="Also try every threshold method and put their pictures side by side: takes a second or so longer.",
        )
        self._save = gui.add_button(
            "Save all as one ZIP file",
            icon=viser.Icon.FILE_ZIP,
            hint="Of the picture and the settings as they are now.",
        )
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, visible=False, hint="Do not make the file.")
        self._task = Task(self._tell, self._on_end, on_error)
        self._stop.on_click(lambda event: self._task.cancel())

        @self._save.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            client, reading = event.client, self._reading
            if client is None or reading is None:
                return
            with_montage = bool(self._montage.value)
            if self._task.start(lambda progress: _send(client, reading, progress, with_montage)):
                self._bar.visible = self._stop.visible = with_montage

    def load(self, view: View) -> None:
        """Nothing here belongs to the view."""

    def show(self, reading: Reading) -> None:
        """Remember what there is to save."""
        self._reading = reading

    def close(self) -> None:
        """Stop whatever runs."""
        self._task.close()

    def _tell(self, share: float) -> None:
        if round(100 * share) != self._bar.value:
            self._bar.value = round(100 * share)

    def _on_end(self) -> None:
        self._bar.visible = self._stop.visible = False


def _send(client: viser.ClientHandle, reading: Reading, progress: Progress, with_montage: bool) -> None:
    content = bundle(reading, progress, with_montage=with_montage)
    client.send_file_download(bundle_name(reading.view.source), content, save_immediately=True)
