import hashlib
import ipaddress
import shutil
from pathlib import Path

import pytest
from dockpose.app.cli import main
from dockpose.app.commands import console
from dockpose.app.commands import serve as command
from dockpose.app.export import mavlink
from dockpose.app.web import app as web_app
from dockpose.app.web.app import App
from dockpose.app.web.panels.source import SourcePanel
from dockpose.app.web.server.start import reachable_hosts
from dockpose.sidecar import sample_path


@pytest.fixture
def told_by(monkeypatch, capsys):
    """What is told by a service that is interrupted at once."""
    monkeypatch.setattr(command.threading, "Event", lambda: (_ for _ in ()).throw(KeyboardInterrupt))
    monkeypatch.setattr(web_app, "App", lambda *_, **__: FakeApp())

    def told_by(*words):
        assert main(["serve", *words]) == 0
        return [line.removeprefix("dockpose: ") for line in capsys.readouterr().err.splitlines()]

    return told_by


def test_serve_tells_the_address_and_stops_on_interrupt(told_by):
    told = told_by()
    assert "http://127.0.0.1:1234" in told[0]
    assert told[-1] == "stopped"
    assert FakeApp.stopped


def test_a_sigterm_that_was_lost_on_its_way_ends_it_all_the_same(monkeypatch, capsys):
    monkeypatch.setattr(web_app, "App", lambda *_, **__: FakeApp())
    monkeypatch.setattr(console, "_asked", [])
    monkeypatch.setattr(FakeApp, "addresses", lambda self: console._asked.append(console.Terminated) or ["http://a"])
    assert main(["serve"]) == console.EXIT_TERMINATED
    assert "ended by SIGTERM" in capsys.readouterr().err


def test_serving_to_others_says_what_that_means(told_by):
    told = told_by("--host", "0.0.0.0")
    assert told[1] == "from another machine: http://192.0.2.7:1234/?token=steering"
    assert "every machine of that network" in told[2]


def test_addresses_of_a_wildcard_are_those_of_this_machine():
    here, *elsewhere = reachable_hosts("0.0.0.0")
    assert here == "127.0.0.1"
    assert all(ipaddress.ip_address(name) for name in elsewhere)
    assert "0.0.0.0" not in elsewhere
    assert reachable_hosts("tank.example.org") == ["tank.example.org"]
    assert reachable_hosts("::1") == ["[::1]"]


class FakeApp:
    stopped = False

    def addresses(self):
        return ["http://127.0.0.1:1234/?token=steering", "http://192.0.2.7:1234/?token=steering"]

    def stop(self):
        FakeApp.stopped = True


@pytest.fixture
def tank(tmp_path):
    """Three pictures in a folder, the first two with their YAML."""
    for name, sample in (("frame2", "plain"), ("frame10", "tilted")):
        for ending in (".png", ".yaml"):
            shutil.copy(sample_path(sample).with_suffix(ending), tmp_path / f"{name}{ending}")
    shutil.copy(sample_path("tilted"), tmp_path / "last.png")
    return tmp_path


def test_pages_of_a_picture_that_is_served_turn_in_its_folder_and_have_checksums(tank):
    app = App(str(tank / "frame2.png"))
    try:
        source = app._layout.of(SourcePanel)
        seen = [app.view]
        for by in (1, 1, 1, -1):
            source.turn(by, None)  # pyright: ignore[reportArgumentType]  # no browser is told anything
            seen.append(app.view)
    finally:
        app.stop()
    assert [view.source for view in seen] == ["frame2.png", "frame10.png", "last.png", "last.png", "frame10.png"]
    for view in seen:
        assert view.sha256 == hashlib.sha256((tank / view.source).read_bytes()).hexdigest()
    assert seen[1].truth is not None


