"""YAML within limits: each bad file is refused at once, in one short sentence that names it."""

import os
import time

import pytest
from dockpose.files import MOST_BYTES, FileError, GrowingFile, parse_yaml, read_small, read_yaml, to_yaml, write_whole
from hypothesis import given
from hypothesis import strategies as st

REPEATED = "a: &a {x: 1}\n" + "".join(
    f"b{i}: &b{i} {{<<: [*{before}, *{before}]}}\n" for i, before in enumerate(["a", *(f"b{i}" for i in range(24))])
)
LAUGHS = "b0: &b0 [1, 1]\n" + "".join(f"b{i}: &b{i} [*b{i - 1}, *b{i - 1}]\n" for i in range(1, 30))

BAD = {
    "a day that is not": ("date: 2026-02-30", "'2026-02-30' is no timestamp"),
    "no truth value": ("a: !!bool xyz", "'xyz' is no bool"),
    "an empty number": ('a: !!int ""', "'' is no int"),
    "5,000 digits": ("a: " + "9" * 5000, "is no int"),
    "deep nesting": ("a: " + "[" * 20_000, "levels of nesting"),
    "merges of merges": (REPEATED, "values"),
    "aliases of aliases": (LAUGHS, "values"),
    "many values": ("a: [" + "1," * 100_000 + "]", "values"),
    "a value in itself": ("a: &a [*a]", "contains itself"),
    "a key twice": ("fx_px: 700\nfx_px: 800", "line 2 (the key 'fx_px' is there twice)"),
    "a long line": ('a: "' + "x" * 140_000 + '"\nb: [', "line 2"),
    "a character that is none": ('a: "\\UFFFFFFFF"', "is not valid YAML"),
    "a set of a list": ("a: !!set [1]", "is not valid YAML"),
    "code": ("a: !!python/object/apply:os.system [ls]", "is not valid YAML"),
    "two documents": ("a: 1\n---\nb: 2", "line 2"),
    "a number for a key": ("1: 2", "keys must be text"),
    "a list": ("[1, 2]", "its top is list"),
    "nothing": ("", "holds no keys"),
}


@pytest.mark.parametrize(("text", "why"), BAD.values(), ids=BAD.keys())
def test_a_bad_file_is_refused_in_one_short_sentence(text, why):
    start_s = time.process_time()
    with pytest.raises(FileError) as raised:
        parse_yaml(text.encode(), "scene.yaml")
    message = str(raised.value)
    assert message.startswith("scene.yaml: ")
    assert why in message
    assert "\n" not in message
    assert len(message) < 400
    assert time.process_time() - start_s < 5  # seconds: some of these took minutes


def test_what_is_right_is_read():
    text = "a: {x: 1, y: [1.5, true, null]}\nb: &b {x: 1}\nc: {<<: *b, x: 2}\nd: [*b, *b]"
    assert parse_yaml(text.encode(), "f") == {
        "a": {"x": 1, "y": [1.5, True, None]},
        "b": {"x": 1},
        "c": {"x": 2},
        "d": [{"x": 1}, {"x": 1}],
    }


@pytest.mark.parametrize(
    ("text", "value"), [("0700", 700), ("007.5", 7.5), ("7e2", 700), ("7.0e2", 700), ("-.5", -0.5), ("1:30", "1:30")]
)
def test_a_number_is_what_its_digits_say(text, value):
    assert parse_yaml(f"a: {text}".encode(), "f") == {"a": value}


@given(st.one_of(st.floats(), st.integers(), st.text("0123456789.:eExob_+-", max_size=6)))
def test_what_is_written_is_read_again(value):
    assert repr(parse_yaml(to_yaml({"a": value}).encode(), "f")) == repr({"a": value})


def test_opencvs_own_spelling_is_read():
    text = "%YAML:1.0\n---\nm: !!opencv-matrix\n  rows: 1\n  cols: 1\n  dt: d\n  data: [ 2. ]\n"
    assert parse_yaml(text.encode(), "f")["m"]["data"] == [2.0]


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "c.yaml").write_bytes(b"a: 1\n" + b"#" * MOST_BYTES)
    with pytest.raises(FileError, match=r"c\.yaml: has more than the 0\.3 MB"):
        read_yaml(tmp_path / "c.yaml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_and_a_device_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", tmp_path):
        with pytest.raises(FileError, match=r"not a regular file|directory|denied"):
            read_small(path, 100)


def test_a_missing_file_and_a_name_that_cannot_be(tmp_path):
    for path in (tmp_path / "none.yaml", "a\x00b"):
        with pytest.raises(FileError, match="cannot be read"):
            read_yaml(path)


def test_a_growing_file_is_cut_back_to_what_is_whole(tmp_path):
    file = GrowingFile(tmp_path / "lines.csv")
    file.write(b"whole\n")
    file.mark()
    file.write(b"hal")
    assert "kept" in file.cut()
    assert file.path.read_bytes() == b"whole\n"


def test_a_growing_file_of_which_nothing_is_whole_goes(tmp_path):
    file = GrowingFile(tmp_path / "lines.csv")
    file.write(b"hal")
    assert "nothing" in file.cut()
    assert not file.path.exists()


@pytest.mark.skipif(os.name == "nt", reason="files have no such modes there")
def test_what_is_replaced_keeps_its_mode_and_what_is_new_follows_the_umask(tmp_path):
    (tmp_path / "secret").write_bytes(b"old")
    (tmp_path / "secret").chmod(0o600)
    (tmp_path / "link").symlink_to("secret")
    before = os.umask(0o027)
    try:
        for name in ("secret", "link", "new"):
            write_whole(tmp_path / name, name.encode())
    finally:
        os.umask(before)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "secret").read_bytes() == b"link"
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("secret", "new")] == [0o600, 0o640]
