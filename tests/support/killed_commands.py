"""Commands of the program that are killed while they work, and the check of the files that they leave."""

import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

import cv2
import dockpose.app.export.bundle
import dockpose.app.export.parts as reproduction
import dockpose.app.export.study.report  # noqa: F401
import dockpose.app.processing.study as study
import mcap.writer  # noqa: F401
import numpy as np
import rosbags.typesys  # noqa: F401  # what commands import when they need it is to be there before they begin
from dockpose.app.cli import main
from dockpose.app.experiment import Session
from dockpose.app.export.parts import Plot
from dockpose.camera.files import save_camera
from dockpose.sidecar import sample_source
from dockpose.simulate import Approach, FilmPlan, render, save_sequence

from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures
from tests.support.docks import uneven
from tests.support.forked import forked
from tests.support.left_files import faults, files_of
from tests.support.scenes import CAMERA, random_scene
from tests.support.taking import FOUND, PICTURE

PER_FOLDER = 10  # kills, after which the command is let end, and nothing of the killed ones may be left over
_TO_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_CHANGES = ("os.rename", "os.remove", "os.mkdir", "os.truncate")
FILM_FRAMES = 6


@dataclass(frozen=True)
class Command:
    """A command that writes: its words, where IN is the folder of inputs, and which outputs grow."""

    name: str
    words: str
    grows: tuple[str, ...] = ()  # names of the files that grow
    is_once: bool = False  # it refuses to write where files are already


_FILM = "estimate IN/film.mkv"
_KNOWN = "--camera IN/camera.yaml --dock-diameter 0.3 --lights 10"
COMMANDS = (
    Command(
        "estimate pictures", "estimate IN/pictures --json a.jsonl --csv a.csv --annotate out", ("a.jsonl", "a.csv")
    ),
    Command("estimate --smooth", f"{_FILM} --smooth --json a.jsonl --csv a.csv", ("a.jsonl", "a.csv")),
    Command("estimate --annotate .mp4", f"{_FILM} --json a.jsonl --annotate a.mp4", ("a.jsonl", "a.mp4")),
    Command("estimate --annotate .mkv", f"{_FILM} --json a.jsonl --annotate a.mkv", ("a.jsonl", "a.mkv")),
    Command("estimate --annotate .avi", f"{_FILM} --json a.jsonl --annotate a.avi", ("a.jsonl", "a.avi")),
    Command("estimate --out .mcap", f"{_FILM} --json a.jsonl --out a.mcap", ("a.jsonl", "a.mcap")),
    Command("estimate a bag", "estimate IN/bag.mcap --csv a.csv --out b.mcap " + _KNOWN, ("a.csv", "b.mcap")),
    Command(
        "estimate --record",
        f"estimate STREAM {_KNOWN} --json a.jsonl --record a.mkv --log-file a.log",
        ("a.jsonl", "a.mkv", "a.log"),
        is_once=True,
    ),
    Command("compare", "compare IN/pictures --json a.jsonl --montage out", ("a.jsonl",)),
    Command("simulate a folder", "simulate --scene IN/scene.yaml --out sim", ("sim/truth.csv",)),
    Command("simulate .mp4", "simulate --scene IN/scene.yaml --out a.mp4", ("a.mp4", "a.csv")),
    Command("simulate .mkv", "simulate --scene IN/scene.yaml --out a.mkv", ("a.mkv", "a.csv")),
    Command("export a picture", "export IN/pictures/plain.png --out out"),
    Command("export a session", "export IN/session --out a.zip"),
    Command("export lines", "export IN/lines.jsonl --out out"),
    Command("calibrate", "calibrate IN/boards --board 10x7 --square 0.024 --lens k1 --out camera.yaml"),
    Command("learn-dock", "learn-dock IN/dock --camera IN/air.yaml --dock-diameter 0.3 --lights 10 --out dock.yaml"),
    Command("budget", f"budget {_KNOWN} --ranges 1,2 --draws 5 --csv a.csv", ("a.csv",)),
    Command("study", "study --scenes 2 --seed 1 --jobs 1 --out study"),
    Command("reproduce", "reproduce --only table_3 --only figure_16 --jobs 1 --out out"),
)


