"""Files that can be exported of a picture, a session or a sequence: their names and what makes each."""

import functools
import io
import zipfile
from collections.abc import Callable, Collection, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from dockpose import Camera, Dock, Settings
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
from dockpose.estimate import SCHEMA
from dockpose.files import FileError, read_small
from dockpose.thresholds import METHODS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Files = dict[str, Callable[[], bytes]]

_MOST_BYTES = 1_000_000_000  # of JSON lines: some 200,000 frames
# What a plot can show and a table can hold.
_Number = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
_Time = Annotated[float, msgspec.Meta(ge=-1e12, le=1e12)]
_Whole = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
_Chance = Annotated[float, msgspec.Meta(ge=0, le=1 + 1e-9)]


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


def sequence_files(path: Path, tell: Callable[[str], None]) -> Files:
    """Return report, table and plot of a file of JSON lines. Says and raises what :func:`read_lines` does."""
    lines = read_lines(path, tell)
    return {
        "report.html": lambda: report.sequence_report(path, lines).encode(),
        "results.csv": lambda: data.to_csv(lines),
        **figure_files("poses", lambda: report.sequence_figure(lines), "svg", "png"),
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


def read_lines(path: Path, tell: Callable[[str], None] = lambda text: None) -> list[dict[str, Any]]:
    """Read lines of schema 1 as ``estimate --json`` writes them; ``tell`` hears of a last one that is cut short."""
    content = read_small(path, _MOST_BYTES)
    pieces = content.splitlines()
    lines = []
    for number, piece in enumerate(pieces, start=1):
        if not piece.strip():
            continue
        try:
            line = msgspec.json.decode(piece)
            msgspec.convert(line, _Line)
        except (ValueError, RecursionError) as error:
            if number == len(pieces) > 1 and not content.endswith(b"\n"):
                tell(f"{path}: line {number}, the last, is cut short and left out")
                break
            raise FileError(f"{path}: line {number} does not follow schema {SCHEMA} ({error})") from error
        lines.append(line)
    if not lines:
        raise FileError(f"{path}: has no lines")
    return lines


def figure_files(name: str, make: "Callable[[], Figure]", *kinds: str) -> Files:
    """Return the files of a figure, one of each kind."""
    save = {"svg": functools.partial(figures.to_svg, name=name), "png": figures.to_png}
    return {f"{name}.{kind}": lambda to_bytes=save[kind]: to_bytes(make()) for kind in kinds}


class _Pose(msgspec.Struct, kw_only=True):
    position_m: tuple[_Number, _Number, _Number]
    theta_x_deg: _Number
    theta_y_deg: _Number
    sigma_position_m: tuple[_Number, _Number, _Number] | None = None
    sigma_theta_deg: tuple[_Number, _Number] | None = None


class _Candidate(_Pose, kw_only=True):
    probability: _Chance | None
    rms_px: _Number | None


class _Track(msgspec.Struct):
    probability: _Chance | None = None
    age: _Whole | None = None
    predicted: bool | None = None
    lost: bool | None = None
    number: _Whole | None = None


class _Threshold(msgspec.Struct):
    method: str
    level: _Whole
    groups: _Whole | None


class _Image(msgspec.Struct, forbid_unknown_fields=True):
    width: _Whole
    height: _Whole
    bits: _Whole


class _Marker(msgspec.Struct):
    on_ring: bool | None


class _Line(msgspec.Struct):
    """The fields of a line that reports and tables read."""

    schema: int
    source: str | None
    frame: _Whole | None
    time_s: _Time | None
    sha256: str | None
    status: str
    message: str
    threshold: _Threshold | None
    markers: list[_Marker]
    candidates: list[_Candidate]
    selected: int | None
    selected_by: str | None
    elapsed_ms: _Number | None
    track: _Track | None = None
    time_unix_s: _Time | None = None
    image: _Image | msgspec.UnsetType = msgspec.UNSET
    camera: Camera | msgspec.UnsetType = msgspec.UNSET
    dock: Dock | msgspec.UnsetType = msgspec.UNSET
    settings: Settings | msgspec.UnsetType = msgspec.UNSET
    chosen: _Pose | None = None
    predicted: _Pose | None = None
    filtered: _Pose | None = None
    found_by: str | None = None

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise ValueError(f"schema is {self.schema}; it must be {SCHEMA}")
        if self.selected is not None and not 0 <= self.selected < len(self.candidates):
            raise ValueError(f"selected is {self.selected}, of {len(self.candidates)} candidates")
