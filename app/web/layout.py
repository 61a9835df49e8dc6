"""Layout of the page: its panels in their tabs."""

from functools import partial
from typing import Any, TypeVar

import viser
from dockpose.app.state.parameters import with_given_number
from dockpose.app.web.choices import Act
from dockpose.app.web.html import help_link
from dockpose.app.web.live import Acts, RequestBox, request_to
from dockpose.app.web.page import Page
from dockpose.app.web.panels.calibration import CalibrationPanel
from dockpose.app.web.panels.compare import ComparePanel
from dockpose.app.web.panels.detect import DetectPanel, PosePanel
from dockpose.app.web.panels.experiment import ExperimentPanel
from dockpose.app.web.panels.export import ExportPanel
from dockpose.app.web.panels.guidance import GuidancePanel
from dockpose.app.web.panels.picture import StripPanel, ViewpointPanel, table_html
from dockpose.app.web.panels.play import SequencePanel
from dockpose.app.web.panels.settings import STEPS_HTML, SettingsPanel
from dockpose.app.web.panels.source import SimulatorPanel, SourcePanel
from dockpose.app.web.panels.tank import BudgetPanel, CameraPanel, ChipsPanel, TanksPanel
from dockpose.app.web.panels.trajectory import TrajectoryPanel
from dockpose.app.web.panels.view import PicturePanel
from dockpose.app.web.widgets import Panel, take_number

# The tabs beside the picture, the first of them open, and their panels from above; each ends with a link to its part
# of the help.
TABS: dict[str, tuple[type[Panel], ...]] = {
    "Tank": (TanksPanel, BudgetPanel),
    "Source": (SourcePanel, SequencePanel, GuidancePanel, SimulatorPanel),
    "Detect": (DetectPanel, PosePanel),
    "Export": (ExportPanel,),
}
# What lies over each other at the left, in tabs of its own, the picture first.
OVER = {"Picture": PicturePanel, "Compare": ComparePanel, "Log": ExperimentPanel, "Calibrate": CalibrationPanel}
# Which panels show a result before its data are sent, the most urgent first; all others after.
FIRST = GuidancePanel, PicturePanel, SequencePanel, ChipsPanel, DetectPanel, PosePanel
Kind = TypeVar("Kind", bound=Panel)


class Layout:
    """Builds the panels; ``panels`` lists them in the order in which they show a result."""

    def __init__(self, app: Page) -> None:
        self._made: dict[type[Panel], Any] = {}
        self._add_pictures(app, app.server.gui)
        self._add_controls(app, app.server.gui)
        self.panels: list[Panel] = [self._made[kind] for kind in dict.fromkeys((*FIRST, *self._made))]
        self.until_sent = len(FIRST)
        self._requests.heed(self._acts(app))

    def of(self, kind: type[Kind]) -> Kind:
        """The panel of a class."""
        return self._made[kind]

    def _acts(self, app: Page) -> Acts:
        """What is done for the requests of our own elements."""
        log, compare, play, exports = map(
            self._made.__getitem__, (ExperimentPanel, ComparePanel, SequencePanel, ExportPanel)
        )
        boxes: dict[str, Any] = {"boxes": dict[str, str]}
        return {
            request_to("take", **boxes): log.take_typed,
            request_to("typed", **boxes): log.typed,
            request_to("board", name=str): self.of(CalibrationPanel).toggle,
            request_to("truth", what=str): self.of(TrajectoryPanel).ask,
            request_to("chip", label=str): self.of(ChipsPanel).press,
            request_to("layers", of=list[str]): exports.follow,
            request_to("given", label=str): lambda asked, client: app.change(
                partial(with_given_number, label=asked.label), client, reload=True
            ),
            request_to("number", of=str, text=str): partial(take_number, app),
            request_to("together", names=list[str]): self.of(SourcePanel).expect,
            request_to("session", name=str): log.enter,
            request_to("tank", name=str): self.of(TanksPanel).enter,
            request_to("moved"): lambda asked, client: app.history.end_move(),
            request_to("zip"): exports.save_all,
            request_to("compare"): compare.compare,
            request_to("use", method=str): compare.use,
            request_to("play"): lambda asked, client: play.toggle(client),
            request_to("goto", frame=int): lambda asked, client: play.go_to(asked.frame),
            request_to("speed", speed=str): lambda asked, client: play.set_speed(asked.speed),
        }

    def _add_controls(self, app: Page, gui: viser.GuiApi) -> None:
        app.live.place("candidates", table_html)
        camera = self._made[CameraPanel] = CameraPanel(app)
        tabs = gui.add_tab_group()
        for title, kinds in TABS.items():
            with tabs.add_tab(title):
                if title == "Tank":
                    camera.fill_tab()
                self._made |= {kind: kind(app) for kind in kinds}
                gui.add_html(help_link(title.lower()), order=1e9)
        acts: dict[str, Act] = {
            "undo": lambda client: app.go_back(app.history.undo, "Undone", client),
            "redo": lambda client: app.go_back(app.history.redo, "Done again", client),
            "next": lambda client: self.of(SourcePanel).turn(1, client),
            "previous": lambda client: self.of(SourcePanel).turn(-1, client),
            "play": lambda client: self.of(SequencePanel).toggle(client),
        }
        with tabs.add_tab("Settings"):
            self._made[SettingsPanel] = SettingsPanel(app, acts)
        self._made[ViewpointPanel] = ViewpointPanel(app)
        gui.main_panel.dock_right()

    def _add_pictures(self, app: Page, gui: viser.GuiApi) -> None:
        left = gui.add_panel()
        with left.add_tab("Picture and pose", viser.Icon.TARGET):
            app.live.begin()
            self._made[StripPanel] = StripPanel(app)
            self._made[ChipsPanel] = ChipsPanel(app)
            self._requests = RequestBox(gui, "Done on the page")
            gui.add_html(f'<dockpose-jobs channel="{self._requests.channel}"></dockpose-jobs>')
            gui.add_html(STEPS_HTML)
            shown = gui.add_tab_group()
            for title, kind in OVER.items():
                with shown.add_tab(title):
                    self._made[kind] = kind(app)
                    if kind is ExperimentPanel:
                        session = lambda: self.of(ExperimentPanel).folder  # noqa: E731
                        self._made[TrajectoryPanel] = TrajectoryPanel(app, session)
        left.dock_left()
