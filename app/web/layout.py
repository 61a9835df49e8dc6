"""Where everything is on the page: its panels, in their tabs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import viser
from dockpose.app.experiment.folder import SessionFolder
from dockpose.app.inputs.checksums import Checksums
from dockpose.app.inputs.folder import Shelf
from dockpose.app.state.preferences import Memory
from dockpose.app.web.notifications import Notify
from dockpose.app.web.panels.camera import CameraPanel
from dockpose.app.web.panels.compare import ComparePanel
from dockpose.app.web.panels.detect import DetectPanel
from dockpose.app.web.panels.experiment.panel import ExperimentPanel
from dockpose.app.web.panels.export import ExportPanel
from dockpose.app.web.panels.masks import MasksPanel
from dockpose.app.web.panels.picture import PicturePanel
from dockpose.app.web.panels.pose import PosePanel
from dockpose.app.web.panels.result import ResultPanel, StatusPanel
from dockpose.app.web.panels.sequence import SequencePanel
from dockpose.app.web.panels.settings import Actions, HabitsPanel, help_link
from dockpose.app.web.panels.simulator import SimulatorPanel
from dockpose.app.web.panels.source import SourcePanel
from dockpose.app.web.panels.viewpoint import ViewpointPanel
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.sequence import SequenceController
from dockpose.app.web.widgets import Change, Panel, Uploader

PICTURE_WIDTH_PX, CONTROLS_WIDTH_PX = 560, 370


@dataclass(frozen=True)
class Parts:
    """What the panels work with.

    Attributes
    ----------
    change : applies a function to the view.
    fail : tells of an error that nobody expected.
    undo, redo : for the browser that asked.
    shelf : the uploaded pictures.
    root : the folder on this machine that may be shown; None for none.
    memory : the settings that outlast the program.
    sequence : plays sequences.
    scene : draws in 3D.
    notify : shows a notification.
    sessions : the folder of experiments.
    """

    change: Change
    fail: Callable[[Exception], None]
    undo: Callable[[viser.ClientHandle], None]
    redo: Callable[[viser.ClientHandle], None]
    shelf: Shelf
    root: Path | None
    memory: Memory
    sequence: SequenceController
    scene: Scene3D
    notify: Notify
    sessions: SessionFolder


class Layout:
    """Builds all panels.

    Attributes
    ----------
    panels : all of them, in the order in which they are to show a result: first what people wait for.
    uploaders : those that take files.
    picture, sequence, habits : those that are asked for more than that.
    """

    def __init__(self, server: viser.ViserServer, parts: Parts) -> None:
        self.panels: list[Panel] = []
        self.uploaders: list[Uploader] = []
        self._add_controls(server, parts)
        self._add_pictures(server, parts)

    def close(self) -> None:
        """Stop whatever the panels are working on."""
        self._compare.close()
        self._experiment.close()
        self._export.close()

    def _add_controls(self, server: viser.ViserServer, parts: Parts) -> None:
        gui, change = server.gui, parts.change
        tabs = gui.add_tab_group()
        with tabs.add_tab("Source"):
            source = SourcePanel(gui, change, parts.shelf, parts.root)
            simulator = SimulatorPanel(gui, change)
            gui.add_html(help_link("source"), order=1e9)
        with tabs.add_tab("Camera & dock"):
            camera = CameraPanel(gui, change)
            gui.add_html(help_link("camera"), order=1e9)
        with tabs.add_tab("Detect"):
            detect, masks = DetectPanel(gui, change), MasksPanel(gui, change)
            gui.add_html(help_link("detect"), order=1e9)
        with tabs.add_tab("Pose"):
            pose = PosePanel(gui, change)
            gui.add_html(help_link("pose"), order=1e9)
        with tabs.add_tab("Sequence"):
            self.sequence = SequencePanel(gui, parts.sequence)
            gui.add_html(help_link("sequence"), order=1e9)
        checksums = Checksums(parts.shelf, parts.root)
        with tabs.add_tab("Experiment"):
            self._experiment = ExperimentPanel(gui, parts.sessions, checksums, parts.notify, parts.fail)
            gui.add_html(help_link("experiment"), order=1e9)
        with tabs.add_tab("Export"):
            self._export = ExportPanel(server, parts.notify, parts.fail, checksums)
            gui.add_html(help_link("export"), order=1e9)
        actions = Actions(parts.undo, parts.redo, source.turn, lambda client: self.sequence.toggle())
        with tabs.add_tab("Settings"):
            self.habits = HabitsPanel(server, change, parts.memory, actions)
        viewpoint = ViewpointPanel(gui, parts.scene)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        self.panels += [source, simulator, camera, detect, masks, pose, self.sequence, self.habits]
        self.panels += [self._experiment, self._export, viewpoint]
        self.uploaders += [source, simulator, camera, self.sequence, self.habits]

    def _add_pictures(self, server: viser.ViserServer, parts: Parts) -> None:
        gui = server.gui
        left = gui.add_panel()
        with left.add_tab("Picture and pose", viser.Icon.TARGET):
            status, self.picture = StatusPanel(gui), PicturePanel(gui, server.flush)
            result = ResultPanel(gui)
        with self.picture.compare_tab:
            self._compare = ComparePanel(gui, parts.change, parts.fail)
        self.panels.insert(0, self.picture)
        self.panels += [status, result, self._compare]
        left.dock_left()
        left.set_width(PICTURE_WIDTH_PX)
