"""All results of one picture, a file each, and all of them in one ZIP file to take away."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Collection, Mapping
from pathlib import PurePosixPath, PureWindowsPath

from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.figures import to_pdf, to_svg
from dockpose.app.drawing.figures import to_png as figure_png
from dockpose.app.drawing.montage import montage
from dockpose.app.drawing.overlay import LAYERS
from dockpose.app.drawing.vector import picture_figure
from dockpose.app.export.data import result_line, settings_yaml, to_csv, to_json, to_png
from dockpose.app.export.plots import histogram_figure
from dockpose.app.export.report import picture_report
from dockpose.app.export.ros import pose_yaml
from dockpose.app.inputs.filenames import safe_name
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view

Files = dict[str, Callable[[], bytes]]


def bundle(
    analysis: Analysis, progress: Progress, *, with_montage: bool = True, layers: Collection[str] = LAYERS
) -> bytes:
    """Return a ZIP file of what was found, telling file by file; see :func:`picture_files`.

    Raises
    ------
    CancelledError
        if it was asked to stop.
    """
    files = picture_files(analysis, with_montage=with_montage, layers=layers, progress=progress.silent())
    return to_zip(files, progress)


def picture_files(
    analysis: Analysis,
    *,
    with_montage: bool = True,
    layers: Collection[str] = LAYERS,
    sha256: str | None = None,
    progress: Progress | None = None,
) -> Files:
    """What can be taken away of a picture: names of files, and what makes each.

    Parameters
    ----------
    analysis : what to write.
    with_montage : whether to try every method for a montage, which takes longest.
    layers : of the annotated picture.
    sha256 : of the picture's file, where there is one.
    progress : of the montage; where it is asked to stop, making that raises CancelledError.

    Returns
    -------
    picture.png (the very pixels), annotated.png, .svg and .pdf, histogram.png and .svg, result.json (schema 1) and
    .csv (a row), settings.yaml (camera, dock and settings), pose_ros.yaml where there is a pose, report.html, and
    montage.png.
    """
    view, found = analysis.view, analysis.estimate
    files: Files = {
        "annotated.png": lambda: to_png(annotate(view.image, found, layers=layers)),
        "annotated.svg": lambda: to_svg(picture_figure(view.image, found, layers), "annotated"),
        "annotated.pdf": lambda: to_pdf(picture_figure(view.image, found, layers)),
        "picture.png": lambda: to_png(view.image),
        "result.json": lambda: to_json(result_line(analysis, sha256)),
        "result.csv": lambda: to_csv([result_line(analysis, sha256)]),
        "settings.yaml": lambda: settings_yaml(analysis).encode(),
        "report.html": lambda: picture_report(analysis, sha256).encode(),
    }
    threshold = found.threshold
    if threshold is not None:
        files["histogram.png"] = lambda: figure_png(histogram_figure(threshold))
        files["histogram.svg"] = lambda: to_svg(histogram_figure(threshold), "histogram")
    if found.selected is not None:
        files["pose_ros.yaml"] = lambda: (pose_yaml(found) or "").encode()
    if with_montage:
        heard = progress or Progress(lambda share: None)
        files["montage.png"] = lambda: to_png(montage(view.image, compare_view(view, heard), view.known_pose))
    return files


def to_zip(files: Mapping[str, Callable[[], bytes]], progress: Progress | None = None) -> bytes:
    """Make every file and put them into one ZIP file. Raises CancelledError once asked to stop."""
    memory, items = io.BytesIO(), list(files.items())
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, make in items if progress is None else progress.over(items):
            archive.writestr(name, make())
    return memory.getvalue()


def bundle_name(source: str, ending: str = ".zip") -> str:
    """File name of what is taken away of a picture, whatever the picture is called and on whatever system."""
    last = PureWindowsPath(PurePosixPath(source).name).stem
    return f"dockpose_{safe_name(last, ending)}"
