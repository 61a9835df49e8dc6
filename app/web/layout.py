"""Layout of the page: its panels in their tabs."""

from collections.abc import Iterator
from contextlib import contextmanager

import viser
from dockpose.app.web.html import help_link
from dockpose.app.web.live import Acts, WishBox, wish_to
from dockpose.app.web.panels.calibration import CalibrationPanel
from dockpose.app.web.panels.compare import ComparePanel
from dockpose.app.web.panels.detect import DetectPanel, PosePanel
from dockpose.app.web.panels.experiment import ExperimentPanel
from dockpose.app.web.panels.export import ExportPanel
from dockpose.app.web.panels.picture import StripPanel, ViewpointPanel, status_html, table_html
from dockpose.app.web.panels.play import SequencePanel
from dockpose.app.web.panels.settings import SettingsPanel
from dockpose.app.web.panels.source import SimulatorPanel, SourcePanel
from dockpose.app.web.panels.tank import BudgetPanel, CameraPanel, ChipsPanel, TanksPanel
from dockpose.app.web.panels.view import PicturePanel
from dockpose.app.web.widgets import Act, App, Panel

PICTURE_WIDTH_PX, CONTROLS_WIDTH_PX = 560, 370


class Layout:
    """Builds the panels; ``panels`` lists them in the order in which they show a result, most urgent first."""

    def __init__(self, app: App) -> None:
        self._app = app
        self.panels: list[Panel] = []
        self._add_pictures(app.server.gui)
        self._add_controls(app.server.gui)

    def _add_controls(self, gui: viser.GuiApi) -> None:
        app, tabs = self._app, gui.add_tab_group()

        @contextmanager
        def tab(title: str, section: str) -> Iterator[None]:
            """Add a tab that ends with a link to its section of the help."""
            with tabs.add_tab(title):
                yield
                gui.add_html(help_link(section), order=1e9)

        with tab("Pictures", "pictures"):
            source = SourcePanel(app)
        with tab("Tank", "tank"):
            tank = TanksPanel(app), CameraPanel(app), CalibrationPanel(app), BudgetPanel(app)
        with tab("Detect", "detect"):
            detect = DetectPanel(app)
            with gui.add_folder("Which of the two poses", expand_by_default=False):
                pose = PosePanel(app)
                gui.add_html(help_link("pose"))
        with tab("Simulate", "simulate"):
            simulator = SimulatorPanel(app)
        with tab("Play", "play"):
            self.sequence = SequencePanel(app)
        with tab("Log", "log"):
            self.experiment = ExperimentPanel(app)
        with tab("Export", "export"):
            self.export = ExportPanel(app)
        acts: dict[str, Act] = {
            "undo": lambda client: app.change(app.history.undo, client, reload=True),
            "redo": lambda client: app.change(app.history.redo, client, reload=True),
            "next": lambda client: source.turn(1, client),
            "previous": lambda client: source.turn(-1, client),
            "play": lambda client: self.sequence.toggle(),
        }
        with tabs.add_tab("Settings"):
            self.settings = SettingsPanel(app, acts)
        viewpoint = ViewpointPanel(app)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        self.panels += [self.sequence, detect, pose, app.live, source, simulator, *tank]
        self.panels += [self.settings, self.experiment, self.export, viewpoint, self.chips, self.compare]

    def _add_pictures(self, gui: viser.GuiApi) -> None:
        app, left = self._app, gui.add_panel()
        with left.add_tab("Picture and pose", viser.Icon.TARGET):
            app.live.begin(app)
            self.strip = StripPanel(app)
            app.live.place("status", status_html)
            self.chips = ChipsPanel(app)
            wished: Acts = {
                wish_to("take"): lambda wish, client: self.experiment.take(client),
                wish_to("zip"): lambda wish, client: self.export.save_all(client),
                wish_to("compare"): lambda wish, client: self.compare.compare(),
                wish_to("use", method=str): lambda wish, client: self.compare.use(wish.method, client),
                wish_to("play"): lambda wish, client: self.sequence.toggle(),
                wish_to("goto", frame=int): lambda wish, client: self.sequence.go_to(wish.frame),
                wish_to("speed", speed=str): lambda wish, client: self.sequence.set_speed(wish.speed),
            }
            wishes = WishBox(gui, "Done on the page", wished)
            gui.add_html(f'<dockpose-jobs channel="{wishes.channel}"></dockpose-jobs>')
            shown = gui.add_tab_group()
            with shown.add_tab("Picture", viser.Icon.SCAN_EYE):
                self.panels.append(PicturePanel(app))
            with shown.add_tab("Compare", viser.Icon.LAYOUT_GRID):
                self.compare = ComparePanel(app)
            app.live.place("candidates", table_html)
        left.dock_left()
        left.set_width(PICTURE_WIDTH_PX)
