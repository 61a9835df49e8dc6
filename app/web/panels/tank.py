"""Buttons for what rules the next picture too, the saved tanks, and the error budget of camera and dock."""

from functools import partial
from html import escape
from itertools import zip_longest

import viser
from dockpose import Camera, Dock
from dockpose.app.export.budget import HEAD, TILTS_DEG, budget_cells, budget_sentences, usual_ranges_m
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.chips import Chip, chips
from dockpose.app.state.in_force import with_tank, with_these_as_mine
from dockpose.app.state.tank import tank_words
from dockpose.app.state.view import View
from dockpose.app.web.html import row, small, table
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import App, Panel, offer, on_person
from dockpose.study.budget import budget
from msgspec.structs import replace as changed

NOT_SAVED = "(not saved)"
_MOST_CHIPS = 8


class ChipsPanel(Panel):
    """A button for each chip."""

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._buttons = [self.gui.add_button("", visible=False, color="gray") for _ in range(_MOST_CHIPS)]
        self._chips: list[Chip] = []
        for index, button in enumerate(self._buttons):
            on_person(button.on_click, partial(self._press, index))

    def show(self, analysis: Analysis) -> None:
        """Show the chips."""
        self._chips = chips(analysis.view, analysis.fitting_lights)[:_MOST_CHIPS]
        for button, chip in zip_longest(self._buttons, self._chips):
            if chip is not None:
                button.label, button.hint = chip.label, chip.hint
            button.visible = chip is not None

    def _press(self, index: int, client: viser.ClientHandle) -> None:
        if index < len(self._chips):
            self.change(self._chips[index].press, client, reload=True)


class BudgetPanel(Panel):
    """Which errors to expect of the camera and the dock in force, by range and tilt."""

    table = "tank"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._shown: tuple[Camera, Dock] | None = None
        with self.gui.add_folder("Error budget", expand_by_default=False):
            self.add("button", "budget", lambda client: self._fill())
            self._table = self.gui.add_html("")

    def show(self, analysis: Analysis) -> None:
        """Say that a table of another camera or dock is no longer true."""
        self.analysis = analysis
        if self._shown is not None and self._shown != (analysis.view.camera, analysis.view.dock):
            self._shown = None
            self._table.content = small("The camera or the dock has changed: press again.")

    def _fill(self) -> None:
        if self.analysis is None:
            return
        self._shown = camera, dock = self.analysis.view.camera, self.analysis.view.dock
        try:
            ranges_m = usual_ranges_m(camera, dock)
            rows = [budget_cells(budget(camera, dock, near, tilt)) for near in ranges_m for tilt in TILTS_DEG]
            words = budget_sentences(camera, dock)
        except ValueError as error:
            self._table.content = small(f"No budget: {escape(str(error))}.")
            return
        # Range and tilt name a row; the page has no room for more columns than these.
        lines = [row(f"{cells[0]} m, {cells[1]}°", cells[3:]) for cells in rows]
        self._table.content = table("budget", HEAD[3:], lines, escape(" ".join(words)))


class TanksPanel(Panel):
    """Save My tank under a name, bring a saved one back, or take over what is in force."""

    table = "tank"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._tanks = app.tanks
        with self.gui.add_folder("My tank"):
            self._choice = self.add("dropdown", "choice", self._choose, options=(NOT_SAVED, *self._tanks.names()))
            self._name = self.add("text", "name")
            self.add("button", "save", self.changing(self._saved))
            saved_one = self.changing(lambda view: with_tank(view, self._tanks.get(view.tank.name)))
            self._back = self.add("button", "back", saved_one)
            self._take = self.add("button", "take", self.changing(with_these_as_mine))
            self._forget = self.add("button", "forget", self.changing(self._forgotten))

    def welcome(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Tell a new browser where the saved tanks cannot be read."""
        if self._tanks.trouble:
            self.app.notify("About the saved tanks", self._tanks.trouble, "yellow", client)

    def load(self, view: View) -> None:
        """Show which saved tank is My tank, and what can be done with it."""
        names = self._tanks.names()
        is_known = view.tank.name in names
        offer(self._choice, (NOT_SAVED, *names), view.tank.name if is_known else NOT_SAVED)
        if is_known:
            self._name.value = view.tank.name
        self._show_buttons(view)

    def show(self, analysis: Analysis) -> None:
        """Offer what fits the picture that is shown."""
        self._show_buttons(analysis.view)

    def _show_buttons(self, view: View) -> None:
        is_known = view.tank.name in self._tanks.names()
        self._back.visible = is_known and not self._tanks.is_saved(view.tank)
        self._forget.visible = is_known
        self._take.visible = "picture" in (view.camera_of, view.dock_of)

    def _choose(self, client: viser.ClientHandle) -> None:
        name = str(self._choice.value)
        if name != NOT_SAVED:
            self.change(lambda view: with_tank(view, self._tanks.get(name)), client, reload=True)

    def _saved(self, view: View) -> View:
        tank = self._tanks.save(view.tank, str(self._name.value))
        self.app.notify("Saved", tank_words(tank), "green", None)
        return with_tank(view, tank)

    def _forgotten(self, view: View) -> View:
        self._tanks.forget(view.tank.name)
        return with_tank(view, changed(view.tank, name=""))
