"""No output takes the place of an input, of another output, or of what is read-only."""

import errno
import os
import shutil
import sys
from pathlib import Path

import pytest
from dockpose.app import cli
from dockpose.app.cli import main
from dockpose.app.inputs.pictures import save_dock
from dockpose.camera.files import save_camera
from dockpose.sidecar import sample_path, sample_source
from dockpose.simulate import Approach, FilmPlan
from dockpose.simulate.files import TRUTH_COLUMNS, save_sequence

from tests.support.scenes import CAMERA, random_scene

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links need rights there, and folders have no such mode")
_BOARD = "--board 10x7 --square 0.024"
_KNOWN = "--camera cam.yaml --dock-diameter 0.3 --lights 10"
# Command, the option with its value that the sentence names, and what speaks against it.
REFUSED = [
    ("estimate tilted.png --json tilted.png", "--json tilted.png", "input tilted.png"),
    ("estimate tilted.png --json link.png", "--json link.png", "input tilted.png"),
    ("estimate tilted.png --csv hard.png", "--csv hard.png", "input tilted.png"),
    ("estimate tilted.png --json tilted.yaml", "--json tilted.yaml", "input tilted.yaml"),
    ("estimate [t]ilted.png --csv tilted.png", "--csv tilted.png", "input tilted.png"),
    ("estimate boards --csv boards/a.png", "--csv boards/a.png", "input boards/a.png"),
    ("estimate tilted.png --log-file tilted.png", "--log-file tilted.png", "input tilted.png"),
    ("estimate film.mkv --annotate here/film.mkv", "--annotate here/film.mkv", "input film.mkv"),
    ("estimate bag --out bag/0.mcap", "--out bag/0.mcap", "input bag/0.mcap"),
    ("estimate tilted.png --camera cam.yaml --csv cam.yaml", "--csv cam.yaml", "input cam.yaml"),
    ("estimate tilted.png --dock dock.yaml --json dock.yaml", "--json dock.yaml", "input dock.yaml"),
    ("estimate --session session --log-file session/results.csv", "--log-file session/results.csv", "results.csv"),
    ("estimate tilted.png --json a --csv here/a", "--csv here/a", "what --json writes"),
    ("estimate tilted.png --json dangling --csv a", "--csv a", "what --json writes"),
    ("estimate tilted.png --json - --csv /dev/stdout", "--csv /dev/stdout", "what --json writes"),
    ("estimate tank.sdp --json tank.sdp", "--json tank.sdp", "input tank.sdp"),
    ("estimate 0 --record new.mkv --annotate ./new.mkv", "--record new.mkv", "what --annotate writes"),
    ("compare tilted.png --json new --log-file new", "--log-file new", "what --json writes"),
    ("export tilted.png --camera cam.yaml --out cam.yaml", "--out cam.yaml", "input cam.yaml"),
    ("export session --out session/results.csv", "--out session/results.csv", "input session/results.csv"),
    ("export picture.png --out .", "--out .: its picture.png", "input picture.png"),
    ("simulate --scene s.yaml --out s.mp4", "--out s.mp4: its s.yaml", "input s.yaml"),
    ("simulate --scene sim/scene.yaml --out sim", "--out sim: its scene.yaml", "input sim/scene.yaml"),
    ("simulate --out s.mkv", "--out s.mkv: s.yaml", "of no earlier run"),
    ("simulate --out taken", "--out taken: taken/frame_0001.png", "of no earlier run"),
    (f"calibrate boards {_BOARD} --out boards/a.png", "--out boards/a.png", "input boards/a.png"),
    (f"calibrate boards {_BOARD} --out cam.yaml", "--out cam.yaml", "is there already and is not overwritten"),
    (f"calibrate boards {_BOARD} --in water --camera cam.yaml --out ./cam.yaml", "--out cam.yaml", "input cam.yaml"),
    ("learn-dock film.mkv --out film.mkv", "--out film.mkv", "input film.mkv"),
    ("learn-dock film.mkv", "--out dock.yaml", "is there already and is not overwritten"),
    ("check session --out session/results.csv", "--out session/results.csv", "input session/results.csv"),
    ("check session --out dock.yaml", "--out dock.yaml", "is there already and is not overwritten"),
    ("check session --out-camera session/results.csv", "--out-camera session/results.csv", "input session/results.csv"),
    ("check session --out new --out-camera new", "--out-camera new", "is what --out writes too"),
    (f"budget {_KNOWN} --csv cam.yaml", "--csv cam.yaml", "input cam.yaml"),
    ("study --scenes 1 --seed 1 --out new --log-file new", "--log-file new", "what --out writes"),
    ("reproduce --out new --log-file new", "--log-file new", "what --out writes"),
    ("serve tilted.png --log-file tilted.png", "--log-file tilted.png", "input tilted.png"),
    ("estimate tilted.png --tum a --csv here/a", "--tum a", "what --csv writes"),
    ("serve --sessions . --log-file session/session.yaml", "--log-file session/session.yaml", "input session/session"),
    ("ros --camera cam.yaml --dock-diameter 0.3 --log-file cam.yaml", "--log-file cam.yaml", "input cam.yaml"),
    ("estimate tilted.png --lights-at lights.csv --csv lights.csv", "--csv lights.csv", "input lights.csv"),
]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with inputs of every kind; what must be refused before it is opened need not be readable."""
    folder = tmp_path_factory.mktemp("inputs")
    for name in ("tilted", "picture"):
        for ending in (".png", ".yaml"):
            shutil.copy(sample_path("tilted").with_suffix(ending), folder / f"{name}{ending}")
    save_camera(CAMERA, folder / "cam.yaml")
    scene = random_scene(4)
    save_dock(scene.dock, folder / "dock.yaml")
    for name in ("boards", "bag", "session/frames", "sim", "taken"):
        (folder / name).mkdir(parents=True)
    for name in ("s.yaml", "sim/scene.yaml", "sim/frame_0001.yaml"):
        save_sequence(FilmPlan(scene=scene), folder / name)
    (folder / "sim/truth.csv").write_bytes(",".join(TRUTH_COLUMNS).encode() + b"\r\n")
    fakes = ["film.mkv", "lights.csv", "tank.sdp", "bag/0.mcap", "boards/a.png", "taken/frame_0001.png"]
    for name in (*fakes, "session/session.yaml", "session/results.csv", "session/frames/0001.png"):
        (folder / name).write_bytes(b"of the tank")
    (folder / "link.png").symlink_to("tilted.png")
    (folder / "hard.png").hardlink_to(folder / "tilted.png")
    (folder / "here").symlink_to(folder)
    (folder / "dangling").symlink_to("a")
    return folder


def contents(folder):
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.mark.parametrize(("words", "named", "why"), REFUSED)
def test_an_output_that_would_overwrite_is_refused_and_nothing_changes(made, monkeypatch, refusal, words, named, why):
    monkeypatch.chdir(made)
    before = contents(made)
    sentence = refusal(*words.split())
    assert contents(made) == before
    assert sentence.startswith(f"dockpose: {named}")
    assert why in sentence


def test_every_command_that_writes_is_tried():
    assert {words.split()[0] for words, _, _ in REFUSED} == {*cli.COMMANDS} - {"doctor"}  # which reads nothing


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        "estimate tilted.png --json tilted.json --csv tilted.csv --annotate . --log-file tilted.log",
        "estimate tilted.png --json /dev/null --csv /dev/null",
        "estimate tilted.png --json - --csv tilted.csv",
        "compare tilted.png --json tilted.json",
        "export tilted.png --out tilted.csv",
    ],
)
def test_outputs_beside_inputs_are_written_and_written_again(made, tmp_path, monkeypatch, words):
    for ending in (".png", ".yaml"):
        shutil.copy(made / f"tilted{ending}", tmp_path)
    monkeypatch.chdir(tmp_path)
    before = contents(tmp_path)
    assert main(words.split()) == 0
    names = set(tmp_path.iterdir())
    assert main(words.split()) == 0
    assert set(tmp_path.iterdir()) == names
    assert before.items() <= contents(tmp_path).items()


def test_pictures_of_one_name_from_several_sources_are_all_kept(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b", "out"):
        (tmp_path / name).mkdir()
        for ending in (".png", ".yaml"):
            shutil.copy(made / f"tilted{ending}", tmp_path / name)
    before = contents(tmp_path)
    assert main(["estimate", "a", "out/tilted.png", "b", "--annotate", "out"]) == 0
    assert before.items() <= contents(tmp_path).items()
    assert sorted(path.name for path in (tmp_path / "out").glob("*.png")) == [
        *(f"tilted-{number}.png" for number in (2, 3, 4)),
        "tilted.png",
    ]


PLAIN = sample_source("plain")
READ_ONLY = [
    f"estimate {PLAIN} --json ro/a.jsonl",
    f"estimate {PLAIN} --csv ro/a.csv",
    f"estimate {PLAIN} --annotate ro/out",
    f"estimate {PLAIN} --rate 5 --annotate ro/a.mkv",
    f"estimate {PLAIN} --out ro/a.mcap",
    f"estimate {PLAIN} --log-file ro/a.log",
    f"compare {PLAIN} --json ro/a.jsonl",
    "simulate --scene scene.yaml --out ro/sim",
    "simulate --scene scene.yaml --out ro/a.mp4",
    f"export {PLAIN} --out ro/out",
    f"export {PLAIN} --out ro/a.csv",
    f"export {PLAIN} --out ro/a.zip",
    "calibrate boards --board 10x7 --square 0.024 --out ro/c.yaml",
    f"learn-dock boards {_KNOWN} --out ro/d.yaml",
    f"budget {_KNOWN} --csv ro/a.csv",
    "study --scenes 2 --seed 1 --jobs 1 --out ro/s",
    "reproduce --only table_3 --jobs 1 --out ro/r",
]
_IS_READ_ONLY = [False]
_TO_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Inputs, and a folder ``ro``."""
    folder = tmp_path_factory.mktemp("read_only")
    save_camera(CAMERA, folder / "cam.yaml")
    scene = random_scene(4, camera=CAMERA.for_size(320, 240), position_m=(0.05, 0.0, 1.0))
    save_sequence(FilmPlan(scene=scene, motion=Approach(frames=2, end_m=0.8)), folder / "scene.yaml")
    (folder / "boards").mkdir()
    shutil.copy(sample_path("plain"), folder / "boards" / "plain.png")
    (folder / "ro").mkdir()
    return folder


