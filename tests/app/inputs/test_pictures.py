# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false
"""Pictures, docks that come back, and the sample scenes."""

import shutil

import pytest
from dockpose import Dock
from dockpose.app.inputs.pictures import expand, save_dock
from dockpose.app.web.panels.source import SAMPLE_WORDS
from dockpose.camera.files import load_camera
from dockpose.sidecar import load_dock, sample_names, samples_folder
from dockpose.sources import SourceError

from tests.support.docks import CAMERA, uneven
from tests.support.scenes import render_folder

MOST_BYTES = 3_000_000


@pytest.fixture
def folder(tmp_path):
    for name in ("frame10.png", "frame2.png", "frame1.JPG", "notes.txt"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "more.png").mkdir()
    return tmp_path


def names(paths):
    return [path.name for path in paths]


def test_a_folder_and_a_glob_are_their_pictures_in_numeric_order_and_several_sources_keep_theirs(folder):
    assert names(expand([str(folder)])) == ["frame1.JPG", "frame2.png", "frame10.png"]
    assert names(expand([str(folder / "frame*.png")])) == ["frame2.png", "frame10.png"]
    sources = [str(folder / name) for name in ("frame10.png", "missing.png", "frame2.png")]
    assert names(expand(sources)) == ["frame10.png", "missing.png", "frame2.png"]


def test_a_name_with_brackets_that_exists_is_no_glob(tmp_path):
    path = tmp_path / "dock[1].png"
    path.write_bytes(b"")
    assert expand([str(path)]) == [path]


def test_an_empty_folder_and_a_glob_without_match_are_told(tmp_path):
    with pytest.raises(SourceError, match="has no pictures"):
        expand([str(tmp_path)])
    with pytest.raises(SourceError, match="no file matches"):
        expand([str(tmp_path / "*.png")])


def test_there_are_a_dozen_and_they_stay_small():
    assert len(sample_names()) >= 12
    assert {"plain", "tilted", "turbid"} <= set(sample_names())
    assert set(SAMPLE_WORDS) == set(sample_names())
    assert sum(path.stat().st_size for path in samples_folder().iterdir()) < MOST_BYTES


@pytest.mark.slow
def test_all_are_rendered_again_byte_for_byte(tmp_path):
    # What `make samples` does, on a copy.
    copy = tmp_path / "samples"
    copy.mkdir()
    for path in samples_folder().glob("*.yaml"):
        shutil.copy(path, copy)
    assert render_folder(copy) == sorted(sample_names())
    for path in sorted(samples_folder().iterdir()):
        assert (copy / path.name).read_bytes() == path.read_bytes(), path.name


def test_a_dock_comes_back_to_the_same_numbers(tmp_path):
    save_dock(uneven(0), tmp_path / "dock.yaml")
    assert load_dock(tmp_path / "dock.yaml") == uneven(0)


def test_the_camera_lies_beside_it(tmp_path):
    save_dock(Dock(0.30), tmp_path / "dock.yaml", CAMERA)
    assert load_dock(tmp_path / "dock.yaml") == Dock(0.30)
    assert load_camera(tmp_path / "dock.yaml") == CAMERA