_SMALL = (cv2.imencode(".png", np.zeros((40, 40), np.uint8))[1].tobytes(), b"<svg xmlns='http://www.w3.org/2000/svg'/>")


class _Here(Executor):
    """Does all work at once, in this process: it is what writes files that is killed here, not the workers."""

    def submit(self, fn, /, *args, **kwargs):
        future: Future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@contextmanager
def _here(jobs: int, scheduler: str | None) -> Iterator[tuple[Executor, int]]:
    yield _Here(), 1


def run(words: list[str], folder: str, deadly: int, connection: Connection) -> None:
    """Run a command in a folder; before its change of a file with the number ``deadly`` the process kills itself.

    Sends when it begins, and at its end its exit status, how many changes it made, and how long it took.
    """
    os.chdir(folder)
    os.environ["TMPDIR"] = tempfile.tempdir = str(Path(folder).parent / "temporary")
    with open(Path(folder).parent / "said.txt", "wb") as said:
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
    for name in ("camera.yaml", "dock.yaml"):  # which no command overwrites
        Path(name).unlink(missing_ok=True)
    changes = 0

    def count(event: str, arguments: tuple) -> None:
        nonlocal changes
        if event in _CHANGES or (event == "open" and isinstance(arguments[2], int) and arguments[2] & _TO_WRITE):
            if changes == deadly:
                os.kill(os.getpid(), signal.SIGKILL)
            changes += 1

    reproduction.workers = study.workers = _here
    # Drawing takes seconds in which nothing is written, so that all plots are a small one here.
    setattr(Plot, "of", lambda name, caption, figure, **more: Plot(name, caption, *_SMALL, **more))  # noqa: B010
    connection.send(0)
    began_s = time.perf_counter()
    sys.addaudithook(count)
    status = main(words)
    connection.send((status, changes, time.perf_counter() - began_s))


@dataclass
class Kills:
    """What came of killing a command: counts, and what was wrong, in words."""

    kills: int = 0
    ended: int = 0  # before they were killed
    while_writing: int = 0  # temporary files that a kill left, which the next run must clean up
    faults: list[str] = field(default_factory=list)


