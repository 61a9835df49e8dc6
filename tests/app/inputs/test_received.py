"""What browsers send and name: files, a folder's pictures, and names made from text."""

import os
import unicodedata

import pytest
from dockpose.app.errors import UserError
from dockpose.app.export.bundle import bundle_name
from dockpose.app.inputs.received import LONGEST_BYTES, UploadStore, below, folders_below, pictures_in, safe_name, step
from hypothesis import given
from hypothesis import strategies as st

# What the three systems refuse or change, from their own documentation.
FORBIDDEN = set('<>:"/\\|?*') | {chr(code) for code in range(32)} | {"\x7f"}
DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{port}{digit}" for port in ("COM", "LPT") for digit in "0123456789¹²³")}


def test_oldest_uploads_make_room():
    uploads = UploadStore()
    for name in ("a", "b", "c"):
        uploads.add(name, b"12345")
    uploads.add("a", b"123")
    assert uploads.names() == ["b", "c", "a"]
    uploads.make_room(8)
    assert uploads.names() == ["c", "a"]
    assert uploads.kept_bytes == 8
    with pytest.raises(UserError, match="b is no longer kept"):
        uploads.get("b")
    uploads.make_room(0)
    assert uploads.kept_bytes == 0


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("tank 7", "tank_7.png"),
        ("Becken Köln", "Becken_Köln.png"),
        ("水槽", "水槽.png"),
        ("con", "con_.png"),
        ("LPT1", "LPT1_.png"),
        ("COM¹", "COM¹_.png"),
        ("nul.tar.gz", "nul_tar_gz.png"),
        ("..", "picture.png"),
        ("", "picture.png"),
        ("a. . ", "a.png"),
        ("../../etc/passwd", "etc_passwd.png"),
        ("a\x00b\nc", "a_b_c.png"),
        ("-rf", "rf.png"),
        ("e\u0301", "é.png"),
        ("ü" * 100, "ü" * 30 + ".png"),
        ("\ud800", "picture.png"),
    ],
)
def test_known_names(text, name):
    assert safe_name(text, ".png") == unicodedata.normalize("NFC", name)


@given(st.text(), st.lists(st.text(max_size=3), max_size=3))
def test_any_text_gives_a_name_that_every_system_takes(text, others):
    taken = [safe_name(other, ".png") for other in others]
    name = safe_name(text, ".png", taken=taken)
    stem = name.removesuffix(".png")
    assert name.endswith(".png")
    assert stem
    assert not set(name) & FORBIDDEN
    assert stem.split(".")[0].upper() not in DEVICES
    assert not name.startswith((".", "-", " "))
    assert not stem.endswith((".", " "))
    assert len(stem.encode("utf-8")) <= LONGEST_BYTES + 1  # a device's name gets one more
    assert unicodedata.normalize("NFC", name) == name
    assert name.lower() not in {other.lower() for other in taken}


def test_names_that_differ_in_case_only_do_not_collide():
    assert safe_name("Tank", ".png", taken=["tank.PNG"]) == "Tank-2.png"
    assert safe_name("x" * 99, ".png", taken=["x" * 60 + ".png"]) == "x" * 58 + "-2.png"


@pytest.mark.parametrize(
    ("source", "name"),
    [
        ("plain", "dockpose_plain.zip"),
        ("tank 7.png", "dockpose_tank_7.zip"),
        ("../../etc/passwd", "dockpose_passwd.zip"),
        ("C:\\Users\\me\\tank.png", "dockpose_tank.zip"),
        ("<img>.png", "dockpose_img.zip"),
        ("", "dockpose_picture.zip"),
    ],
)
def test_a_bundle_is_called_after_its_picture(source, name):
    assert bundle_name(source) == name


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


OUTSIDE = ["..", "../secret/key.png", "run 1/../../secret", "/etc/passwd", "way out", "way out/key.png", "key.png"]


@pytest.mark.parametrize("name", [*OUTSIDE, "nowhere.png", "a\x00b", "x" * 5000])
def test_no_way_leads_above_the_root_or_to_what_is_not_there(root, name):
    with pytest.raises(UserError, match=r"below the folder|not in the folder" if name in OUTSIDE else "not in the"):
        below(root, name)


def test_steps_end_at_both_ends():
    names = ["a", "b", "c"]
    assert [step(names, "b", by) for by in (-1, 1, 2)] == ["a", "c", None]
    assert step(names, "a", -1) is None
    assert step(names, "gone", 1) is None