def test_an_autopilot_is_told_where_the_camera_sits(tmp_path, monkeypatch, told_by):
    (tmp_path / "v.yaml").write_text("T_body_camera: {position_m: [0.2, 0, 0]}\nframe: flu")
    told = []
    monkeypatch.setattr(mavlink, "Autopilot", lambda *given, is_on, **_: told.append((given[4], is_on)))
    told_by("rtp://:5600", "--mavlink", "udpout:127.0.0.1:9", "--vehicle", str(tmp_path / "v.yaml"))
    ((vehicle, is_on),) = told
    assert (vehicle.T_body_camera.position_m, vehicle.frame) == ((0.2, 0.0, 0.0), "flu")
    assert not is_on


def test_the_page_is_told_where_the_camera_sits_without_an_autopilot_too(tmp_path, monkeypatch, told_by):
    (tmp_path / "v.yaml").write_text("T_body_camera: {position_m: [0.2, 0, 0]}\nframe: flu")
    given = []
    monkeypatch.setattr(web_app, "App", lambda *arguments: given.append(arguments[-1]) or FakeApp())
    told_by("--vehicle", str(tmp_path / "v.yaml"))
    assert given[0].vehicle.T_body_camera.position_m == (0.2, 0.0, 0.0)
    assert given[0].autopilot is None


def given_options(monkeypatch, told_by, *words):
    given = []
    monkeypatch.setattr(web_app, "App", lambda *arguments: given.append(arguments) or FakeApp())
    told_by(*words)
    return given[0]


def test_variables_are_settings_and_words_have_precedence(monkeypatch, told_by):
    for name, value in {
        **{"SOURCE": "rtp://:5600", "ALLOW_HOST": "blueos.local 192.168.2.2", "ALLOW_FRAME": "http://blueos.local"},
        **{"PORT": "8123", "RESUME": "1", "CAMERA": ""},
    }.items():
        monkeypatch.setenv(f"DOCKPOSE_{name}", value)
    source, _, _, _, port, options = given_options(monkeypatch, told_by, "--allow-host", "tank.example.org")
    assert (source, port) == ("rtp://:5600", 8123)
    assert options.allow_hosts == ("blueos.local", "192.168.2.2", "tank.example.org")
    assert options.allow_frames == ("http://blueos.local",)
    assert options.resume
    monkeypatch.setenv("DOCKPOSE_RESUME", "0")
    source, _, _, _, port, options = given_options(monkeypatch, told_by, "plain", "--port", "8124")
    assert (Path(source).stem, port, options.resume) == ("plain", 8124, False)


def test_a_variable_that_names_no_setting_is_said(monkeypatch, refusal):
    monkeypatch.setenv("DOCKPOSE_ALOW_HOST", "blueos.local")
    assert "DOCKPOSE_ALOW_HOST: there is no such setting" in refusal("serve")


@pytest.mark.parametrize(
    "origin",
    ["*", "blueos.local", "http://blueos.local/", "http://blueos.local; script-src *", "http://*.local", "http://"],
)
def test_who_may_frame_the_page_is_one_origin(origin, refusal):
    """It goes into a header, where a blank or a semicolon would let others in."""
    assert f"--allow-frame {origin}: must be an origin" in refusal("serve", "--allow-frame", origin)


def test_what_cannot_be_served_is_said(tmp_path, refusal):
    assert refusal("gone.png", status=1)
    for words in (["serve", "--folder", str(tmp_path / "none")], ["serve", "--port", "70000"]):
        assert refusal(*words)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--mavlink", "udpout:127.0.0.1:14550"], "give a camera or a stream"),
        (["plain", "--mavlink", "udpout:127.0.0.1:14550"], "give a camera or a stream"),
        (["rtp://:5600", "--mavlink", "there"], "--mavlink there: write it as udpout:127.0.0.1:14550"),
        (["rtp://:5600", "--mavlink", "udpout:127.0.0.1:9", "--mavlink-send", "all"], "--mavlink-send all: may be"),
        (["--vehicle", "gone.yaml"], "--vehicle: gone.yaml"),
    ],
)
def test_an_autopilot_that_cannot_be_is_said(refusal, words, why):
    assert why in refusal("serve", *words)
