import os

import pytest
from dockpose.app.errors import UserError
from dockpose.app.inputs.folder import below, folders_below, pictures_in, step


@pytest.fixture
def root(tmp_path):
    """A folder with pictures, and a secret beside it that links inside point to."""
    inside = tmp_path / "root"
    (inside / "run 1" / "deep").mkdir(parents=True)
    (tmp_path / "secret").mkdir()
    for name in ("root/b.png", "root/run 1/frame10.png", "root/run 1/frame2.png", "secret/key.png"):
        (tmp_path / name).write_bytes(b"x")
    (inside / "notes.txt").write_text("x")
    os.symlink(tmp_path / "secret", inside / "way out")
    os.symlink(tmp_path / "secret" / "key.png", inside / "key.png")
    return inside


def test_lists_pictures_in_numeric_order_and_folders(root):
    assert folders_below(root) == [".", "run 1", "run 1/deep"]
    assert pictures_in(root, ".") == ["b.png"]
    assert pictures_in(root, "run 1") == ["run 1/frame2.png", "run 1/frame10.png"]


@pytest.mark.parametrize(
    "name", ["..", "../secret/key.png", "run 1/../../secret", "/etc/passwd", "way out", "way out/key.png", "key.png"]
)
def test_no_way_leads_above_the_root(root, name):
    with pytest.raises(UserError, match=r"below the folder|not in the folder"):
        below(root, name)


@pytest.mark.parametrize("name", ["nowhere.png", "a\x00b", "x" * 5000])
def test_what_is_not_there_is_refused(root, name):
    with pytest.raises(UserError, match="not in the folder"):
        below(root, name)


def test_steps_end_at_both_ends():
    names = ["a", "b", "c"]
    assert [step(names, "b", by) for by in (-1, 1, 2)] == ["a", "c", None]
    assert step(names, "a", -1) is None
    assert step(names, "gone", 1) is None
