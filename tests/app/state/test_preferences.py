# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import gc
import os
import stat
import weakref
from dataclasses import replace
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from dockpose import Settings
from dockpose.app.errors import UserError
from dockpose.app.export.data import settings_yaml
from dockpose.app.processing.analysis import analyse
from dockpose.app.state import preferences as memory
from dockpose.app.state import view as state
from dockpose.app.state.parameters import put
from dockpose.app.state.preferences import Memory, Remembered, with_last_settings, with_settings_file
from dockpose.app.state.tank import Tanks
from dockpose.app.state.view import MeasuredPose
from dockpose.app.web.app import App
from dockpose.app.web.panels.source import SourcePanel
from dockpose.app.web.server.options import Options


def test_settings_file_is_read_back_and_what_it_leaves_out_stays(view):
    changed = put(put(put(view, "fx", 812.5), "diameter_cm", 45), "level", 99)
    saved = settings_yaml(analyse(replace(changed, measured=MeasuredPose(z_cm=100)))).encode()
    back = with_settings_file(view, saved, "mine.yaml")
    assert back.measured is None  # that was of another picture
    assert (back.camera, back.dock, back.settings) == (changed.camera, changed.dock, changed.settings)

    back = with_settings_file(view, b"settings: {method: otsu}", "mine.yaml")
    assert (back.settings.method, back.camera, back.dock) == ("otsu", view.camera, view.dock)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"colour: red", r"^mine\.yaml: .*colour"),
        (b"settings: {methode: otsu}", r"^mine\.yaml: .*methode"),
        (b"settings: {level: 999}", r"^mine\.yaml: .*level"),
        (b"[1, 2]", r"^mine\.yaml: holds no keys"),
        (
            settings_yaml(analyse(state.open_source(None, None, None)))
            .replace("width_px: 640", "width_px: 300")
            .encode(),
            r"300 x 480",
        ),
    ],
)
def test_wrong_settings_file_is_named(view, data, words):
    with pytest.raises(ValueError, match=words):
        with_settings_file(view, data, "mine.yaml")


def test_last_settings_are_there_at_the_next_start(tmp_path):
    first = Memory(tmp_path / "dockpose")
    assert first.now == Remembered()
    first.change(settings=Settings(method="otsu", masks=((1, 2, 3, 4),)), dark=True)
    first.write()
    assert Memory(tmp_path / "dockpose").now == Remembered(Settings(method="otsu"), True)


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe", b"settings: 3", b"settings: {method: gone}", b"a: [", b"[" * 9999]
)
def test_broken_memory_is_as_none(tmp_path, content):
    (tmp_path / "last.yaml").write_bytes(content)
    assert Memory(tmp_path).now == Remembered()


def test_memory_that_cannot_be_written_is_no_fault(tmp_path):
    (tmp_path / "file").write_text("in the way")
    kept = Memory(tmp_path / "file" / "dockpose")
    kept.change(dark=True)
    kept.write()
    assert not (tmp_path / "file" / "dockpose").exists()


@pytest.mark.parametrize(
    ("platform", "end"), [("linux", "set/dockpose"), ("darwin", "Support/dockpose"), ("win32", "apps/dockpose")]
)
def test_folder_for_settings(monkeypatch, platform, end):
    monkeypatch.setattr(memory.sys, "platform", platform)
    monkeypatch.setenv("XDG_CONFIG_HOME", "/set")
    monkeypatch.setenv("APPDATA", "/apps")
    assert str(memory.config_folder()).endswith(end)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (Settings(method="fixed", level=254), "a fixed level of 254"),
        (Settings(method="otsu", min_area_px=999), "groups of 999 px or more"),
    ],
)
def test_last_settings_that_hide_the_dock_are_not_taken_and_that_is_said(view, settings, words):
    first = with_last_settings(replace(view, camera_of="guess"), settings)
    assert first.settings == Settings()
    assert first.notes[0].startswith("No camera is known")
    assert first.notes[1].startswith("The last settings")
    assert words in first.note
    assert analyse(first).estimate.status == "ok"


@pytest.mark.parametrize("settings", [Settings(), Settings(method="fixed", level=100), Settings(method="otsu")])
def test_last_settings_that_show_the_dock_are_taken(view, settings):
    first = with_last_settings(view, settings)
    assert (first.settings, first.note) == (settings, "")


def test_last_settings_stay_where_no_others_show_a_dock_either(view):
    dark = replace(view, image=np.zeros_like(view.image))
    settings = Settings(method="fixed", level=200)
    assert with_last_settings(dark, settings).settings == settings