def refuse(event, arguments):
    """Answer as a system whose ``ro`` is read-only, also to who may write everywhere."""
    if not _IS_READ_ONLY[0]:
        return
    writes = event in ("os.mkdir", "os.rename", "os.remove") or (event == "open" and (arguments[2] or 0) & _TO_WRITE)
    if writes and isinstance(arguments[0], str | Path) and is_below(arguments[0]):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(arguments[0]))


def is_below(path):
    return "ro" in Path(path).parts


sys.addaudithook(refuse)  # which cannot be taken away again


@pytest.fixture
def read_only(monkeypatch):
    real = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: real(path, mode) and not (mode & os.W_OK and is_below(path)))
    _IS_READ_ONLY[0] = True
    yield
    _IS_READ_ONLY[0] = False


# What the commands begin with once they know where results go.
WORK = (
    *("inputs.pictures.estimate", "processing.following.Following.see", "commands.compare.compare"),
    *("commands.simulate.film", "commands.export._files", "commands.calibration.gathered"),
    *("commands.calibration.dock_views", "commands.paper.budget"),
    *("export.study.report.workers", "export.parts.workers"),
)


def begun(*arguments, **more):
    raise AssertionError("work began")


@pytest.mark.parametrize("words", READ_ONLY)
def test_a_folder_that_is_read_only_is_named_before_work_begins(folder, read_only, monkeypatch, refusal, words):
    monkeypatch.chdir(folder)
    for name in WORK:
        monkeypatch.setattr(f"dockpose.app.{name}", begun)
    told = refusal(*words.split())
    assert " ro" in told
    assert "read-only" in told
    assert list((folder / "ro").iterdir()) == []
