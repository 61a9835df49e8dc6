"""Undo and redo, settings files, dark mode, the help and the card of the first opening."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.preferences import Memory, settings_file, with_settings_file
from dockpose.app.web.html import help_anchor, help_link
from dockpose.app.web.server.pages import help_body
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.server.viser_private import Modal
from dockpose.app.web.widgets import Change, Panel, add_upload_button, loading, on_click, on_download, on_person

FIRST_CARD = (
    "You see a simulated dock: its lights were found, numbered, and an ellipse was laid through them.",
    "The table and the 3D scene show the two poses the dock may have; the chosen one is solid.",
    "Try it: move a slider in the tab <b>Simulate</b> or <b>Tank</b>, or drop a picture of your own on the page.",
)


@dataclass(frozen=True)
class Actions:
    """What the keys and the buttons do, each for the browser that asked."""

    undo: Callable[[viser.ClientHandle], None]
    redo: Callable[[viser.ClientHandle], None]
    turn: Callable[[int, viser.ClientHandle], None]
    play: Callable[[viser.ClientHandle], None]


class SettingsPanel(Panel):
    """Buttons, and the same in the command palette (Ctrl+K) with their keys."""

    def __init__(self, server: viser.ViserServer, change: Change, memory: Memory, actions: Actions) -> None:
        self._server, self._change, self._memory = server, change, memory
        self._cards: dict[int, Modal] = {}
        gui = server.gui
        self._area = gui.add_folder(None)
        with self._area:
            back = gui.add_button_group("Changes", ("Undo", "Redo"), hint="Keys: Ctrl+Z and Ctrl+Shift+Z.")
            self._dark = gui.add_checkbox(
                "Dark mode (D)", bool(memory.now.dark), hint="For dark rooms; all browsers change."
            )
            save = gui.add_button(
                "Save the settings", icon=viser.Icon.DOWNLOAD, hint="Camera, dock and how to search, as a YAML file."
            )
            gui.add_html(help_link("page"))
            help_button = gui.add_button("Help (H)", icon=viser.Icon.HELP, hint="All of it, in a window over the page.")
            card = gui.add_button("Show the first card", hint="The three sentences of the first opening.")
        on_click(back, lambda client: (actions.undo if back.value == "Undo" else actions.redo)(client))
        on_download(save, change, "settings.yaml", settings_file)
        on_click(help_button, self.show_help)
        on_click(card, self.show_first_card)
        on_person(self._dark.on_update, lambda client: self._set_dark(self._dark.value))
        self._add_commands(actions)
        _paint(server.gui, bool(memory.now.dark))

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to load settings, and the first card if it is still to be seen."""
        take = loading(self._change, with_settings_file)
        add_upload_button(self._area, client, uploads, take, "Load settings", "A file that was saved here.")
        if self._memory.now.shows_first_card:
            self.show_first_card(client)

    def show(self, analysis: Analysis) -> None:
        """Remember picture, settings and My tank for the next start."""
        self._memory.keep_picture(analysis.view)
        self._memory.change(settings=analysis.view.settings, tank=analysis.view.tank)

    def show_first_card(self, client: viser.ClientHandle) -> None:
        """Show the three sentences over the page of one browser."""
        sentences = "".join(f'<p style="margin: 0 0.75em 0.7em">{sentence}</p>' for sentence in FIRST_CARD)
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

    def _add_commands(self, actions: Actions) -> None:
        key, with_shift = "cmd/ctrl", "cmd/ctrl+shift"
        self._add_command("Undo", "The last change of a setting.", "Z", key, actions.undo)
        self._add_command("Redo", "What was undone last.", "Z", with_shift, actions.redo)
        self._add_command("Next picture", "In its list.", "N", None, lambda client: actions.turn(1, client))
        self._add_command("Previous picture", "In its list.", "P", None, lambda client: actions.turn(-1, client))
        self._add_command("Play or pause", "The sequence that is open.", "K", None, actions.play)
        self._add_command("Dark mode", "On or off.", "D", None, lambda client: self._set_dark(not self._dark.value))
        self._add_command("Help", "What the numbers mean.", "H", None, self.show_help)

    def _add_command(
        self,
        label: str,
        description: str,
        hotkey: Literal["Z", "N", "P", "K", "D", "H"],
        modifier: Literal["cmd/ctrl", "cmd/ctrl+shift"] | None,
        act: Callable[[viser.ClientHandle], None],
    ) -> None:
        command = self._server.gui.add_command(label, description=description, hotkey=hotkey, modifier=modifier)
        on_person(command.on_trigger, act)


def _paint(gui: viser.GuiApi, is_dark: bool) -> None:
    gui.configure_theme(dark_mode=is_dark, show_logo=False, show_share_button=False)
