"""SIGTERM, as systemd and shutting down send it: commands end at once, and what is written is whole."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from dockpose.app.cli import main
from dockpose.app.commands.console import Terminated
from dockpose.app.export.video import VideoFile
from dockpose.sidecar import sample_path
from dockpose.simulate import Approach, FilmPlan, film
from dockpose.simulate.files import save_sequence

from tests.support.left_files import faults
from tests.support.scenes import CAMERA, random_scene

pytestmark = pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
FILM = ["estimate", "film.mkv", "--json", "out/a.jsonl"]
# Each with the file that tells that it is at work.
COMMANDS = {
    "video": ([*FILM, "--csv", "out/a.csv", "--annotate", "out/a.mkv", "--out", "out/b.mcap"], "out/b.mcap"),
    "folder": (["estimate", "pictures", "--json", "out/a.jsonl", "--annotate", "out"], "out/002.png"),
    "simulate": (["simulate", "--out", "out", "--frames", "5000"], "out/frame_0002.png"),
    "two jobs": ([*FILM, "--jobs", "2"], "out/a.jsonl"),
    "reproduce": (["reproduce", "--jobs", "2", "--out", "out"], ""),
    "serve": (["serve", "--port", "0"], ""),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A film of 400 frames and a folder of 200 pictures."""
    folder = tmp_path_factory.mktemp("sigterm")
    scene = random_scene(4, camera=CAMERA.for_size(320, 240), position_m=(0.05, 0.0, 1.0))
    plan = FilmPlan(scene=scene, motion=Approach(frames=5, start_m=1.2, end_m=0.8))
    save_sequence(plan, folder / "film.yaml")
    pictures = [frame.image for frame in film(plan)]
    with VideoFile(folder / "film.mkv", 25.0) as video:
        for number in range(400):
            video.write(pictures[number % 5])
    (folder / "pictures").mkdir()
    for number in range(200):
        for ending in (".png", ".yaml"):
            shutil.copy(sample_path("plain").with_suffix(ending), folder / "pictures" / f"{number:03d}{ending}")
    return folder


@contextlib.contextmanager
def running(inputs, tmp_path, name):
    """A command at work in a folder of its own, as a group of processes; ended in any case."""
    words, sign = COMMANDS[name]
    for path in inputs.iterdir():
        (tmp_path / path.name).symlink_to(path)
    (tmp_path / "out").mkdir()
    with open(tmp_path / "said.txt", "wb") as said:
        command = [sys.executable, "-m", "dockpose.app.cli", *words]
        program = subprocess.Popen(command, cwd=tmp_path, stderr=said, stdout=said, start_new_session=True)
    try:
        end_s = time.monotonic() + 60
        while not is_at_work(tmp_path, program.pid, sign) and time.monotonic() < end_s:
            assert program.poll() is None, (tmp_path / "said.txt").read_text()
            time.sleep(0.05)
        yield program
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)
        program.wait()


def is_at_work(folder, group, sign):
    if sign:
        return (folder / sign).exists() and (folder / sign).stat().st_size > 0
    # Workers that are there have begun with what they were given; the page says where it is.
    return len(alive(group)) >= 4 or "the page is at" in (folder / "said.txt").read_text()


def alive(group):
    """Processes of a group, without those that have ended and not yet been asked about."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, of_group = path.read_text().rpartition(")")[2].split()[:3]
            if int(of_group) == group and state != "Z":
                found.append(int(path.parent.name))
    return found


def is_empty(group, within_s):
    end_s = time.monotonic() + within_s
    while (left := alive(group)) and time.monotonic() < end_s:
        time.sleep(0.02)
    return not left


def ends_cleanly(inputs, tmp_path, name):
    """The seconds that a command takes to end; only the bench, which has the machine to itself, judges them."""
    with running(inputs, tmp_path, name) as program:
        began_s = time.monotonic()
        program.send_signal(signal.SIGTERM)
        assert program.wait(120) == 143
        lasted_s = time.monotonic() - began_s
        assert is_empty(program.pid, 60.0), "processes are left"
    said = (tmp_path / "said.txt").read_text().splitlines()
    print(name, f"{lasted_s:.2f} s", said)
    assert "Traceback" not in "\n".join(said)
    last = [line for line in said if line.startswith("dockpose: ")][-1]  # a sum of what was found may follow
    assert last.startswith(("dockpose: ended by SIGTERM", "dockpose: stopped"))
    assert faults(tmp_path / "out", ("a.jsonl", "a.csv")) == []
    assert not [path for path in (tmp_path / "out").rglob("*.part")]
    return lasted_s


@pytest.mark.slow
@pytest.mark.parametrize("name", ["video", "simulate", "two jobs"])
def test_sigterm_ends_it_cleanly(inputs, tmp_path, name):
    """The others are in tests/bench/bench_sigterm.py: each starts Python several times."""
    ends_cleanly(inputs, tmp_path, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["video", "folder", "simulate"])
def test_what_a_killed_command_wrote_can_be_read(inputs, tmp_path, name):
    with running(inputs, tmp_path, name) as program:
        program.kill()
        program.wait()
    assert faults(tmp_path / "out", ("a.jsonl", "a.csv", "a.mkv", "b.mcap", "truth.csv")) == []


@pytest.mark.slow
def test_workers_end_with_a_program_that_is_killed(inputs, tmp_path):
    with running(inputs, tmp_path, "two jobs") as program:
        assert len(alive(program.pid)) >= 3
        program.kill()
        program.wait()
        assert is_empty(program.pid, 60.0), "workers are left"


@pytest.mark.parametrize("stop", [Terminated, KeyboardInterrupt])
def test_a_signal_while_compiled_code_runs_is_no_error(monkeypatch, capsys, stop):
    """Numba returns a result all the same, of which Python makes a SystemError."""

    def interrupted(*arguments, **more):
        raise SystemError("returned a result with an exception set") from stop()

    monkeypatch.setattr("dockpose.app.commands.compare.compare", interrupted)
    assert main(["compare", str(sample_path("plain"))]) == (143 if stop is Terminated else 130)
    assert capsys.readouterr().err == f"dockpose: {'ended by SIGTERM' if stop is Terminated else 'stopped'}\n"
    monkeypatch.setattr("dockpose.app.inputs.pictures.estimate", interrupted)
    assert main(["estimate", str(sample_path("plain"))]) == (143 if stop is Terminated else 130)
    assert capsys.readouterr().err == "dockpose: stopped after 0 frames, whose results are kept\n"