def test_the_last_uploaded_picture_is_back_at_the_next_start(tmp_path, view):
    image = np.full((30, 40), 7, np.uint8)
    image[3, 4] = 200
    shown = state.with_upload(view, cv2.imencode(".png", image)[1].tobytes(), "tank 3.png")
    first = Memory(tmp_path)
    first.keep_picture(shown)
    first.write()
    back = Memory(tmp_path).last_view(view.tank)
    assert (back.item, back.list_name) == ("tank 3.png", "uploads")
    np.testing.assert_array_equal(back.image, image)


def test_a_sample_is_back_and_a_lost_picture_is_left_out(tmp_path, view):
    first = Memory(tmp_path)
    assert first.last_view(view.tank) is None
    first.keep_picture(state.with_sample(view, "tilted"))
    first.write()
    assert Memory(tmp_path).last_view(view.tank).sample == "tilted"
    first.change(sample=None, upload="gone.png")
    first.write()
    assert Memory(tmp_path).last_view(view.tank) is None


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.skipif(os.name != "posix", reason="owners and modes of files are POSIX")
def test_what_the_page_keeps_is_its_owners_alone_also_where_it_was_not(tmp_path, view):
    folder = tmp_path / "config"
    folder.mkdir(mode=0o755)
    (folder / "last.yaml").write_text("dark: true")
    for path, wide in ((folder, 0o755), (folder / "last.yaml", 0o644)):
        path.chmod(wide)
    kept = Memory(folder)
    assert kept.now.dark
    assert (mode(folder), mode(folder / "last.yaml")) == (0o700, 0o600)
    (folder / "last-picture.new").write_text("left by a run that was killed")
    (folder / "last-picture.new").chmod(0o666)
    png = cv2.imencode(".png", np.eye(9, dtype=np.uint8))[1].tobytes()
    kept.keep_picture(state.with_upload(view, png, "a.png"))
    Tanks(folder).save(view.tank, "Pool")
    assert len(list(folder.iterdir())) == 3
    assert {mode(path) for path in folder.iterdir()} == {0o600}
    Memory(tmp_path / "new").change(dark=True)
    assert (mode(tmp_path / "new"), mode(tmp_path / "new" / "last.yaml")) == (0o700, 0o600)


def test_another_picture_or_forgetting_deletes_the_one_that_was_kept(tmp_path, view):
    png = cv2.imencode(".png", np.eye(9, dtype=np.uint8))[1].tobytes()
    for forget in (Memory.forget_picture, lambda kept: kept.keep_picture(state.with_sample(view, "tilted"))):
        kept = Memory(tmp_path)
        kept.keep_picture(state.with_upload(view, png, "a.png"))
        assert (tmp_path / "last-picture.png").exists()
        forget(kept)
        assert not (tmp_path / "last-picture.png").exists()
        kept.write()
        again = Memory(tmp_path)
        assert again.now.upload is None
        assert "a.png" not in (tmp_path / "last.yaml").read_text()


def test_a_picture_that_cannot_be_deleted_is_named(tmp_path):
    (tmp_path / "last-picture.png").mkdir()
    with pytest.raises(UserError, match=r"last-picture\.png: the last picture cannot be deleted"):
        Memory(tmp_path).forget_picture()


def test_forgotten_uploads_are_nowhere_any_more(tmp_path):
    """Neither on the disk, nor in memory, nor at the next start."""
    options = Options(remember_in=tmp_path)
    with App(options=options) as app:
        png = cv2.imencode(".png", np.eye(300, dtype=np.uint8) * 200)[1].tobytes()
        source = app._layout.of(SourcePanel)
        app.change(lambda shown: source._with_new_upload(shown, png, "mine.png"), reload=True)
        assert app.wait_until_idle(60)
        assert (tmp_path / "last-picture.png").exists()
        shown = weakref.ref(app.view.image)
        frees, client = f"{app.kept.kept_bytes / 2**20:.1f} MB", Mock()
        assert source._forget.label == f"Forget uploads ({frees})"
        source._forget_uploads(client)
        assert app.wait_until_idle(60)
        assert f"which frees {frees} of memory" in client.add_notification.call_args.args[1]
        assert app.kept.kept_bytes == 0
        assert not source._forget.visible
        gc.collect()
        assert shown() is None
    assert not any(b"mine.png" in path.read_bytes() for path in tmp_path.iterdir())
    assert not (tmp_path / "last-picture.png").exists()
    again = App(options=options)
    again.stop()
    assert again.view.list_name == "samples"
