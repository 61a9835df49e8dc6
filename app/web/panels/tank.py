"""The tab Tank: the saved tanks, camera and dock, the error budget; and chips for what rules the next picture too."""

from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

from dockpose import Camera, Dock
from dockpose.app.export.words import HEAD, TILTS_DEG, budget_cells, budget_sentences, usual_ranges_m
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state import camera as optics
from dockpose.app.state.camera import with_tank, with_these_as_mine
from dockpose.app.state.changes import Chip, chips, dropped_sentence
from dockpose.app.state.parameters import DISTORTION, DOCK, LENS, PORT, put
from dockpose.app.state.tank import tank_words
from dockpose.app.state.values import VALUES
from dockpose.app.state.view import View
from dockpose.app.web.choices import Client, on_person
from dockpose.app.web.html import row, small, table
from dockpose.app.web.page import Page
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Panel, offer
from dockpose.camera.files import FORMATS
from dockpose.camera.formats.words import ENDINGS
from dockpose.study.budget import budget
from msgspec.structs import replace as changed


def with_focal(view: View, name: str, value: Any, *, both: bool) -> View:
    """Set fx or fy in pixels, or both in the ratio that the camera was given with."""
    if not both:
        return put(view, name, value)
    moved = put(view, name, value).camera
    ratio = view.given_fx_per_fy
    camera = changed(moved, fy=moved.fx / ratio) if name == "fx" else changed(moved, fx=moved.fy * ratio)
    return replace(view, camera=camera)


class CameraPanel(Panel):
    """What everything hangs on, in sight whichever tab is open; the rest of lens, port and dock in a tab."""

    table = "camera"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        putters = {"fx": partial(self._with_focal, "fx"), "lights": self._with_lights}
        main = {name: one for name, one in (LENS | DOCK).items() if name != "fy"}
        self.gui.add_html(f'<dockpose-name-next name="main-number" count="{len(main)}"></dockpose-name-next>')
        self.add_sliders(main, putters)

    def fill_tab(self) -> None:
        """Add the rest to the tab that is being made; camera files are loaded and saved there."""
        area = self.gui.add_folder("Camera")
        with area:
            sees = optics.field_of_view_sentence
            self.app.live.place("field-of-view", lambda analysis: small(escape(sees(analysis.view.camera))), order=2)
            self._lock = self.add("checkbox", "lock", self.changing(self._with_lock), order=3)
            self.add_sliders({"fy": LENS["fy"]}, {"fy": partial(self._with_focal, "fy")}, order=3.1)
            with self.gui.add_folder("Lens distortion", expand_by_default=False, order=4):
                self.add_sliders(DISTORTION)
            self.add_value("dropdown", "tone", order=2.5)
            with self.gui.add_folder("Port and water", expand_by_default=False, order=5):
                self.add_value("checkbox", "port")
                self.add_sliders(PORT)
            kind = self.add("dropdown", "format", options=FORMATS)
            self.add_download("save", "camera.yaml", lambda view: optics.camera_file(view.camera, kind.value))
            self.add_download("save_dock", "dock.yaml", lambda view: optics.dock_file(view.dock))
        self.add_upload(area, "load", self.changing_by_file(optics.with_camera_file), ",".join(ENDINGS))
        with self.gui.add_folder("Lights uneven or behind the ring", expand_by_default=False):
            self._angles, self._extra = self._add_line("angles"), self._add_line("extra")
        self.values += [(self._angles, VALUES["angles"]), (self._extra, VALUES["extra"])]

    def _add_line(self, name: str) -> Any:
        """A box whose text is taken over with Enter; a form of several would need a button for that."""
        with self.gui.add_form(None) as line:
            box = self.add("text", name)
        on_person(line.on_submit, self.changing(lambda view: VALUES[name].put(view, box.value)))
        return box

    def _with_lights(self, view: View, value: Any) -> View:
        changed = put(view, "lights", value)
        lost = dropped_sentence(view.dock, changed.dock)
        if lost:
            self.app.notify("Please check the lights", lost, "yellow", None)
        self._angles.value = VALUES["angles"].get(changed)
        return changed

    def _with_focal(self, name: str, view: View, value: Any) -> View:
        changed = with_focal(view, name, value, both=bool(self._lock.value))
        if self._lock.value:
            for one in ("fx", "fy"):
                if one != name:
                    self.sliders[one].load(changed)
        return changed

    def _with_lock(self, view: View) -> View:
        return with_focal(view, "fx", view.camera.fx, both=True) if self._lock.value else view


NOT_SAVED = "(not saved)"
_MOST_CHIPS = 8


class ChipsPanel(Panel):
    """What static/jobs.js shows as chips; a press comes back as a request that names its chip."""

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._chips: dict[str, Chip] = {}

    def show(self, analysis: Analysis) -> None:
        """Show the chips."""
        found = chips(analysis.view, analysis.fitting_lights, has_pose=analysis.estimate.selected is not None)
        self._chips = {chip.label: chip for chip in found[:_MOST_CHIPS]}
        self.app.live.put(chips=[[chip.label, chip.hint, chip.opens] for chip in self._chips.values()])

    def press(self, asked: Any, client: Client) -> None:
        """Do what a chip says, if it is still there."""
        if (chip := self._chips.get(asked.label)) is not None:
            self.change(chip.press, client, reload=True)


class BudgetPanel(Panel):
    """Which errors to expect of the camera and the dock in force, by range and tilt."""

    table = "tank"

    def __init__(self, app: Page) -> None:
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

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._tanks = app.tanks
        with self.gui.add_folder("My tank"):
            self._choice = self.add("dropdown", "choice", self._choose, options=(NOT_SAVED, *self._tanks.names()))
            self._name = self.add("text", "name")
            self._take = self.add("button", "take", self.changing(with_these_as_mine))
            self._forget = self.add("button", "forget", self.changing(self._forgotten))

    def welcome(self, client: Client, uploads: ClientUploads) -> None:
        """Tell a new browser where the saved tanks cannot be read."""
        if self._tanks.trouble:
            self.app.notify("About the saved tanks", self._tanks.trouble, "yellow", client)

    def load(self, view: View) -> None:
        """Show which saved tank is My tank, and what can be done with it."""
        if view.tank.name in self._tanks.names():
            self._name.value = view.tank.name
        self._offer(view)

    def show(self, analysis: Analysis) -> None:
        """Offer what fits the picture that is shown."""
        self._offer(analysis.view)

    def _offer(self, view: View) -> None:
        names, tank = self._tanks.names(), view.tank
        offer(self._choice, (NOT_SAVED, *names), tank.name if self._tanks.is_saved(tank) else NOT_SAVED)
        self._forget.visible = tank.name in names
        self._take.visible = "picture" in (view.camera_of, view.dock_of)

    def _choose(self, client: Client) -> None:
        name = str(self._choice.value)
        if name != NOT_SAVED:
            self.change(lambda view: with_tank(view, self._tanks.get(name)), client, reload=True)

    def enter(self, asked: Any, client: Client) -> None:
        """Save My tank under the name that was typed."""
        self.change(partial(self._saved, asked.name), client, reload=True)

    def _saved(self, name: str, view: View) -> View:
        tank = self._tanks.save(view.tank, name)
        self.app.notify("Saved", tank_words(tank), "green", None)
        return with_tank(view, tank)

    def _forgotten(self, view: View) -> View:
        self._tanks.forget(view.tank.name)
        return with_tank(view, changed(view.tank, name=""))
