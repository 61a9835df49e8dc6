import json
import os
import re
import socket
from importlib.metadata import PackageNotFoundError

import cv2
import pytest
from dockpose.app.cli import main
from dockpose.app.commands import doctor
from dockpose.app.commands.doctor import BROKEN, OK, WARNING, Finding


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A folder to work in, in the home of somebody whose name is secret."""
    home = tmp_path / "secret-name"
    (home / "work").mkdir(parents=True)
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.chdir(home / "work")
    return home


def found(check):
    return {one.check: one for one in check()}


def test_a_line_for_each_finding_and_nothing_secret(home, monkeypatch, capsys):
    monkeypatch.setattr(cv2, "VideoCapture", lambda *arguments: pytest.fail("a camera was opened"))
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "nothing is broken"
    assert {line.split()[0] for line in lines[:-1]} <= {OK, WARNING}
    names = [line[8:].split("  ")[0].strip() for line in lines[:-1]]
    for name in ("dockpose", "python", "system", "numpy", "viser", "numba", "av", "pictures", "videos", "cameras"):
        assert name in names
    for name in ("port", "temporary folder", "sessions", "settings", "opencv", "self test"):
        assert name in names
    text = "\n".join(lines)
    assert "secret-name" not in text
    assert "~/work/dockpose-sessions can be written" in text
    assert re.search(r"expected (\(0\.060, -0\.040, 1\.100\) m), found \1, off by 0\.\d+ mm", text)
    assert list(home.rglob("*")) == [home / "work"]


def test_json_has_a_line_for_each(home, capsys):
    assert main(["doctor", "--json", "-"]) == 0
    lines = {line["check"]: line for line in map(json.loads, capsys.readouterr().out.splitlines())}
    assert lines["self test"].keys() == {"check", "state", "text"}
    assert (lines["self test"]["state"], lines["self test"]["text"][:12]) == ("ok", "sample plain")


def test_a_wrong_pose_is_broken_and_so_is_the_exit_status(home, monkeypatch, capsys):
    real = doctor.load_sample("tilted")
    monkeypatch.setattr(doctor, "load_sample", lambda name: None)
    monkeypatch.setattr(doctor, "CHECKS", {"self test": doctor._self_test})
    assert main(["doctor"]) == 1  # the check itself raises
    monkeypatch.undo()
    right = doctor.load_sample("plain")
    other = type(right)(**{**vars(real), "truth": right.truth})
    monkeypatch.setattr(doctor, "load_sample", lambda name: other)
    monkeypatch.setattr(doctor, "CHECKS", {"self test": doctor._self_test})
    assert main(["doctor"]) == 1
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("broken  self test            AttributeError: ")
    assert told[1] == "1 broken, see above"
    assert told[2].startswith("broken  self test            sample plain: expected (0.060, ")


def test_one_check_that_fails_leaves_the_others(home, monkeypatch):
    def fails():
        yield Finding("first", OK, "there")
        raise OSError(f"no way to\n{home}")

    monkeypatch.setattr(doctor, "CHECKS", {"a": fails, "b": doctor._port})
    states = [(one.check, one.state, one.text) for one in doctor.findings()]
    assert states[:2] == [("first", OK, "there"), ("a", BROKEN, r"OSError: no way to\n~")]
    assert states[2][0] == "port"


def test_a_port_that_is_taken_is_told(monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setattr(doctor, "DEFAULT_PORT", taken.getsockname()[1])
        finding = found(doctor._port)["port"]
    assert finding.state == WARNING
    assert "is taken; dockpose serve --port " in finding.text


def test_folders_that_cannot_be_written(tmp_path):
    file = tmp_path / "file"
    file.touch()
    # A file where a folder should be stops root too.
    finding = doctor._writable("sessions", file / "below", WARNING, "; advice")
    assert (finding.state, finding.text.endswith("cannot be written (Not a directory); advice")) == (WARNING, True)
    assert doctor._writable("sessions", tmp_path / "new" / "below", BROKEN, "").state == OK
    assert list(tmp_path.iterdir()) == [file]


def test_decoders_that_are_missing(monkeypatch):
    monkeypatch.setattr(doctor, "_PICTURES", ("png", "zzz"))
    monkeypatch.setattr(doctor, "_VIDEOS", ("ffv1", "zzz"))
    told = [(one.check, one.state, one.text) for one in doctor._decoders()]
    text = "can be read; zzz cannot"
    assert told == [("pictures", WARNING, f"png {text}"), ("videos", WARNING, f"ffv1 {text}")]
    monkeypatch.setattr(doctor, "_NEEDED_DECODERS", {"zzz"})
    assert [one.state for one in doctor._decoders()] == [BROKEN, BROKEN]


@pytest.mark.parametrize(
    ("installed", "state", "ending"),
    [
        (["opencv-python-headless"], OK, "; opencv-python-headless"),
        (["opencv-python"], OK, "; opencv-python"),
        (["opencv-python-headless", "opencv-python"], WARNING, "uninstall all of them, then install one"),
        ([], WARNING, cv2.__version__),
    ],
)
def test_builds_of_opencv_that_overwrite_each_other_are_told(monkeypatch, installed, state, ending):
    def version(package):
        if package.startswith("opencv") and package not in installed:
            raise PackageNotFoundError(package)
        return "5.0"

    monkeypatch.setattr(doctor, "version", version)
    finding = found(doctor._versions)["opencv"]
    assert (finding.state, finding.text.endswith(ending)) == (state, True)


def test_a_package_that_is_missing_is_broken_unless_it_is_optional(monkeypatch):
    def version(package):
        if package != "dockpose":
            raise PackageNotFoundError(package)
        return "1.0"

    monkeypatch.setattr(doctor, "version", version)
    findings = found(doctor._versions)
    assert (findings["numpy"].state, findings["pandas"].state) == (BROKEN, OK)


@pytest.mark.skipif(not os.path.isdir("/dev"), reason="cameras are listed in /dev alone")
def test_cameras_are_listed_by_name(monkeypatch):
    monkeypatch.setattr(doctor.Path, "glob", lambda self, pattern: [self / "video7"] if pattern == "video*" else [])
    assert found(doctor._cameras)["cameras"].text.startswith("/dev/video7 (no name")
