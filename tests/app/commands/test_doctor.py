import json
import re
from dataclasses import replace
from importlib.metadata import PackageNotFoundError

import cv2
import pytest
from dockpose.app.cli import main
from dockpose.app.commands import doctor
from dockpose.app.commands.doctor import BROKEN, OK, WARNING, Finding
from dockpose.pose.known import KnownPose


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


def test_a_line_for_each_finding_and_nothing_secret(home, capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "nothing is broken"
    assert {line.split()[0] for line in lines[:-1]} <= {OK, WARNING}
    names = [line[8:].split("  ")[0].strip() for line in lines[:-1]]
    for name in ("dockpose", "python", "system", "numpy", "viser", "numba", "av", "pictures", "videos"):
        assert name in names
    assert {"opencv", "self test"} <= set(names)
    text = "\n".join(lines)
    assert "secret-name" not in text
    assert re.search(r"sample plain: the pose is off by 0\.\d+ mm and 0\.\d+ deg", text)
    assert list(home.rglob("*")) == [home / "work"]


def test_json_has_a_line_for_each(home, capsys):
    assert main(["doctor", "--json", "-"]) == 0
    lines = {line["check"]: line for line in map(json.loads, capsys.readouterr().out.splitlines())}
    assert lines["self test"].keys() == {"check", "state", "text"}
    assert (lines["self test"]["state"], lines["self test"]["text"][:12]) == ("ok", "sample plain")


def test_a_wrong_pose_is_broken_and_so_is_the_exit_status(home, monkeypatch, capsys):
    right = doctor.load_sample("plain")
    other = replace(right, truth=KnownPose((0.06, -0.04, 1.2), 6.0, -12.0))  # 10 cm farther away than it is
    monkeypatch.setattr(doctor, "CHECKS", {"self test": doctor._self_test})
    for sample, told in (
        (None, "AttributeError: "),
        (other, "sample plain: the pose is off by "),
    ):
        monkeypatch.setattr(doctor, "load_sample", lambda name, sample=sample: sample)
        assert main(["doctor"]) == 1
        first, last = capsys.readouterr().out.splitlines()
        assert first.startswith(f"broken  self test            {told}")
        assert last == "1 broken, see above"


def test_one_check_that_fails_leaves_the_others(home, monkeypatch):
    def fails():
        yield Finding("first", OK, "there")
        raise OSError(f"no way to\n{home}")

    monkeypatch.setattr(doctor, "CHECKS", {"a": fails, "b": doctor._decoders})
    states = [(one.check, one.state, one.text) for one in doctor.findings()]
    assert states[:2] == [("first", OK, "there"), ("a", BROKEN, r"OSError: no way to\n~")]
    assert states[2][0] == "pictures"


def test_decoders_that_are_missing(monkeypatch):
    monkeypatch.setattr(doctor, "_DECODERS", {"pictures": ("png", "zzz"), "videos": ("ffv1", "zzz")})
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
