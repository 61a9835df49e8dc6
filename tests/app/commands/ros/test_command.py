"""The node with modules that stand for rclpy: its states, topics and qualities of service."""

import sys

import pytest
from dockpose import Dock
from dockpose.app.cli import main
from dockpose.app.commands.ros.command import make_node, options_of
from dockpose.app.export.recordings.messages import TOPICS
from dockpose.app.inputs.dock_file import save_dock
from dockpose.simulate import render

from tests.support import bags, fake_rclpy
from tests.support.fake_rclpy import Return
from tests.support.scenes import CAMERA, random_scene

PICTURE, _ = render(random_scene(3))
DEFAULTS = {
    "camera_file": "",
    "dock_file": "",
    "dock_diameter_m": 0.30,
    "lights": 10,
    "method": "hats",
    "image_topic": "/camera/image_raw",
}


@pytest.fixture
def node(monkeypatch):
    fake_rclpy.install(monkeypatch)
    return make_node(DEFAULTS)


def show(node):
    node.subscriptions_["/camera/camera_info"].take(bags.camera_info(CAMERA.matrix.ravel(), (640, 480)))
    node.subscriptions_["/camera/image_raw"].take(bags.image(PICTURE, "mono8"))


def test_its_life(node):
    assert node.trigger_configure() is Return.SUCCESS
    assert set(node.publishers_) == set(TOPICS)
    assert {publisher.qos.reliability for publisher in node.publishers_.values()} == {"reliable"}
    assert node.subscriptions_ == {}
    node.trigger_activate()
    assert set(node.subscriptions_) == {"/camera/image_raw", "/camera/camera_info"}
    assert {one.qos.reliability for one in node.subscriptions_.values()} == {"best effort"}
    show(node)
    assert {topic for topic, _ in node.published} == set(TOPICS)
    node.trigger_deactivate()
    assert node.subscriptions_ == {}
    node.trigger_activate()
    show(node)
    ages = [values_of(message)["track_age"] for topic, message in node.published if topic == "/diagnostics"]
    assert ages == ["1", "1"]
    node.trigger_deactivate()
    node.trigger_cleanup()
    assert node.publishers_ == {}
    assert node.trigger_configure() is Return.SUCCESS


def values_of(message):
    return {each.key: each.value for each in message.status[0].values}


def test_messages_are_filled_in_as_rclpy_takes_them(node):
    node.trigger_configure()
    node.trigger_activate()
    show(node)
    found = dict(node.published)
    assert found["/diagnostics"].status[0].level in (b"\x00", b"\x01")
    assert len(found["/dock/pose"].pose.covariance) == 36
    assert found["/tf"].transforms[0].child_frame_id == "dock"
    assert found["/dock/image/compressed"].data[:2].tobytes() == b"\xff\xd8"


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("dock_diameter_m", 0.0, "dock_diameter_m is 0.0"),
        ("camera_file", "nowhere.yaml", "nowhere.yaml: cannot be read"),
        ("method", "best", "best"),
        ("lights", 1, "lights"),
    ],
)
def test_a_wrong_parameter_leaves_it_unconfigured(node, name, value, sentence):
    node.parameters[name] = value
    assert node.trigger_configure() is Return.FAILURE
    assert node.state == "unconfigured"
    assert sentence in node.said[0]
    node.parameters[name] = DEFAULTS[name]
    assert node.trigger_configure() is Return.SUCCESS


def test_the_command_runs_the_node_until_it_is_stopped(monkeypatch, capsys):
    def spin(node):
        assert node.state == "active"
        show(node)
        raise KeyboardInterrupt

    nodes = fake_rclpy.install(monkeypatch, spin)
    assert main(["ros", "--dock-diameter", "30cm", "--lights", "10", "--ros-args", "-r", "__ns:=/auv"]) == 0
    (node,) = nodes
    assert {topic for topic, _ in node.published} == set(TOPICS)
    assert node.state == "gone"
    assert "listens on /camera/image_raw" in capsys.readouterr().err


def test_a_dock_file_has_precedence(node, tmp_path):
    path = tmp_path / "dock.yaml"
    save_dock(Dock(0.25, 5, angles_deg=(0, 50, 100, 180, 270)), path)
    node.parameters |= {"dock_file": str(path), "dock_diameter_m": 0.0}
    assert node.trigger_configure() is Return.SUCCESS
    assert options_of(node.parameters).dock.angles_deg == (0, 50, 100, 180, 270)


def test_a_managed_node_waits(monkeypatch):
    states = []
    fake_rclpy.install(monkeypatch, lambda node: states.append(node.state))
    assert main(["ros", "--managed"]) == 0
    assert states == ["unconfigured"]


def test_what_is_missing_is_said_in_one_sentence(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main(["ros", "--dock-diameter", "0.3"]) == 2
    assert (
        capsys.readouterr().err
        == "dockpose: ros: needs ROS 2 with rclpy, which is not there; source its setup.bash first\n"
    )
    fake_rclpy.install(monkeypatch)
    assert main(["ros"]) == 2
    assert "how large is the dock?" in capsys.readouterr().err
