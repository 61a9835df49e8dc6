"""Rectangles of the picture that are not looked at, as a date burnt into it."""

from __future__ import annotations

from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.detection import mask_labels, with_mask, without_mask, without_masks
from dockpose.app.state.view import View
from dockpose.app.web.widgets import Change

NO_MASK = "(no mask)"


class MasksPanel:
    """Four numbers that make a mask, and a list to remove masks from."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        with gui.add_folder("Masks: parts not looked at", expand_by_default=False):
            self._corner = gui.add_vector2(
                "Left, top (px)",
                (0.0, 0.0),
                min=(0.0, 0.0),
                step=1.0,
                hint="Upper left corner of the rectangle to hide, from the picture's upper left corner.",
            )
            self._size = gui.add_vector2(
                "Width, height (px)",
                (100.0, 40.0),
                min=(1.0, 1.0),
                step=1.0,
                hint="Size of the rectangle to hide, as a date or a logo burnt into the picture.",
            )
            add = gui.add_button("Add this mask", icon=viser.Icon.PLUS, hint="Hide the rectangle given above.")
            self._which: viser.GuiDropdownHandle[str] = gui.add_dropdown(
                "Mask", [str(NO_MASK)], hint="The mask that the button below removes."
            )
            remove = gui.add_button("Remove this mask", icon=viser.Icon.MINUS, hint="Look at that part again.")
            clear = gui.add_button("Remove all masks", icon=viser.Icon.ERASER, hint="Look at the whole picture again.")

        @add.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                change(self._with_mask, event.client, reload=True)

        @remove.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                change(lambda view: without_mask(view, self._which.value), event.client, reload=True)

        @clear.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                change(without_masks, event.client, reload=True)

    def load(self, view: View) -> None:
        """List the masks."""
        labels = tuple(mask_labels(view.settings.masks)) or (NO_MASK,)
        if labels != self._which.options:
            self._which.options = labels
            self._which.value = labels[-1]

    def show(self, analysis: Analysis) -> None:
        """The pictures show what is masked."""

    def _with_mask(self, view: View) -> View:
        return with_mask(view, *self._corner.value, *self._size.value)
