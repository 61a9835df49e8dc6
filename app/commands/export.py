"""``dockpose export``: a picture, a session or a sequence in; tables, plots, reports and annotated pictures out."""

import argparse
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dockpose import Camera, Dock, Settings
from dockpose.app.commands.arguments import camera_of, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, put, say
from dockpose.app.drawing.annotated import DRAWN, LAYERS, check_layers
from dockpose.app.errors import UserError, blaming, check_folder, writing
from dockpose.app.experiment import read_session
from dockpose.app.experiment.record import is_session, lacks
from dockpose.app.export.data import to_json
from dockpose.app.inputs.pictures import Batch, camera_and_dock
from dockpose.app.inputs.protected import Protected
from dockpose.files import write_whole
from dockpose.labels import labels_of
from dockpose.sources.bags.storage import check_regular

if TYPE_CHECKING:
    from dockpose.app.export.bundle import Files

_LINES_ENDINGS = (".jsonl", ".ndjson", ".json")
KNOWN = {"layers": {"default": ",".join(DRAWN)}, "words": {"layers": ", ".join(LAYERS)}}


def run(arguments: argparse.Namespace) -> int:
    """Write what can be taken away of a source, and print which files that are; returns the exit status."""
    camera, dock, out = camera_of(arguments), dock_of(arguments), arguments.out
    chosen = [layer.strip() for layer in arguments.layers.split(",") if layer.strip()]
    with blaming("--"):
        check_layers(chosen)
    check_out(out)
    faults: list[str] = []
    files = _files(arguments.source, camera, dock, chosen, arguments.rotate, faults.append)
    for fault in faults:
        say(fault)
    write_out(files, out, arguments.protected)
    return EXIT_SOME_UNREADABLE if faults else EXIT_ALL_READ


def check_out(out: Path, option: str = "--out") -> None:
    """Raise UserError where nothing can be written to what ``--out`` names."""
    check_folder(out if not out.suffix or out.is_dir() else out.parent, f"{option} {out}")


def write_out(files: "Files", out: Path, protected: Protected, option: str = "--out") -> None:
    """Write all files into the folder or ZIP file that ``--out`` names, or the one of its ending."""
    from dockpose.app.export.bundle import to_zip  # what draws takes a while to import

    if not out.suffix or out.is_dir():
        for name in files:
            protected.check(f"{option} {out}: its {name}", out / name)
        with writing(f"{option} {out}"):
            out.mkdir(parents=True, exist_ok=True)
        for name, make in files.items():
            _write(out / name, make(), option)
    elif out.suffix.lower() == ".zip":
        _write(out, to_zip(files), option)
    else:
        name = next((name for name in files if Path(name).suffix == out.suffix.lower()), None)
        if name is None:
            endings = sorted({Path(name).suffix for name in files} | {".zip"})
            raise UserError(f"{option} {out}: of this source there is no {out.suffix}; there are {', '.join(endings)}")
        _write(out, files[name](), option)


def _files(
    source: Path,
    camera: Camera | None,
    dock: Dock | None,
    layers: Collection[str],
    rotate_deg: int,
    lack: Callable[[str], None],
) -> "Files":
    from dockpose.app.export.bundle import picture_files, sequence_files, session_files
    from dockpose.app.processing.analysis import analyse
    from dockpose.app.state.view import open_source

    if rotate_deg and (is_session(source) or source.suffix.lower() in _LINES_ENDINGS):
        raise UserError(f"--rotate {rotate_deg} is for a picture; {source} says itself how its pictures lie")
    if is_session(source):
        record = read_session(source)
        for text in lacks(record):
            lack(text)
        return session_files(record)
    if source.suffix.lower() in _LINES_ENDINGS:
        return sequence_files(source, lack)
    if source.is_dir():
        labels = to_json(_labels(source, camera, dock, rotate_deg, lack))
        return {"labels.json": lambda: labels}
    check_regular(str(source))
    if source.is_file():  # else it is reported when it is opened
        camera, dock = camera_and_dock(source, camera, dock)
    view = open_source(str(source), camera, dock, rotate_deg=rotate_deg)
    if view.note:
        say(view.note)
    if "truth" in layers and view.truth is None:
        lack(f"{source}: no truth is known of it, so that none is drawn")
    return picture_files(analyse(view), layers=layers, sha256=view.sha256)


def _labels(
    folder: Path, camera: Camera | None, dock: Dock | None, rotate_deg: int, lack: Callable[[str], None]
) -> dict[str, Any]:
    """The lights found in each picture of a folder, or set there by hand, as COCO's keypoints."""
    batch = Batch([str(folder)], camera, dock, lack, rotate_deg)
    found = batch.run(lambda picture: picture.estimate(Settings()))
    return labels_of((picture.path.name, one) for picture, one in found)


def _write(path: Path, content: bytes, option: str) -> None:
    with writing(f"{option} {path}"):
        write_whole(path, content)
    put(str(path))
