"""What all tests of commands have in common."""

import json
from contextlib import nullcontext

import cv2
import numpy as np
import pytest
from dockpose import compiled
from dockpose.app.cli import main
from dockpose.camera.files import save_camera
from dockpose.simulate.files import save_scene

from tests.support.scenes import CAMERA, random_scene


@pytest.fixture(autouse=True)
def _no_word_on_compiling(monkeypatch):
    """Whether loops are compiled depends on which tests ran before; tests/test_package.py has the message."""
    monkeypatch.setattr(compiled, "on_compiling", lambda tell: nullcontext())


@pytest.fixture
def tank(tmp_path, monkeypatch):
    """A folder with two pictures, their YAML beside them, a camera file, a dark picture and a broken one."""
    monkeypatch.chdir(tmp_path)
    for index in (1, 2):
        save_scene(random_scene(index), tmp_path, f"s{index}")
    save_camera(CAMERA, tmp_path / "camera.yaml")
    cv2.imwrite("dark.png", np.zeros((480, 640), np.uint8))
    (tmp_path / "words.png").write_text("not a picture")
    return tmp_path


@pytest.fixture
def json_lines(capfd):
    """Run a command, and return the JSON lines that it writes to standard output."""

    def run(*words, status=0):
        assert main([*words, "--json", "-"]) == status
        return [json.loads(line) for line in capfd.readouterr().out.splitlines()]

    return run


@pytest.fixture
def refusal(capfd):
    """Run a command that cannot be done, and return the one sentence that it says."""

    def run(*words, status=2):
        assert main([*words]) == status
        told = capfd.readouterr()
        assert told.out == ""
        (sentence,) = told.err.splitlines()
        return sentence

    return run
