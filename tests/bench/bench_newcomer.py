"""The README's way from a clone to the pose in the user's own picture: its commands, in a fresh environment."""

import os
import resource
import shlex
import subprocess
import sys
import time
from pathlib import Path

import cv2
import pytest
from dockpose import Camera, Dock
from dockpose.simulate import Pose, Scene, render

from tests.docs.pages import ROOT, blocks

MOST_COMMANDS, MOST_S = 5, 180  # besides downloads
README = list(blocks(ROOT / "README.md"))
COMMANDS = next(block.text for block in README if block.language == "sh").splitlines()
CAMERA_FILE = next(block.text for block in README if block.language == "yaml")
TRUE_CM = 137.0


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A folder with somebody's own picture and camera file, to be put where the last command looks for them."""
    pose = Pose(position_m=(0.05, -0.03, TRUE_CM / 100), theta_y_deg=20.0, roll_deg=5.0)
    scene = Scene(camera=Camera(700, 700, 319.5, 239.5, 640, 480), dock=Dock(0.30, 10), pose=pose, seed=3)
    cv2.imwrite(str(tmp_path / "tank.png"), render(scene)[0])
    (tmp_path / "camera.yaml").write_text(CAMERA_FILE, encoding="utf-8")
    return tmp_path


def spent_s() -> float:
    """Processor time of all commands so far."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def run(words: list[str], folder: Path) -> tuple[str, float]:
    """Run a command as it stands, without what an active environment adds; returns what it prints, and its seconds."""
    clean = {name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH")}
    began = time.monotonic()
    done = subprocess.run(words, cwd=folder, env=clean, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, f"{words}: {done.stderr}"
    return done.stdout, time.monotonic() - began


def download(folder: Path) -> float:
    """Fetch what pip will need into its cache; returns the seconds."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--dest", str(folder / "wheels"), str(ROOT)]
    return run([*command, "setuptools>=77.0.3"], folder)[1]


def test_from_a_clone_to_a_pose(lab: Path) -> None:
    assert len(COMMANDS) <= MOST_COMMANDS
    downloading_s = download(lab)
    print(f"\ndownloads, not counted: {downloading_s:.1f} s")
    folder, total_s, said, spent_before_s = lab, 0.0, "", spent_s()
    for line in COMMANDS:
        words = shlex.split(line.replace("ADDRESS", str(ROOT)))
        if words[0] == "cd":
            folder /= words[1]
            continue
        if words[0].endswith("dockpose"):
            for name in ("tank.png", "camera.yaml"):
                (folder / name).write_bytes((lab / name).read_bytes())
        if words[0] == "python3":
            words[0] = sys.executable
        if words[0].endswith("pip"):
            words += ["--no-index", "--find-links", str(lab / "wheels")]
        said, seconds = run(words, folder)
        total_s += seconds
        print(f"{seconds:7.1f} s  {line}", flush=True)
    print(f"{total_s:7.1f} s  in all, {spent_s() - spent_before_s:.1f} s of processor time; asked: {MOST_S}\n{said}")
    assert f"the dock is {TRUE_CM:.1f} cm ahead" in said
    assert total_s <= MOST_S
