"""``dockpose simulate``: a scene file in, pictures or a video with their truth out."""

import argparse
import contextlib
import csv
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock, estimate
from dockpose.app.commands.arguments import Commands, add_options
from dockpose.app.commands.console import EXIT_ALL_READ, TerminalBar, check_stopped, say
from dockpose.app.commands.output import LineFile
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.export.video import VideoFile, is_video_file
from dockpose.app.inputs.protected import Protected
from dockpose.app.state.scene import DEFAULT_SCENE
from dockpose.files.durable_files import remove
from dockpose.pose.circle import CirclePose
from dockpose.simulate import Approach, FilmPlan, Lights, RenderedFrame, film, load_sequence, save_sequence
from dockpose.simulate.files import TRUTH_COLUMNS, save_picture, truth_row
from dockpose.simulate.parts import Background
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TimeRemainingColumn

_STILL_RATE_HZ = 10.0
_FRAME_NAME = re.compile(r"frame_(\d+)\.(?:png|yaml)")
_TRUTH_HEAD = f"{','.join(TRUTH_COLUMNS)}\r\n".encode()

# LEDs as bright as they must be to be seen from 20 m.
_BRIGHT = {"lights": Lights(level=2e5), "background": Background(level=10.0, gradient_y=-6.0)}
DEFAULT = FilmPlan(scene=msgspec.structs.replace(DEFAULT_SCENE, **_BRIGHT), motion=Approach(frames=60))


def add_parser(commands: Commands) -> None:
    """Add the command ``simulate``."""
    parser = commands.add_parser("simulate", help="render pictures of a dock, with the truth beside them")
    add_options(parser, "simulate")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose simulate``; returns the exit status. What was written stays where it cannot go on."""
    out, sequence = arguments.out, _sequence(arguments.scene, arguments.seed, arguments.frames)
    _check_files(out, sequence.frames, arguments.protected)
    with writing(f"--out {out}"), _target(out, sequence) as target:
        for frame in _with_progress(film(sequence, _estimator(sequence.scene.dock)), sequence.frames):
            target.add(frame)
    pictures = "1 picture" if sequence.frames == 1 else f"{sequence.frames} pictures"
    say(f"{pictures} in {out}, the truth in {target.table}")
    return EXIT_ALL_READ


def _sequence(path: str | None, seed: int | None, frames: int | None) -> FilmPlan:
    with blaming("--scene "):
        sequence = DEFAULT if path is None else load_sequence(path)
    with blaming("--"):
        sequence = sequence if seed is None else sequence.with_seed(seed)
        return sequence if frames is None else sequence.with_frames(frames)


def _estimator(dock: Dock) -> Callable[[np.ndarray, Camera], CirclePose | None]:
    def observe(image: np.ndarray, camera: Camera) -> CirclePose | None:
        return estimate(image, camera, dock).selected

    return observe


def _with_progress(frames: Iterator[RenderedFrame], count: int) -> Iterator[RenderedFrame]:
    """Pass the pictures on, with a bar on standard error where a person sits before it."""
    console = Console(stderr=True)
    columns = ("simulate", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with TerminalBar(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        yield from progress.track(frames, total=count)


def _check_files(out: Path, frames: int, protected: Protected) -> None:
    """Raise UserError where a file would be replaced that is read, or that is of no earlier run."""
    if is_video_file(out):
        check_place(out, "--out")
        table, others = out.with_suffix(".csv"), [out, out.with_suffix(".yaml")]
    else:
        table, others = out / "truth.csv", [out / "scene.yaml"]
        there = sorted(out.iterdir()) if out.is_dir() else []
        numbered = {path: name for path in there if (name := _FRAME_NAME.fullmatch(path.name))}
        for path, name in numbered.items():
            if int(name[1]) > frames:
                raise UserError(f"--out {out}: holds {path.name} of a longer run; empty it, or choose another folder")
        others += numbered
    is_earlier = False
    if table.is_file():
        with table.open("rb") as file:
            is_earlier = file.read(len(_TRUTH_HEAD)) in (b"", _TRUTH_HEAD)
    for path in (table, *others):
        if path != out:
            protected.check(f"--out {out}: its {path.name}", path)
        if path.is_file() and not is_earlier:
            raise UserError(f"--out {out}: {path} is there already, of no earlier run; give another name, or rename it")


def _target(out: Path, sequence: FilmPlan) -> "_Folder | _Video":
    return _Video(out, sequence) if is_video_file(out) else _Folder(out, sequence)


class _Target:
    """Where pictures go; the table of their truth grows with each, so that an interrupted run leaves both."""

    def __init__(self, table: Path) -> None:
        self.table = table
        self._files = contextlib.ExitStack()

    def __enter__(self) -> Any:
        table = LineFile(str(self.table), f"--out {self.table}")
        self._files.callback(table.close)
        self._rows = csv.DictWriter(table, TRUTH_COLUMNS)
        self._rows.writeheader()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._files.close()

    def add(self, frame: RenderedFrame) -> None:
        """Write one picture, then its truth."""
        check_stopped()
        self._write(frame)
        self._rows.writerow(truth_row(frame))

    def _write(self, frame: RenderedFrame) -> None:
        raise NotImplementedError


class _Folder(_Target):
    """A folder of frame_0001.png, each with its scene and truth beside it, so that `dockpose estimate` reads it."""

    def __init__(self, folder: Path, sequence: FilmPlan) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        super().__init__(folder / "truth.csv")
        self._folder = folder
        save_sequence(sequence, folder / "scene.yaml")

    def _write(self, frame: RenderedFrame) -> None:
        save_picture(frame.image, frame.scene, frame.truth, self._folder, f"frame_{frame.number:04d}")


class _Video(_Target):
    """A video, and beside it NAME.csv with the truth and NAME.yaml with the scene, its camera and dock included."""

    def __init__(self, path: Path, sequence: FilmPlan) -> None:
        super().__init__(path.with_suffix(".csv"))
        self._path = path
        self._sequence = sequence
        camera, sensor = sequence.scene.camera, sequence.scene.sensor
        is_deep, is_colour = sensor.bits != 8, sensor.colour != "grey"
        if is_deep and (path.suffix.lower() == ".mp4" or is_colour):
            other = "a folder" if is_colour else "NAME.mkv or a folder"
            raise UserError(f"--out {path}: stores 8 bits, the scene's sensor has {sensor.bits}; use {other}")
        if path.suffix.lower() == ".mp4" and (camera.width % 2 or camera.height % 2):
            size = f"{camera.width} x {camera.height}"
            raise UserError(f"--out {path}: an MP4 needs an even width and height, the camera has {size} pixels")

    def __enter__(self) -> "_Video":
        super().__enter__()
        try:
            save_sequence(self._sequence, self._path.with_suffix(".yaml"))
        except BaseException:
            self.__exit__(None, None, None)
            raise
        motion = self._sequence.motion
        rate_hz = _STILL_RATE_HZ if motion is None else motion.rate_hz
        self._writer = self._files.enter_context(VideoFile(self._path, rate_hz, is_lossless=True))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            super().__exit__(kind, error, at)
        finally:
            if not self._path.exists():  # what belongs to it would only mislead
                remove(self.table)
                remove(self._path.with_suffix(".yaml"))

    def _write(self, frame: RenderedFrame) -> None:
        self._writer.write(frame.image, frame.time_s)
