"""What several commands are given: lengths, cameras, and where events go."""

import argparse
import logging
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from dockpose import Camera
from dockpose.app.cli import COMMANDS, _parser, main
from dockpose.app.commands.arguments import camera_of, logged, metres
from dockpose.app.commands.console import say
from dockpose.app.errors import UserError
from dockpose.camera.files import save_camera
from dockpose.text import without_secrets

from tests.support.methods import registered


@pytest.mark.parametrize(
    ("text", "expected"), [("0.3", 0.3), ("5", 5), ("30cm", 0.3), ("300 mm", 0.3), ("30m", 30), ("3e-1", 0.3)]
)
def test_diameters_are_in_metres_or_have_a_unit(text, expected):
    assert metres(text) == pytest.approx(expected)


@pytest.mark.parametrize("text", ["abc", "30 inch", "", "cm"])
def test_what_is_no_length_is_refused(text):
    with pytest.raises(UserError, match="must be a length"):
        metres(text)


@pytest.mark.parametrize("command", ["estimate", "compare", "serve", "export"])
def test_a_large_bare_diameter_is_asked_about(command, refusal, tmp_path):
    out = ["--out", str(tmp_path / "out")] if command == "export" else []
    told = refusal(command, "x.png", "--dock-diameter", "30", *out)
    assert "centimetres?" in told
    assert "write 0.3, or 30m" in told


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["dive.mp4", "--exposure", "120"], "--exposure is for a camera, as 0 or /dev/video0; dive.mp4 is not"),
        (["0", "--exposure", "nan"], "--exposure is nan; it must be a number"),
        (["0", "--gain", "inf"], "--gain is inf; it must be a number"),
        (["0", "--fps", "0"], "--fps is 0; it must be above 0 and at most 1000"),
        (["0", "--format", "JPEG2000"], "--format JPEG2000: must be the three or four letters"),
    ],
)
@pytest.mark.parametrize("command", ["estimate", "serve"])
def test_what_no_camera_can_be_asked_for_is_refused(command, words, sentence, refusal):
    assert sentence in refusal(command, *words)


LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (DEBUG|INFO|WARNING|ERROR) dockpose(\.\w+)*: .+")


def parsed(*words):
    return _parser("doctor").parse_args(["doctor", *words])


def test_events_are_one_line_each_without_secrets(tmp_path):
    path = tmp_path / "events.log"
    with logged(parsed("--log-file", str(path))):
        say("the page is at http://127.0.0.1:8080/?token=5ecret&view=1")
        logging.getLogger("dockpose.app.web").warning("lost rtsp://diver:5ecret@tank/front\n\x1b[2J")
        logging.getLogger("dockpose").debug("not wanted")
        try:
            raise ValueError("a\nb")
        except ValueError:
            logging.getLogger("dockpose").exception("refused: Cookie: dockpose=5ecret")
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) == 3
    assert all(LINE.fullmatch(line) for line in lines)
    assert "5ecret" not in "".join(lines)
    assert "rtsp://***@tank/front\\n\\x1b[2J" in lines[1]
    logging.getLogger("dockpose").info("after the command")
    assert len(path.read_text(encoding="utf-8").splitlines()) == 3


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/?token=abc", "/?token=***"),
        ("?a=1&access_token=abc&b=2", "?a=1&access_token=***&b=2"),
        ("rtsp://me:word@host:554/x", "rtsp://***@host:554/x"),
        ("http://host/a@b", "http://host/a@b"),
        ("http://host:80/a@b", "http://host:80/a@b"),
        ("rtsp://me:w@r/d@host/x", "rtsp://***@host/x"),
        ("rtsp://host/user=me_password=word_channel=1", "rtsp://host/user=me_password=***"),
        ("http://host/v.cgi?loginuse=me&loginpas=word&n=1", "http://host/v.cgi?loginuse=me&loginpas=***&n=1"),
        ("http://host/v?user=me&pwd=word", "http://host/v?user=me&pwd=***"),
        ("the key is wrong", "the key is wrong"),
    ],
)
def test_what_counts_as_secret(text, left):
    assert without_secrets(text) == left


def test_level_decides_and_standard_error_hears_nothing_twice(capsys):
    with logged(parsed("--log-level", "warning")):
        say("said")
        logging.getLogger("dockpose").info("too low")
        logging.getLogger("dockpose").warning("an event")
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "dockpose: said"
    assert [line.partition("WARNING ")[2] for line in lines[1:]] == ["dockpose: an event"]


def test_every_command_has_them_and_tells_how_it_ended(tmp_path, capsys):
    for command in COMMANDS:
        with pytest.raises(SystemExit):
            main([command, "--help"])
        assert "--log-file" in capsys.readouterr().out, command
    path = tmp_path / "events.log"
    assert main(["export", "nowhere.png", "--out", str(tmp_path / "x.csv"), "--log-file", str(path)]) == 1
    told = [line.split(" ", 1)[1] for line in path.read_text(encoding="utf-8").splitlines()]
    assert told[0].startswith("INFO dockpose: export begins")
    assert told[1].startswith("ERROR dockpose: nowhere.png")
    assert told[2] == "INFO dockpose: export ends with status 1"


def test_a_camera_file_without_a_size_is_for_the_first_picture_or_the_size_that_is_given(tmp_path, capsys):
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((48, 64), np.uint8))
    path = tmp_path / "c.json"
    path.write_text('{"mtx": [[70, 0, 32], [0, 70, 24], [0, 0, 1]], "dist": [0, 0, 0, 0, 0]}')
    given = {"camera": str(path), "sources": [str(tmp_path / "a.png")]}
    camera = camera_of(argparse.Namespace(**given))
    assert (camera.width, camera.height) == (64, 48)
    assert "it is taken for these, 64 x 48" in capsys.readouterr().err
    camera = camera_of(argparse.Namespace(**given, camera_size="72x54"))
    assert camera.width == 72
    assert capsys.readouterr().err == ""
    for more in ({"sources": ["0"]}, {"camera_size": "wide"}, {"camera_size": "128x96"}):
        with pytest.raises(UserError, match="--camera"):
            camera_of(argparse.Namespace(**given | more))


def test_a_size_that_differs_from_that_of_the_file_is_refused(tmp_path):
    save_camera(Camera(70, 70, 32, 24, 64, 48), tmp_path / "c.yaml")
    with pytest.raises(UserError, match=r"--camera-size 32x24: .* is for 64 x 48 pixels"):
        camera_of(argparse.Namespace(camera=str(tmp_path / "c.yaml"), camera_size="32x24"))


def test_help_names_methods_of_ones_own(capsys):
    with registered(mine=("Mine", lambda grey: 100)), pytest.raises(SystemExit):
        main(["estimate", "--help"])
    assert " mine, fixed" in " ".join(capsys.readouterr().out.split())


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is always full")
def test_a_log_that_the_disk_has_no_room_for_is_said_and_counts(capsys):
    assert main(["doctor", "--log-file", "/dev/full"]) == 1
    assert "--log-file /dev/full: events are missing in it (the disk is full)" in capsys.readouterr().err
