import contextlib
import json
import os
import struct
import sys
import threading
import time
from pathlib import Path

import cv2
import msgspec
import pytest
from dockpose.app.cli import main
from dockpose.app.processing import parallel
from dockpose.app.processing.parallel import workers
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, film
from dockpose.simulate.files import save_sequence
from dockpose.simulate.parts import Text

from tests.support.scenes import CAMERA, random_scene

FRAMES = 110  # more than a block
SMALL = CAMERA.for_size(320, 240)
KNOWN = ["--camera", "camera.yaml", "--dock-diameter", "0.3", "--lights", "10"]


@pytest.fixture(scope="module")
def tank(tmp_path_factory):
    """A video of an approach with burnt-in text, its pictures one by one, one of them broken, and their camera."""
    folder = tmp_path_factory.mktemp("tank")
    text = Text(text="REC 7", x_px=5, y_px=215, height_px=16)
    scene = msgspec.structs.replace(random_scene(4, camera=SMALL, position_m=(0.05, 0.0, 1.0)), texts=(text,))
    sequence = FilmPlan(scene=scene, motion=Approach(frames=FRAMES, start_m=1.6, end_m=0.8, drift_m=0.05))
    save_sequence(sequence, folder / "film.yaml")
    save_camera(SMALL, folder / "camera.yaml")
    (folder / "pictures").mkdir()
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"FFV1"), 10.0, (320, 240), False)
    for frame in film(sequence):
        writer.write(frame.image)
        cv2.imwrite(str(folder / "pictures" / f"p{frame.number}.png"), frame.image)
    writer.release()
    (folder / "pictures" / "p30.png").write_text("not a picture")
    return folder


def run(arguments, capsys):
    """Exit status, lines without what is measured, and what was told."""
    status = main(["estimate", *arguments, "--json", "-"])
    captured = capsys.readouterr()
    lines = [json.loads(line) for line in captured.out.splitlines()]
    assert all(line.pop("elapsed_ms") > 0 for line in lines)
    told = [line for line in captured.err.splitlines() if " a second" not in line]  # a slow machine tells how far it is
    return status, [json.dumps(line) for line in lines], "\n".join(told)


@pytest.mark.slow
@pytest.mark.parametrize(
    "source", [["film.avi"], ["pictures", "--rate", "10", *KNOWN], ["pictures", *KNOWN]], ids=["video", "rate", "each"]
)
def test_processes_give_the_same_lines_in_the_same_order(tank, monkeypatch, capsys, source):
    monkeypatch.chdir(tank)
    if source != ["pictures", *KNOWN]:
        monkeypatch.setattr("dockpose.lights.masks.LEAST_FRAMES", 1)  # two of these are searched, the others followed
    alone = run(source, capsys)
    assert run([*source, "--jobs", "2"], capsys) == alone
    assert len(alone[1]) == FRAMES - (source[0] == "pictures")
    assert "stays put" in alone[2]  # so that some frames were done again with the mask
    assert alone[0] == (1 if source[0] == "pictures" else 0)


@pytest.mark.parametrize(("system", "processes"), [("win32", 61), ("linux", 64), ("darwin", 64)])
def test_windows_waits_for_no_more_processes_than_it_can(system, processes, monkeypatch):
    made = []

    class Pool:
        def __init__(self, jobs, **how):
            made.append(jobs)

        def shutdown(self, *words, **how):
            pass

    monkeypatch.setattr(parallel, "ProcessPoolExecutor", Pool)
    monkeypatch.setattr(parallel.sys, "platform", system)
    with workers(64) as (_, jobs):
        assert [jobs] == made == [processes]


def begin_a_result(sign):
    """Send the length of a result and its first byte, as where a worker is ended while it sends."""
    results = sys._getframe(1).f_locals["result_queue"]
    os.write(results._writer.fileno(), struct.pack("!i", 1000) + b"x")
    Path(sign).touch()
    time.sleep(600)


@pytest.mark.slow
def test_a_worker_that_is_ended_while_it_sends_holds_nobody_up(tmp_path):
    sign = tmp_path / "sent"

    def interrupted():
        with contextlib.suppress(KeyboardInterrupt), workers(1) as (executor, _):
            executor.submit(begin_a_result, sign)
            while not sign.exists():
                time.sleep(0.01)
            raise KeyboardInterrupt

    thread = threading.Thread(target=interrupted, daemon=True)
    thread.start()
    thread.join(60)
    assert not thread.is_alive()
