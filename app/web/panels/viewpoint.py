"""Buttons that move the viewpoint of the 3D scene."""

from __future__ import annotations

from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.view import View
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.scene.viewpoints import NAMES


class ViewpointPanel:
    """One button a viewpoint; each moves only the browser it was pressed in."""

    def __init__(self, gui: viser.GuiApi, scene: Scene3D) -> None:
        buttons = gui.add_button_group(
            "3D view from",
            NAMES,
            hint="Drag the scene to turn it, scroll to zoom, drag with the right button to shift.",
        )

        @buttons.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None and buttons.value in NAMES:
                scene.look_from(event.client, buttons.value)

    def load(self, view: View) -> None:
        """There is nothing to set."""

    def show(self, analysis: Analysis) -> None:
        """Nothing here depends on the result."""
