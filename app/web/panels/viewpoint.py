"""Buttons that move the viewpoint of the 3D scene."""

from __future__ import annotations

import viser
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.scene.viewpoints import NAMES
from dockpose.app.web.widgets import Panel, on_click


class ViewpointPanel(Panel):
    """One button a viewpoint; each moves only the browser it was pressed in."""

    def __init__(self, gui: viser.GuiApi, scene: Scene3D) -> None:
        buttons = gui.add_button_group(
            "3D view from",
            NAMES,
            hint="Drag the scene to turn it, scroll to zoom, drag with the right button to shift.",
        )

        def look(client: viser.ClientHandle) -> None:
            if buttons.value in NAMES:
                scene.look_from(client, buttons.value)

        on_click(buttons, look)
