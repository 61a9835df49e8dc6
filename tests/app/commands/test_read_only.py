"""A folder that may not be written to: one sentence that names it, before work begins."""

import errno
import os
import shutil
import sys
from pathlib import Path

import pytest
from dockpose.app.inputs.pictures import sample_path, sample_source
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, save_sequence

from tests.support.scenes import CAMERA, random_scene

pytestmark = pytest.mark.skipif(os.name == "nt", reason="folders have no such mode")
PLAIN = sample_source("plain")
KNOWN = "--camera camera.yaml --dock-diameter 0.3 --lights 10"
COMMANDS = [
    f"estimate {PLAIN} --json ro/a.jsonl",
    f"estimate {PLAIN} --csv ro/a.csv",
    f"estimate {PLAIN} --annotate ro/out",
    f"estimate {PLAIN} --annotate ro",
    f"estimate {PLAIN} --rate 5 --annotate ro/a.mkv",
    f"estimate {PLAIN} --rate 5 --annotate ro/a.mp4",
    f"estimate {PLAIN} --out ro/a.mcap",
    f"estimate {PLAIN} --rerun ro/a.rrd",
    f"estimate {PLAIN} --log-file ro/a.log",
    f"compare {PLAIN} --json ro/a.jsonl",
    f"compare {PLAIN} --montage ro/out",
    "simulate --scene scene.yaml --out ro/sim",
    "simulate --scene scene.yaml --out ro",
    "simulate --scene scene.yaml --out ro/a.mp4",
    f"export {PLAIN} --out ro/out",
    f"export {PLAIN} --out ro",
    f"export {PLAIN} --out ro/a.csv",
    f"export {PLAIN} --out ro/a.zip",
    "calibrate boards --board 10x7 --square 0.024 --out ro/c.yaml",
    f"learn-dock boards {KNOWN} --out ro/d.yaml",
    f"budget {KNOWN} --csv ro/a.csv",
    "study --scenes 2 --seed 1 --jobs 1 --out ro/s",
    "study --scenes 2 --seed 1 --jobs 1 --out ro",
    "reproduce --only table_3 --jobs 1 --out ro/r",
    "reproduce --only table_3 --jobs 1 --out ro",
]
_IS_READ_ONLY = [False]
_TO_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Inputs, and a folder ``ro``."""
    folder = tmp_path_factory.mktemp("read_only")
    save_camera(CAMERA, folder / "camera.yaml")
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
    *("commands.estimate.estimate", "processing.following.Following.see", "commands.compare.compare"),
    *("commands.simulate.film", "commands.export._files", "commands.calibration.gathered"),
    *("commands.calibration.dock_views", "commands.paper.budget"),
    *("processing.study.workers", "export.parts.workers"),
)


def begun(*arguments, **more):
    raise AssertionError("work began")


@pytest.mark.parametrize("words", COMMANDS)
def test_a_folder_that_is_read_only_is_named_before_work_begins(folder, read_only, monkeypatch, refusal, words):
    monkeypatch.chdir(folder)
    for name in WORK:
        monkeypatch.setattr(f"dockpose.app.{name}", begun)
    told = refusal(*words.split())
    assert " ro" in told
    assert "read-only" in told
    assert list((folder / "ro").iterdir()) == []
