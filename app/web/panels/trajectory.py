"""In the tab Log: results, or the session that is open, beside a trajectory that another system has measured."""

import base64
import shutil
import tempfile
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dockpose.app.errors import UserError
from dockpose.app.export.bundle import to_zip
from dockpose.app.export.data import to_png
from dockpose.app.inputs.received import safe_name
from dockpose.app.processing.background import Progress
from dockpose.app.state.view import with_upload
from dockpose.app.web.choices import Client
from dockpose.app.web.html import row, small, table
from dockpose.app.web.page import Page
from dockpose.app.web.widgets import Panel
from dockpose.sources import Kind, kind_of

if TYPE_CHECKING:
    from dockpose.app.export.truth.report import Compared
    from dockpose.app.export.truth.results import Results
    from dockpose.truth import TrajectoryComparison

_SHOWN = ("errors", "space")
_OURS = (b"{", b"source,frame,")  # how results begin


class TrajectoryPanel(Panel):
    """A button for both files, what was found, plots, the worst frames to look at, and the report."""

    table = "trajectory"

    def __init__(self, app: Page, session: Callable[[], Path | None]) -> None:
        super().__init__(app)
        self._session, self._folder = session, Path(tempfile.mkdtemp(prefix="dockpose-"))
        app.closing.callback(shutil.rmtree, self._folder, ignore_errors=True)
        self._results: tuple[str, Results] | None = None
        self._compared: Compared | None = None
        area = self.gui.add_folder(None)
        self._told = self.gui.add_html("")
        self.add_upload(area, "files", self._take, ".jsonl,.json,.csv,.tsv,.txt,.tum,.mcap,.bag,.db3", waits=True)

    def _take(self, data: bytes, name: str, client: Client) -> None:
        path = self._folder / safe_name(name)
        path.write_bytes(data)

        def work(progress: Progress) -> None:
            # These load SciPy, for which the first page would wait.
            from dockpose.app.export.truth.results import read_results
            from dockpose.truth import compare_trajectory, read_trajectory

            if data.startswith(_OURS) or (kind_of(str(path)) is Kind.BAG and b"/dock/pose_a" in data):
                self._results = name, read_results(path)
                self._told.content = small(f"<p>{escape(name)} is here; now the trajectory.</p>")
                return
            folder, body = self._session(), Path(name).stem.partition("#")[2]
            if self._results is None and folder is None:
                raise UserError("There are no results yet: open a session, or send JSON lines, CSV or MCAP first.")
            called, results = self._results or (folder.name if folder else "", read_results(folder or path))
            truth = read_trajectory(f"{path}#{body}" if body else path)
            self._show_found(called, results, compare_trajectory(results.track, truth), name)

        self.app.work.start(work, client)

    def _show_found(self, called: str, results: "Results", found: "TrajectoryComparison", truth: str) -> None:
        from dockpose.app.export.truth.report import Compared  # what draws takes a while to import

        compared = Compared(called, truth, results, found)
        told = "".join(f"<p>{escape(sentence)}</p>" for sentence in compared.told)
        head, *bands = compared.table("rms")
        rows = [row(escape(name), [*map(escape, cells)]) for name, *cells in bands]
        content = small(told, 'id="truth"') + table("truth-rms", head[1:], rows, "Root mean square errors.")
        for name in _SHOWN:
            data = base64.b64encode(compared.files()[f"{name}.png"]()).decode()
            content += f'<img alt="{name}" style="width: 100%" src="data:image/png;base64,{data}">'
        asked = {"save": "Save the comparison"}
        for one in compared.report["worst_frames"]:
            asked[str(one["row"])] = f"Look at {one['time_s']:.3f} s, {100 * one['distance_m']:.2f} cm off"
        buttons = (f'<button type="button" data-truth="{what}">{words}</button> ' for what, words in asked.items())
        self._told.content, self._compared = f"{content}{small(''.join(buttons))}", compared

    def ask(self, asked: Any, client: Client) -> None:
        """Save the report, or show the frame of a row: in its film, if that is open, or as a picture by itself."""
        self.app.attempt(lambda: self._do(asked.what, client), client)

    def _do(self, what: str, client: Client) -> None:
        if (compared := self._compared) is None:
            return
        if what == "save":
            self.app.work.save(client, "compared.zip", lambda progress: to_zip(compared.files(), progress))
        elif what.isdecimal() and int(what) < len(compared.results.track.times_s):
            (source, frame), film = compared.results.films[int(what)], self.app.opened
            if film and self.app.player and frame is not None and Path(film.name).name == source:
                self.app.player.go_to(frame)
                return
            image, _ = compared.results.whole(int(what))
            self.change(lambda view: with_upload(view, to_png(image), f"frame_{what}.png"), client, reload=True)
