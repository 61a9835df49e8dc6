"""A camera that is unplugged, and a clock that is set back meanwhile."""

import json
import os
import signal
import threading
import time

import cv2
import numpy as np
import pytest
from dockpose.app.cli import main
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, film

from tests.support.cameras import V4l2Camera
from tests.support.left_files import faults
from tests.support.scenes import CAMERA, random_scene

pytestmark = pytest.mark.skipif(os.name == "nt", reason="is stopped by a signal")
SMALL = CAMERA.for_size(320, 240)
FRAMES = 8


@pytest.fixture(scope="module")
def pictures():
    plan = FilmPlan(
        scene=random_scene(4, camera=SMALL, position_m=(0.05, 0.0, 1.0)),
        motion=Approach(frames=FRAMES, start_m=1.2, end_m=1.0, rate_hz=20),
    )
    return [frame.image for frame in film(plan)]


@pytest.fixture
def words(tmp_path, monkeypatch):
    """Arguments for every kind of output."""
    monkeypatch.chdir(tmp_path)
    save_camera(SMALL, "camera.yaml")
    (tmp_path / "out").mkdir()
    known = ["--camera", "camera.yaml", "--dock-diameter", "0.3", "--lights", "10"]
    outputs = ["--json", "out/a.jsonl", "--csv", "out/a.csv", "--annotate", "out/a.mkv", "--out", "out/b.mcap"]
    return [*known, *outputs, "--record", "out/r.mkv"]


def run_until_unplugged(pictures, words, monkeypatch):
    """Exit status of ``estimate 0``, whose camera is unplugged after its pictures; two seconds later comes Ctrl+C."""
    lost = threading.Event()

    def unplug():
        camera.is_unplugged = True
        lost.set()

    def stop():
        if lost.wait(60):
            time.sleep(2.0)
        os.kill(os.getpid(), signal.SIGINT)

    camera = V4l2Camera.make(pictures, sizes=((320, 240),), rates_hz=(20.0,), on_end=unplug)
    monkeypatch.setattr(cv2, "VideoCapture", camera)
    threading.Thread(target=stop, daemon=True).start()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return main(["estimate", "0", *words])
    finally:
        signal.signal(signal.SIGINT, before)


def lines_kept(tmp_path):
    assert faults(tmp_path / "out", ()) == []
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"a.jsonl", "a.csv", "a.mkv", "b.mcap", "r.mkv"}
    return [json.loads(line) for line in (tmp_path / "out" / "a.jsonl").read_text().splitlines()]


@pytest.mark.slow
def test_an_unplugged_camera_is_told_and_what_was_done_is_kept(pictures, words, tmp_path, monkeypatch, capsys):
    assert run_until_unplugged(pictures, words, monkeypatch) == 130
    told = capsys.readouterr().err.splitlines()
    assert told.count("dockpose: camera 0: no more frames come; it is tried again after 0.5 s") == 1
    assert sum("camera 0: no camera has that number" in line for line in told) >= 1
    assert told[-1].endswith("whose results are kept") or told[-2].endswith("whose results are kept")
    lines = lines_kept(tmp_path)
    assert f"dockpose: stopped after {len(lines)} frame" in "\n".join(told)
    assert len(lines) > 0


@pytest.mark.slow
def test_a_clock_that_is_set_back_leaves_times_in_order(pictures, words, tmp_path, monkeypatch, capsys):
    real_s = time.time
    calls = 0

    def set_back_s():
        """An hour less from the third time on that somebody asks."""
        nonlocal calls
        calls += 1
        return real_s() - (3600 if calls > 2 else 0)

    monkeypatch.setattr(time, "time", set_back_s)
    assert run_until_unplugged(pictures, words, monkeypatch) == 130
    monkeypatch.undo()
    lines = lines_kept(tmp_path)
    for name in ("time_s", "time_unix_s"):
        assert (np.diff([line[name] for line in lines]) > 0).all()
    assert len({round(line["time_unix_s"] - line["time_s"], 3) for line in lines}) == 1
    assert all(line["elapsed_ms"] >= 0 for line in lines)
    told = capsys.readouterr().err
    assert "Traceback" not in told
    assert ", -" not in told
