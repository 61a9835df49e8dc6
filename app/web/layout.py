"""Layout of the page: its panels in their tabs."""

from collections.abc import Iterator
from contextlib import contextmanager

import viser
from dockpose.app.web.html import help_link
from dockpose.app.web.live import Acts, LivePage, WishBox, wish_to
from dockpose.app.web.panels.calibration import CalibrationPanel
from dockpose.app.web.panels.camera import CameraPanel
from dockpose.app.web.panels.compare import ComparePanel
from dockpose.app.web.panels.detect import DetectPanel
from dockpose.app.web.panels.experiment.panel import ExperimentPanel
from dockpose.app.web.panels.export import ExportPanel
from dockpose.app.web.panels.picture import HtmlPanel, StripPanel, ViewpointPanel, status_html, table_html
from dockpose.app.web.panels.play.sequence import SequencePanel
from dockpose.app.web.panels.pose import PosePanel
from dockpose.app.web.panels.settings import SettingsPanel
from dockpose.app.web.panels.simulator import SimulatorPanel
from dockpose.app.web.panels.source import SourcePanel
from dockpose.app.web.panels.tank import BudgetPanel, ChipsPanel, TanksPanel
from dockpose.app.web.panels.view import PicturePanel
from dockpose.app.web.widgets import Act, Panel, Parts

PICTURE_WIDTH_PX, CONTROLS_WIDTH_PX = 560, 370


class Layout:
    """Builds the panels; ``panels`` lists them in the order in which they show a result, most urgent first."""

    def __init__(self, server: viser.ViserServer, parts: Parts) -> None:
        self.panels: list[Panel] = []
        self._add_pictures(server, parts)
        self._add_controls(server, parts)

    def close(self) -> None:
        """Stop the panels' work."""
        for panel in self.panels:
            panel.close()

    def _add_controls(self, server: viser.ViserServer, parts: Parts) -> None:
        gui, change = server.gui, parts.change
        tabs = gui.add_tab_group()

        @contextmanager
        def tab(title: str, section: str) -> Iterator[None]:
            """Add a tab that ends with a link to its section of the help."""
            with tabs.add_tab(title):
                yield
                gui.add_html(help_link(section), order=1e9)

        with tab("Pictures", "pictures"):
            source = SourcePanel(gui, parts)
        with tab("Tank", "tank"):
            tanks = TanksPanel(gui, parts)
            camera = CameraPanel(gui, self.live, change)
            calibration = CalibrationPanel(gui, parts)
            budget = BudgetPanel(gui)
        with tab("Detect", "detect"):
            detect = DetectPanel(gui, self.live, change)
            with gui.add_folder("Which of the two poses", expand_by_default=False):
                pose = PosePanel(gui, self.live, change)
                gui.add_html(help_link("pose"))
        with tab("Simulate", "simulate"):
            simulator = SimulatorPanel(gui, change)
        with tab("Play", "play"):
            self.sequence = SequencePanel(gui, self.live, parts)
        with tab("Log", "log"):
            self.experiment = ExperimentPanel(gui, parts)
        with tab("Export", "export"):
            self.export = ExportPanel(server, parts)
        acts: dict[str, Act] = {
            "undo": parts.undo,
            "redo": parts.redo,
            "next": lambda client: source.turn(1, client),
            "previous": lambda client: source.turn(-1, client),
            "play": lambda client: self.sequence.toggle(),
        }
        with tabs.add_tab("Settings"):
            self.settings = SettingsPanel(server, parts, acts)
        viewpoint = ViewpointPanel(gui, parts.scene)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        self.panels += [self.sequence, camera, detect, pose, self.live, source, simulator, tanks, budget, calibration]
        self.panels += [self.settings, self.experiment, self.export, viewpoint, self.chips, self.compare]

    def _add_pictures(self, server: viser.ViserServer, parts: Parts) -> None:
        gui = server.gui
        left = gui.add_panel()
        with left.add_tab("Picture and pose", viser.Icon.TARGET):
            self.live = live = LivePage(gui, server.flush)
            self.strip = StripPanel(gui, live, parts.tanks)
            status = HtmlPanel(gui, live, "status", status_html)
            self.chips = ChipsPanel(gui, parts.change)
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
                picture = PicturePanel(gui, live, parts.change, lambda: parts.sequence.is_playing)
            with shown.add_tab("Compare", viser.Icon.LAYOUT_GRID):
                self.compare = ComparePanel(gui, parts)
            result = HtmlPanel(gui, live, "candidates", table_html)
        self.panels = [picture, self.strip, status, result]
        left.dock_left()
        left.set_width(PICTURE_WIDTH_PX)
