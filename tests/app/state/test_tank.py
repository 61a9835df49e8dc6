import errno
import os

import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.state import tank as tanks_module
from dockpose.app.state.tank import MOST_TANKS, Tank, Tanks, tank_words
from dockpose.camera.port import FlatPort

CAMERA = Camera(812.0, 812.0, 639.5, 359.5, 1280, 720)
MINE = Tank("", CAMERA, Dock(0.45, 8))


def test_words_have_name_fx_size_diameter_and_lights():
    assert tank_words(Tank()) == "My tank: no camera yet, dock 30 cm assumed"
    assert tank_words(Tank("Pool A", CAMERA, Dock(0.45, 8), knows_diameter=True)) == (
        "Pool A: fx 812.0 px at 1280 × 720, dock 45 cm, 8 lights"
    )
    port = Camera(812.0, 812.0, 639.5, 359.5, 1280, 720, port=FlatPort(air_gap_m=0.02, glass_m=0.01))
    assert "behind a flat port" in tank_words(Tank("", port))


def test_several_are_kept_under_their_names_and_come_back_whole(tmp_path):
    tanks = Tanks(tmp_path / "settings")
    named = tanks.save(MINE, "  Pool \n A ")
    assert named == Tank("Pool A", CAMERA, Dock(0.45, 8))
    angles = Tank("", None, Dock(0.3, 3, (0, 90, 200)))
    tanks.save(angles, "workshop")
    again = Tanks(tmp_path / "settings")
    assert again.names() == ["Pool A", "workshop"]
    assert (again.get("Pool A"), again.get("workshop").dock) == (named, angles.dock)
    assert again.is_saved(named)
    assert not again.is_saved(MINE)
    again.forget("Pool A")
    assert Tanks(tmp_path / "settings").names() == ["workshop"]


@pytest.mark.parametrize("name", ["", "  ", "\n", "x" * 41])
def test_name_is_needed(name):
    with pytest.raises(UserError, match="needs a name"):
        Tanks(None).save(MINE, name)


def test_number_is_limited_and_unknown_names_are_refused():
    tanks = Tanks(None)
    for number in range(MOST_TANKS):
        tanks.save(MINE, str(number))
    tanks.save(MINE, "3")  # replaces the one of that name
    assert len(tanks.names()) == MOST_TANKS
    with pytest.raises(UserError, match="forget one first"):
        tanks.save(MINE, "one more")
    for act in (tanks.get, tanks.forget):
        with pytest.raises(UserError, match="no tank called"):
            act("gone")


@pytest.mark.parametrize("stop", ["fsync", "replace"])
def test_save_that_fails_or_is_cut_off_leaves_the_old_file_whole(tmp_path, monkeypatch, stop):
    tanks = Tanks(tmp_path)
    tanks.save(MINE, "Pool A")
    before = (tmp_path / "tanks.yaml").read_bytes()

    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os if stop == "fsync" else tanks_module.Path, stop, fail)
    with pytest.raises(UserError, match="No space left"):
        tanks.save(MINE, "Pool B")
    assert tanks.names() == ["Pool A"]
    assert (tmp_path / "tanks.yaml").read_bytes() == before


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"tanks: 3", b"tanks: [{name: a, colour: red}]", b"a: [", b"[" * 9999]
)
def test_file_that_cannot_be_read_is_told_and_never_overwritten(tmp_path, content):
    (tmp_path / "tanks.yaml").write_bytes(content)
    tanks = Tanks(tmp_path)
    assert tanks.names() == []
    assert "cannot be read" in tanks.trouble
    with pytest.raises(UserError, match="kept as it is"):
        tanks.save(MINE, "Pool A")
    assert (tmp_path / "tanks.yaml").read_bytes() == content
