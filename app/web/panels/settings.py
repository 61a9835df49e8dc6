"""Undo and redo, settings files, dark mode and the steps of a first visit."""

import json
from collections.abc import Mapping
from html import escape

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state.preferences import with_settings_file
from dockpose.app.web.choices import Act, Client, on_person
from dockpose.app.web.html import help_link, small
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel

_SOFTWARE = "This browser has no graphics card to draw with: the 3D view turns slowly, and rests while frames play."
_STEPS_AGAIN = '<div class="steps-again"><button type="button" data-steps-again>Show the first steps</button></div>'

_STEPS = escape(json.dumps(read_toml("controls.toml")["settings"]["steps"]))
STEPS_HTML = f'<dockpose-steps steps="{_STEPS}"></dockpose-steps>'  # until a browser has skipped or done them


class SettingsPanel(Panel):
    """Buttons, and the same in the command palette (Ctrl+K) with their keys; ``acts`` are those of other panels."""

    table = "settings"

    def __init__(self, app: Page, acts: Mapping[str, Act]) -> None:
        super().__init__(app)
        self._memory = app.memory
        area = self.gui.add_folder(None)
        with area:
            back = self.add("button_group", "back", lambda client: acts[back.value.lower()](client))
            dark, set_dark = bool(self._memory.now.dark), self._set_dark
            self._dark = self.add("checkbox", "dark", lambda client: set_dark(self._dark.value), initial_value=dark)
            self.gui.add_html(help_link("page"))
            self.gui.add_html(_STEPS_AGAIN)
            self.gui.add_html(small(_SOFTWARE, 'class="software"'))
        self.add_upload(area, "load", self.changing_by_file(with_settings_file))
        own: dict[str, Act] = {"dark": lambda client: self._set_dark(not self._dark.value)}
        for name, act in {**acts, **own}.items():
            on_person(self.gui.add_command(**self.said["commands"][name]).on_trigger, act)
        if self._memory.now.dark is not None:  # else each browser has its own, which what all are sent could follow
            _paint(self.gui, self._memory.now.dark)

    def show(self, analysis: Analysis) -> None:
        """Remember picture, settings and My tank for the next start."""
        self._memory.keep_picture(analysis.view)
        self._memory.change(settings=analysis.view.settings, tank=analysis.view.tank)

    def follow(self, client: Client, is_dark: bool) -> None:
        """Give one browser the colours of its system, unless somebody chose them here."""
        if self._memory.now.dark is None:
            _paint(client.gui, is_dark)

    def _set_dark(self, is_dark: bool) -> None:
        self._memory.change(dark=bool(is_dark))
        _paint(self.gui, bool(is_dark))
        self._dark.value = bool(is_dark)


def _paint(gui: viser.GuiApi, is_dark: bool) -> None:
    gui.configure_theme(dark_mode=is_dark, show_logo=False, show_share_button=False)
