"""What was found in the picture, in words and in a table, and the viewpoint of the 3D scene."""

from html import escape

import viser
from dockpose.app.drawing.colours import POSE_NAMES, TRUST_COLOURS
from dockpose.app.drawing.numbers import QUANTITIES
from dockpose.app.export.words import advice
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.web.html import pose_name, result_cells, row, sigma_cells, table, wide_row
from dockpose.app.web.live import LivePage
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.scene.viewpoints import NAMES
from dockpose.app.web.widgets import Panel, on_click

COLUMNS = (*QUANTITIES, "likely (%)", "error (px)")
EXPLANATION = (
    "Centre of the dock from the camera: x right, y down, z ahead. θx, θy: pitch and yaw, 0 if square on. "
    "Error: of the lights, root mean square."
)


def status_html(analysis: Analysis) -> str:
    """The picture's name, what was found in it and what to try, in words."""
    found, trust = analysis.estimate, analysis.trust
    colour = TRUST_COLOURS[trust.colour]
    notes = analysis.view.notes[analysis.view.camera_of == "guess" :]  # of a guess the reasons tell already
    words = " ".join(text for text in (*trust.reasons, found.message, *notes, advice(found)) if text)
    return (
        f'<div role="status" style="padding: 0.2em 0.75em 0.4em; line-height: 1.35; min-height: 3em">'
        f'<b id="trust" data-trust="{trust.colour}" style="border-left: 0.35em solid {colour}; padding-left: 0.4em">'
        f"{trust.verdict}</b> in "
        f"{escape(analysis.view.source)} ({found.width} × {found.height}). {escape(words)}"
        "</div>"
    )


def table_html(analysis: Analysis) -> str:
    """Both candidates and, where they are known, the truth and the measured pose; sigma of the chosen one beneath."""
    found = analysis.estimate
    rows, sigmas = [], ""
    for index, pose in enumerate(found.candidates):
        is_chosen = pose is found.selected
        if is_chosen:
            sigmas = row(f"± {POSE_NAMES[index]}, one sigma", sigma_cells(pose))
        rows.append(row(pose_name(index, is_chosen), result_cells(pose), bold=is_chosen))
    for name, known in (("Truth", analysis.view.truth), ("Measured", analysis.view.measured)):
        if known is not None:
            rows.append(row(name, result_cells(known)))
    if not rows:
        rows.append(wide_row("No pose to show.", len(COLUMNS) + 1))
    return table("candidates", COLUMNS, rows, EXPLANATION, sigmas)


class StatusPanel(Panel):
    """One line and a sentence, always shown."""

    def __init__(self, gui: viser.GuiApi, live: LivePage) -> None:
        self._live = live
        live.place(gui, "status")

    def show(self, analysis: Analysis) -> None:
        """Say what was found."""
        self._live.put_html("status", status_html(analysis))


class ResultPanel(Panel):
    """The table of both candidates."""

    def __init__(self, gui: viser.GuiApi, live: LivePage) -> None:
        self._live = live
        live.place(gui, "candidates")

    def show(self, analysis: Analysis) -> None:
        """Fill the table."""
        self._live.put_html("candidates", table_html(analysis))


class ViewpointPanel(Panel):
    """One button a viewpoint; each moves only the browser it was pressed in."""

    def __init__(self, gui: viser.GuiApi, scene: Scene3D) -> None:
        gui.add_html('<dockpose-name-next name="view-buttons"></dockpose-name-next>')
        buttons = gui.add_button_group(**read_toml("controls.toml")["picture"]["viewpoint"], options=NAMES)

        def look(client: viser.ClientHandle) -> None:
            if buttons.value in NAMES:
                scene.look_from(client, buttons.value)

        on_click(buttons, look)
