import re
from dataclasses import replace
from importlib.metadata import PackageNotFoundError

import pytest
from dockpose.app.cli import main
from dockpose.app.commands import doctor
from dockpose.app.commands.doctor import BROKEN, OK, WARNING
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


def test_a_line_for_each_finding_and_nothing_secret(home, capsys):
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "nothing is broken"
    assert {line.split()[0] for line in lines[:-1]} <= {OK, WARNING}
    names = {line[8:].split("  ")[0].strip() for line in lines[:-1]}
    assert {"dockpose", "python", "system", "opencv", "numpy", "viser", "numba", "av", "png", "h264"} <= names
    text = "\n".join(lines)
    assert "secret-name" not in text
    assert re.search(r"known pose +sample plain is off by 0\.\d+ mm and 0\.\d+ deg", text)
    assert list(home.rglob("*")) == [home / "work"]


def test_a_wrong_pose_is_broken_and_so_is_the_exit_status(home, monkeypatch, capsys):
    right = doctor.load_sample("plain")
    other = replace(right, truth=KnownPose((0.06, -0.04, 1.2), 6.0, -12.0))  # 10 cm farther away than it is
    monkeypatch.setattr(doctor, "CHECKS", (doctor.known_pose,))
    for sample, told in (
        (None, "known_pose           AttributeError: "),
        (other, "known pose           sample plain is off by "),
    ):
        monkeypatch.setattr(doctor, "load_sample", lambda name, sample=sample: sample)
        assert main(["doctor"]) == 1
        first, last = capsys.readouterr().out.splitlines()
        assert first.startswith(f"broken  {told}")
        assert last == "1 broken, see above"


def test_one_check_that_fails_leaves_the_others(home, monkeypatch, capsys):
    def fails():
        raise OSError(f"no way to\n{home}/work")

    monkeypatch.setattr(doctor, "CHECKS", (fails, doctor.decoders))
    assert main(["doctor"]) == 1
    first, *others = capsys.readouterr().out.splitlines()
    assert first == r"broken  fails                OSError: no way to\n~/work"
    assert others[0] == "ok      png                  can be read"


def test_decoders_that_are_missing(monkeypatch):
    monkeypatch.setattr(doctor, "_PICTURES", ("png", "zzz"))
    monkeypatch.setattr(doctor, "_VIDEOS", ("ffv1", "yyy"))
    monkeypatch.setattr(doctor, "_FEW_NEED", ("yyy",))
    assert list(doctor.decoders()) == [
        (OK, "png", "can be read"),
        (BROKEN, "zzz", "cannot be read"),
        (OK, "ffv1", "can be read"),
        (WARNING, "yyy", "cannot be read"),
    ]


def test_a_package_that_is_missing_is_broken_unless_it_is_optional(monkeypatch):
    def version(package):
        if package != "dockpose":
            raise PackageNotFoundError(package)
        return "1.0"

    monkeypatch.setattr(doctor, "version", version)
    states = {what: state for state, what, _ in doctor.versions()}
    assert (states["dockpose"], states["numpy"]) == (OK, BROKEN)
    assert "pandas" not in states
