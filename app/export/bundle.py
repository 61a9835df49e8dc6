"""Files that can be exported of a picture or a session: their names and what makes each."""

import functools
import io
import zipfile
from collections.abc import Callable, Collection, Mapping
from pathlib import PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Any

from dockpose.app.drawing import figures
from dockpose.app.drawing.annotated import DRAWN, annotate
from dockpose.app.drawing.figures import picture_figure
from dockpose.app.experiment import SessionRecord
from dockpose.app.export import data, report
from dockpose.app.inputs.received import safe_name
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare
from dockpose.app.state.trust import headline_of
from dockpose.app.state.view import View
from dockpose.camera import mark
from dockpose.thresholds import METHODS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Files = dict[str, Callable[[], bytes]]


def picture_files(analysis: Analysis, *, layers: Collection[str] = DRAWN, sha256: str | None = None) -> Files:
    """Return the files of one picture."""
    view, found = analysis.view, analysis.estimate
    drawn: dict[str, Any] = {"layers": layers, "truth": view.truth}
    files: Files = {
        "annotated.png": lambda: mark.to_png(
            annotate(view.image, analysis.shown, headline=headline_of(analysis.trust), **drawn)
        ),
        **figure_files("annotated", lambda: picture_figure(view.image, analysis.shown, **drawn), "svg"),
        **figure_files("methods", lambda: _methods_figure(view), "png"),
        "picture.png": lambda: data.to_png(view.image),
        "result.json": lambda: data.to_json(data.result_line(analysis, sha256)),
        "result.csv": lambda: data.to_csv([data.result_line(analysis, sha256)]),
        "settings.yaml": lambda: data.settings_yaml(analysis).encode(),
        "report.html": lambda: report.picture_report(analysis, sha256).encode(),
    }
    threshold = found.threshold
    if threshold is not None:
        files |= figure_files("histogram", lambda: report.histogram_figure(threshold), "png", "svg")
    return files


def _methods_figure(view: View) -> "Figure":
    """The picture and what each method keeps of it, as the paper's Figure 15."""
    from dockpose.app.export.plots import methods_beside, side_by_side  # what draws takes a while to import

    found = compare(view.image, view.camera, view.dock, view.settings)
    names = {name: METHODS[name].label for name in found}
    return side_by_side(methods_beside(view.source, view.image, found, names), 5)


def session_files(record: SessionRecord) -> Files:
    """Return report, tables and plots of a session, without its frames."""
    return {
        "report.html": lambda: report.session_report(record).encode(),
        "table.csv": lambda: data.csv_table(record.rows).encode(),
        "table.tex": lambda: data.latex_table(record.rows).encode(),
        **figure_files("errors", lambda: report.error_figure(record.rows), "svg", "png"),
    }


def to_zip(files: Mapping[str, Callable[[], bytes]], progress: Progress | None = None) -> bytes:
    """Make every file and put them into one ZIP file. Raises CancelledError once asked to stop."""
    memory, items = io.BytesIO(), list(files.items())
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, make in items if progress is None else progress.over(items):
            archive.writestr(name, make())
    return memory.getvalue()


def bundle_name(source: str, ending: str = ".zip") -> str:
    """Return a file name after a source, valid on every system."""
    last = PureWindowsPath(PurePosixPath(source).name).stem
    return f"dockpose_{safe_name(last, ending)}"


def figure_files(name: str, make: "Callable[[], Figure]", *kinds: str) -> Files:
    """Return the files of a figure, one of each kind."""
    save = {"svg": functools.partial(figures.to_svg, name=name), "png": figures.to_png}
    return {f"{name}.{kind}": lambda to_bytes=save[kind]: to_bytes(make()) for kind in kinds}