class Killer:
    """Kills commands in folders of their own under ``folder``, where inputs are made first."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._rng = folder, np.random.default_rng(seed)
        self.stream = ""  # address of what STREAM stands for
        self._inputs = make_inputs(folder / "inputs")
        self._context = forked()

    def kill(self, command: Command, kills: int) -> Kills:
        """Kill a command, half of the times at any moment, half before a file is opened, renamed or removed."""
        words = command.words.replace("IN/", f"{self._inputs}/").replace("STREAM", self.stream).split()
        told, base = Kills(), self._folder / command.name.replace(" ", "_").replace("/", "_")
        whole = self._made(base / "whole")
        # The first compiles what is left to compile; of a study the second goes on with what is done, and changes less.
        twice = [self._to_end(words, whole, told, is_endless=command.is_once) for _ in range(2)]
        changes, lasts_s = (max(both) for both in zip(*twice, strict=True))
        expected = {path.relative_to(whole) for path in whole.rglob("*") if path.is_file()}
        folder = whole
        for number in range(kills):
            if number % PER_FOLDER == 0 or command.is_once:
                folder = self._made(base / f"{number:04d}")
            self._one(words, folder, changes, lasts_s, number, told)
            told.kills += 1
            told.while_writing += any(folder.rglob("*.part"))
            told.faults += [f"kill {number}: {fault}" for fault in faults(folder, command.grows)]
            odd = {path.relative_to(folder) for path in files_of(folder)} - expected
            told.faults += [f"kill {number}: {path}: is not of the command" for path in odd]
            if not command.is_once and number % PER_FOLDER in (PER_FOLDER - 1, kills - 1):
                self._to_end(words, folder, told)
                there = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
                told.faults += [f"after kill {number}: {path}: is left over" for path in there - expected]
                told.faults += [f"after kill {number}: {path}: is missing" for path in expected - there]
                told.faults += [f"after kill {number}: {fault}" for fault in faults(folder, ())]
        return told

    def _made(self, folder: Path) -> Path:
        folder.mkdir(parents=True)
        (folder.parent / "temporary").mkdir(exist_ok=True)
        return folder

    def _one(self, words: list[str], folder: Path, changes: int, lasts_s: float, number: int, told: Kills) -> None:
        deadly = -1 if number % 2 == 0 else int(self._rng.integers(0, changes))
        program, ours = self._begin(words, folder, deadly)
        if deadly < 0:
            ours.poll(self._rng.uniform(0, lasts_s))
            program.kill()
        program.join(2 * lasts_s + 1)
        program.kill()  # what has no end, as a stream, may not come to the change that was to be deadly
        program.join()
        told.ended += program.exitcode != -signal.SIGKILL
        ours.close()

    def _to_end(self, words: list[str], folder: Path, told: Kills, is_endless: bool = False) -> tuple[int, float]:
        """Let a command end; returns how many changes it made and how long it took."""
        if is_endless:
            folder = self._made(folder.with_name(f"{folder.name}{time.monotonic_ns()}"))
            program, ours = self._begin(words, folder, -1)
            time.sleep(1.5)
            program.terminate()
            program.join(30)
            for path in folder.iterdir():
                path.replace(folder.with_name("whole") / path.name)
            return 5, 1.0
        program, ours = self._begin(words, folder, -1)
        status, changes, lasts_s = ours.recv() if ours.poll(120) else (None, 1, 1.0)
        program.kill()
        program.join()
        if status != 0:
            said = (folder.parent / "said.txt").read_text(errors="replace")[-500:]
            told.faults.append(f"ends with {status}: {said}")
        return changes, lasts_s

    def _begin(self, words: list[str], folder: Path, deadly: int):
        ours, theirs = self._context.Pipe(duplex=False)
        program = self._context.Process(target=run, args=(words, str(folder), deadly, theirs), daemon=False)
        program.start()
        theirs.close()
        assert ours.recv() == 0
        return program, ours


def make_inputs(folder: Path) -> Path:
    """Small inputs of every kind, in a folder that is made."""
    for name in ("pictures", "boards", "dock"):
        (folder / name).mkdir(parents=True)
    for name in ("plain", "turbid"):
        for ending in (".png", ".yaml"):
            shutil.copy(Path(sample_source(name)).with_suffix(ending), folder / "pictures")
    for name, picture in pictures(CHESSBOARD, TRUE, 5):
        cv2.imwrite(str(folder / "boards" / name), picture)
    camera = CAMERA.for_size(320, 240)
    save_camera(camera, folder / "camera.yaml")
    save_camera(CAMERA, folder / "air.yaml")
    for number in range(12):  # lights off their places tell which light is which
        cv2.imwrite(str(folder / "dock" / f"{number}.png"), render(random_scene(number, dock=uneven(0)))[0])
    scene = random_scene(4, camera=camera, position_m=(0.05, 0.0, 1.0))
    motion = Approach(frames=FILM_FRAMES, start_m=1.2, end_m=0.8, rate_hz=20, drift_m=0.02)
    save_sequence(FilmPlan(scene=scene, motion=motion), folder / "scene.yaml")
    film = str(folder / "film.mkv")
    assert main(["simulate", "--scene", str(folder / "scene.yaml"), "--out", film]) == 0
    assert main(["estimate", film, "--json", str(folder / "lines.jsonl"), "--out", str(folder / "bag.mcap")]) == 0
    with Session.create(folder / "session") as session:
        for _ in range(2):
            session.take(PICTURE, FOUND, "tank", notes="as measured")
    return folder
