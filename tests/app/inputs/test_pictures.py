import pytest
from dockpose.app.inputs.pictures import expand
from dockpose.sources import SourceError


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
