"""Undo and redo, settings files, dark mode, the help and the card of the first opening."""

from collections.abc import Mapping

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state.preferences import settings_file, with_settings_file
from dockpose.app.web.html import help_anchor, help_link
from dockpose.app.web.server.pages import help_body
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.server.viser_private import Modal
from dockpose.app.web.widgets import Act, Panel, Parts, add_upload_button, loading, on_click, on_download, on_person

_SAID = read_toml("controls.toml")["settings"]


class SettingsPanel(Panel):
    """Buttons, and the same in the command palette (Ctrl+K) with their keys; ``acts`` are those of other panels."""

    def __init__(self, server: viser.ViserServer, parts: Parts, acts: Mapping[str, Act]) -> None:
        self._server, self._change, self._memory = server, parts.change, parts.memory
        self._cards: dict[int, Modal] = {}
        gui = server.gui
        self._area = gui.add_folder(None)
        with self._area:
            back = gui.add_button_group(**_SAID["back"])
            self._dark = gui.add_checkbox(**_SAID["dark"], initial_value=bool(self._memory.now.dark))
            save = gui.add_button(**_SAID["save"])
            gui.add_html(help_link("page"))
            help_button, card = gui.add_button(**_SAID["help"]), gui.add_button(**_SAID["card"])
        on_click(back, lambda client: acts[back.value.lower()](client))
        on_download(save, self._change, "settings.yaml", settings_file)
        on_click(help_button, self.show_help)
        on_click(card, self.show_first_card)
        on_person(self._dark.on_update, lambda client: self._set_dark(self._dark.value))
        own = {"dark": lambda client: self._set_dark(not self._dark.value), "help": self.show_help}
        for name, act in {**acts, **own}.items():
            on_person(gui.add_command(**_SAID["commands"][name]).on_trigger, act)
        if self._memory.now.dark is not None:  # else each browser has its own, which what all are sent could follow
            _paint(server.gui, self._memory.now.dark)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to load settings, and the first card if it is still to be seen."""
        add_upload_button(self._area, client, uploads, loading(self._change, with_settings_file), **_SAID["load"])
        if self._memory.now.shows_first_card:
            self.show_first_card(client)

    def show(self, analysis: Analysis) -> None:
        """Remember picture, settings and My tank for the next start."""
        self._memory.keep_picture(analysis.view)
        self._memory.change(settings=analysis.view.settings, tank=analysis.view.tank)

    def show_first_card(self, client: viser.ClientHandle) -> None:
        """Show the three sentences over the page of one browser."""
        sentences = "".join(f'<p style="margin: 0 0.75em 0.7em">{sentence}</p>' for sentence in _SAID["first_card"])
        self._show_card(client, "Welcome to dockpose", sentences, "Start")

    def show_help(self, client: viser.ClientHandle) -> None:
        """Show the help over the page of one browser."""
        link = help_anchor("Open it in a tab of its own")
        self._show_card(
            client, "Help", f'<div style="padding: 0 0.75em">{link}{help_body()}</div>', "Close", is_long=True
        )

    def forget(self, client: viser.ClientHandle) -> None:
        """Forget the card of a browser that left."""
        self._cards.pop(client.client_id, None)

    def _show_card(
        self, client: viser.ClientHandle, title: str, html: str, words: str, *, is_long: bool = False
    ) -> None:
        self._close_card(client)
        card = client.gui.add_modal(title)
        self._cards[client.client_id] = card
        with card:
            button = client.gui.add_button(words, order=0 if is_long else 2)
            client.gui.add_html(html, order=1)
        on_click(button, self._dismiss)

    def _dismiss(self, client: viser.ClientHandle) -> None:
        self._close_card(client)
        self._memory.change(shows_first_card=False)

    def _close_card(self, client: viser.ClientHandle) -> None:
        card = self._cards.pop(client.client_id, None)
        if card is not None:
            card.close()

    def follow(self, client: viser.ClientHandle, is_dark: bool) -> None:
        """Give one browser the colours of its system, unless somebody chose them here."""
        if self._memory.now.dark is None:
            _paint(client.gui, is_dark)

    def _set_dark(self, is_dark: bool) -> None:
        self._memory.change(dark=bool(is_dark))
        _paint(self._server.gui, bool(is_dark))
        self._dark.value = bool(is_dark)


def _paint(gui: viser.GuiApi, is_dark: bool) -> None:
    gui.configure_theme(dark_mode=is_dark, show_logo=False, show_share_button=False)
