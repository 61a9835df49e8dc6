"""Undo and redo, settings files, dark mode, the help and the card of the first opening."""

from collections.abc import Mapping

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.preferences import settings_file, with_settings_file
from dockpose.app.web.html import help_anchor, help_link
from dockpose.app.web.server.pages import help_body
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.server.viser_private import Modal
from dockpose.app.web.widgets import Act, App, Client, Panel, on_person


class SettingsPanel(Panel):
    """Buttons, and the same in the command palette (Ctrl+K) with their keys; ``acts`` are those of other panels."""

    table = "settings"

    def __init__(self, app: App, acts: Mapping[str, Act]) -> None:
        super().__init__(app)
        self._memory = app.memory
        self._cards: dict[int, Modal] = {}
        area = self.gui.add_folder(None)
        with area:
            back = self.add("button_group", "back", lambda client: acts[back.value.lower()](client))
            dark, set_dark = bool(self._memory.now.dark), self._set_dark
            self._dark = self.add("checkbox", "dark", lambda client: set_dark(self._dark.value), initial_value=dark)
            self.add_download("save", "settings.yaml", settings_file)
            self.gui.add_html(help_link("page"))
            self.add("button", "help", self.show_help)
            self.add("button", "card", self.show_first_card)
        self.add_upload(area, "load", self.changing_by_file(with_settings_file))
        own: dict[str, Act] = {"dark": lambda client: self._set_dark(not self._dark.value), "help": self.show_help}
        for name, act in {**acts, **own}.items():
            on_person(self.gui.add_command(**self.said["commands"][name]).on_trigger, act)
        if self._memory.now.dark is not None:  # else each browser has its own, which what all are sent could follow
            _paint(self.gui, self._memory.now.dark)

    def welcome(self, client: Client, uploads: ClientUploads) -> None:
        """Show the first card, too, if it is still to be seen."""
        super().welcome(client, uploads)
        if self._memory.now.shows_first_card:
            self.show_first_card(client)

    def show(self, analysis: Analysis) -> None:
        """Remember picture, settings and My tank for the next start."""
        self._memory.keep_picture(analysis.view)
        self._memory.change(settings=analysis.view.settings, tank=analysis.view.tank)

    def show_first_card(self, client: Client) -> None:
        """Show the three sentences over the page of one browser."""
        sentences = "".join(f'<p style="margin: 0 0.75em 0.7em">{sentence}</p>' for sentence in self.said["first_card"])
        self._show_card(client, "Welcome to dockpose", sentences, "Start")

    def show_help(self, client: Client) -> None:
        """Show the help over the page of one browser."""
        link = help_anchor("Open it in a tab of its own")
        self._show_card(
            client, "Help", f'<div style="padding: 0 0.75em">{link}{help_body()}</div>', "Close", is_long=True
        )

    def forget(self, client: Client) -> None:
        """Forget the card of a browser that left."""
        self._cards.pop(client.client_id, None)

    def _show_card(self, client: Client, title: str, html: str, words: str, *, is_long: bool = False) -> None:
        self._close_card(client)
        card = client.gui.add_modal(title)
        self._cards[client.client_id] = card
        with card:
            button = client.gui.add_button(words, order=0 if is_long else 2)
            client.gui.add_html(html, order=1)
        on_person(button.on_click, self._dismiss)

    def _dismiss(self, client: Client) -> None:
        self._close_card(client)
        self._memory.change(shows_first_card=False)

    def _close_card(self, client: Client) -> None:
        card = self._cards.pop(client.client_id, None)
        if card is not None:
            card.close()

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
