# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false
"""What is known of a picture by its name: the YAML beside it, and the sample scenes."""

import shutil

import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.files import FileError
from dockpose.sidecar import load_dock, sample_path, sample_source, samples_folder

from tests.support.docks import CAMERA


def test_samples_have_names_unless_a_file_here_is_called_so(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert sample_source("sample_images") == str(samples_folder())
    assert sample_source("tilted") == str(sample_path("tilted"))
    assert sample_source("tank.png") == "tank.png"
    (tmp_path / "sample_images").mkdir()
    assert sample_source("sample_images") == "sample_images"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("camera: {}", "it has no key dock; its keys are camera"),
        ("dock: {diameter_m: 0.3, lights: 10, offsets_m: [[0, 0, 0]]}", "offsets_m has 1 values; the dock"),
        ("dock: {diameter_m: 0.3, offsets_m: [[0, 0]]}", "offsets_m"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, why):
    (tmp_path / "dock.yaml").write_text(text)
    with pytest.raises(FileError, match=why):
        load_dock(tmp_path / "dock.yaml")


def test_a_sample_is_estimated_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = estimate("tilted")
    assert found.selected.position_m[2] == pytest.approx(1.0, rel=0.01)  # as its scene says
    assert found.dock == load_dock(sample_path("tilted").with_suffix(".yaml"))


def test_camera_and_dock_come_from_beside_the_picture_unless_they_are_given(tmp_path):
    for path in (sample_path("tilted"), sample_path("tilted").with_suffix(".yaml")):
        shutil.copy(path, tmp_path / f"tank{path.suffix}")
    assert estimate(tmp_path / "tank.png").status == "ok"
    assert estimate(tmp_path / "tank.png", dock=Dock(0.60, 10)).selected.position_m[2] == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize(("camera", "missing"), [(None, "camera"), (CAMERA, "dock")])
def test_what_nothing_says_is_asked_for(tmp_path, camera, missing):
    shutil.copy(sample_path("tilted"), tmp_path / "tank.png")
    with pytest.raises(FileError, match=f"tank.png: which {missing}\\? Pass {missing}, or describe it in tank.yaml"):
        estimate(tmp_path / "tank.png", camera)


def test_a_name_of_nothing_is_no_question_of_cameras(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileError, match="tiltd: there is no such file"):
        estimate("tiltd")


def test_an_array_has_nothing_beside_it():
    with pytest.raises(ValueError, match="camera is None; it must be a Camera"):
        estimate(np.zeros((480, 640), np.uint8))
