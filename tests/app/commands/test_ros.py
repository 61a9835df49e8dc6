"""The node's logic, with messages of a bag and without ROS."""

import sys

import pytest
from dockpose import Dock, Entrance, Settings
from dockpose.app.cli import main
from dockpose.app.commands.ros import NodeLogic, logic_of, make_node
from dockpose.app.errors import UserError
from dockpose.app.export.recordings.ros import TOPICS_OF_NODE as TOPICS
from dockpose.app.inputs.pictures import save_dock
from dockpose.simulate import render

from tests.support import bags, fake_rclpy
from tests.support.fake_rclpy import Return
from tests.support.scenes import CAMERA, DOCK, random_scene

PICTURE, TRUTH = render(random_scene(3))
INFO = bags.camera_info(CAMERA.matrix.ravel(), (640, 480))

PLAIN = set(TOPICS) - {"/dock/pose_body", "/dock/entrance"}  # of a dock without entrance, on no known vehicle


@pytest.fixture
def told():
    return []


@pytest.fixture
def logic(told):
    return NodeLogic(told.append, DOCK, Settings(), None, "/camera/image_raw")


def status_of(messages):
    (status,) = dict(messages)["/diagnostics"]["status"]
    return status


def test_a_picture_gives_all_messages_with_its_own_time_and_frame(logic):
    logic.take_camera_info(INFO)
    messages = dict(logic.take_image(bags.image(PICTURE, "mono8"), 0.0))
    assert set(messages) == PLAIN
    stamp = {"sec": bags.START_NS // 10**9, "nanosec": bags.START_NS % 10**9}
    header = messages["/dock/pose"]["header"]
    assert header["frame_id"] == "camera"
    assert header["stamp"]["sec"] == stamp["sec"]
    assert abs(header["stamp"]["nanosec"] - stamp["nanosec"]) < 1000
    position = messages["/dock/pose"]["pose"]["pose"]["position"]
    assert [position[axis] for axis in "xyz"] == pytest.approx(TRUTH.position_m, abs=0.02)


def test_the_vehicle_and_the_entrance_have_topics_of_their_own(told, tmp_path):
    save_dock(Dock(DOCK.diameter, DOCK.lights, entrance=Entrance()), tmp_path / "dock.yaml")
    (tmp_path / "vehicle.yaml").write_text("T_body_camera: {position_m: [0.2, 0.0, 0.1]}\nframe: frd\n")
    files = {"dock_file": str(tmp_path / "dock.yaml"), "vehicle_file": str(tmp_path / "vehicle.yaml")}
    logic = logic_of(DEFAULTS | files, told.append)
    logic.take_camera_info(INFO)
    messages = dict(logic.take_image(bags.image(PICTURE, "mono8"), 0.0))
    assert set(messages) == set(TOPICS)
    x, y, z = TRUTH.position_m
    body = messages["/dock/pose_body"]
    assert body["header"]["frame_id"] == "base_link"
    assert list(body["pose"]["pose"]["position"].values()) == pytest.approx([z + 0.2, -x, -y - 0.1], abs=0.02)
    ways = [(one["header"]["frame_id"], one["child_frame_id"]) for one in messages["/tf"]["transforms"]]
    assert ways == [("camera", "dock"), ("camera", "dock_entrance"), ("base_link", "camera")]
    assert messages["/detected_dock_pose"]["pose"] == messages["/dock/pose"]["pose"]["pose"]


def test_without_a_camera_it_says_so_and_no_pose_is_made_up(logic, told):
    for _ in range(3):
        messages = logic.take_image(bags.image(PICTURE, "mono8"), 0.0)
        assert [topic for topic, _ in messages] == ["/diagnostics"]
        assert status_of(messages)["level"] == 2
        assert "no camera is known yet: /camera/camera_info is silent" in status_of(messages)["message"]
    assert len(told) == 1


def test_a_picture_without_a_stamp_has_the_time_at_which_it_came(logic, told):
    logic.take_camera_info(INFO)
    messages = dict(logic.take_image(bags.image(PICTURE, "mono8", stamp_ns=0), 1_760_000_000.5))
    assert messages["/dock/pose"]["header"]["stamp"] == {"sec": 1_760_000_000, "nanosec": 500_000_000}
    assert told == ["pictures have no time stamps; the time at which they arrive is taken"]


def test_a_camera_file_has_precedence_and_a_camera_of_another_shape_is_told(told):
    logic = NodeLogic(told.append, DOCK, Settings(), CAMERA, "/camera/image_raw")
    logic.take_camera_info(bags.camera_info((99.0, 0, 1, 0, 99.0, 1, 0, 0, 1), (640, 480)))
    assert len(logic.take_image(bags.image(PICTURE, "mono8"), 0.0)) == len(PLAIN)
    messages = logic.take_image(bags.image(PICTURE[:, :480].copy(), "mono8"), 0.0)
    assert "not the same picture rescaled" in status_of(messages)["message"]
    messages = logic.take_image(bags.image(PICTURE, "32FC3"), 0.0)
    assert "has the encoding '32FC3'" in status_of(messages)["message"]


def test_compressed_pictures_have_their_camera_beside_the_others():
    logic = NodeLogic(print, DOCK, Settings(), None, "/left/image_raw/compressed")
    assert (logic.is_compressed, logic.info_topic) == (True, "/left/camera_info")
    logic.take_camera_info(INFO)
    assert len(logic.take_image(bags.compressed(PICTURE, "png"), 0.0)) == len(PLAIN)


def test_the_camera_is_held_against_the_pictures(told):
    """As in bags: a region of interest that was not taken off, a camera of other pictures, rectified ones."""
    P = (*CAMERA.matrix[0], 0.0, *CAMERA.matrix[1], 0.0, 0.0, 0.0, 1.0, 0.0)
    logic = NodeLogic(told.append, DOCK, Settings(), None, "/camera/image_rect_color")
    bent = bags.camera_info(CAMERA.matrix.ravel(), (640, 480), D=(-0.3, 0, 0, 0, 0), P=P, roi=(160, 120, 320, 240))
    logic.take_camera_info(bent)
    pose = dict(logic.take_image(bags.image(PICTURE, "mono8"), 0.0))["/dock/pose"]["pose"]["pose"]
    assert [pose["position"][axis] for axis in "xyz"] == pytest.approx(TRUTH.position_m, abs=0.02)
    assert "taken as rectified" in told[0]
    assert "no region of interest is taken off" in told[1]
    logic.take_camera_info(bags.camera_info(CAMERA.matrix.ravel(), (1280, 960)))
    (message,) = logic.take_image(bags.image(PICTURE, "mono8"), 0.0)
    assert "cannot be used: it is for pictures of 1280 x 960 pixels, but they have 640 x 480" in told[-1]
    assert status_of([message])["level"] == 2


def test_a_transport_that_the_node_cannot_take_is_named(told):
    with pytest.raises(UserError, match="/c/image_rect/ffmpeg: ffmpeg is not read by the node; republish it as raw"):
        NodeLogic(told.append, DOCK, Settings(), None, "/c/image_rect/ffmpeg")


DEFAULTS = {
    "camera_file": "",
    "dock_file": "",
    "vehicle_file": "",
    "dock_diameter_m": 0.30,
    "lights": 10,
    "method": "hats",
    "image_topic": "/camera/image_raw",
    "on_demand": False,
}


@pytest.fixture
def node(monkeypatch):
    fake_rclpy.install(monkeypatch)
    return make_node(DEFAULTS)


def show(node):
    node.subscriptions_["/camera/camera_info"].take(INFO)
    node.subscriptions_["/camera/image_raw"].take(bags.image(PICTURE, "mono8"))


def run(node):
    """Bring a node to life and show it a picture."""
    node.trigger_configure()
    node.trigger_activate()
    show(node)


def test_its_life(node):
    assert node.trigger_configure() is Return.SUCCESS
    assert set(node.publishers_) == set(TOPICS)
    assert {publisher.qos.reliability for publisher in node.publishers_.values()} == {"reliable"}
    assert node.subscriptions_ == {}
    node.trigger_activate()
    assert set(node.subscriptions_) == {"/camera/image_raw", "/camera/camera_info"}
    assert {one.qos.reliability for one in node.subscriptions_.values()} == {"best effort"}
    show(node)
    assert {topic for topic, _ in node.published} == PLAIN
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


def test_switched_off_it_listens_to_nothing_and_on_demand_it_begins_so(monkeypatch):
    fake_rclpy.install(monkeypatch)
    node = make_node(DEFAULTS | {"on_demand": True})
    assert {name: kind for name, (kind, _) in node.services_.items()} == {
        "~/detect": "std_srvs/srv/Trigger",
        "~/enable": "std_srvs/srv/SetBool",
    }
    node.trigger_configure()
    early = node.call("~/detect")
    assert early.success is False
    assert "not active" in early.message
    assert node.call("~/enable", data=False).success is False
    node.trigger_activate()
    assert node.subscriptions_ == {}
    for switch in ({"name": "~/detect"}, {"name": "~/enable", "data": True}):
        node.published.clear()
        asked = node.call(**switch)
        assert (asked.success, asked.message) == (True, "searches pictures")
        assert node.call(**switch).success is True  # once more changes nothing
        assert set(node.subscriptions_) == {"/camera/image_raw", "/camera/camera_info"}
        show(node)
        show(node)
        assert {topic for topic, _ in node.published} == PLAIN
        ages = [values_of(message)["track_age"] for topic, message in node.published if topic == "/diagnostics"]
        assert ages == ["1", "2"]
        off = node.call("~/enable", data=False)
        assert (off.success, off.message) == (True, "searches none")
        assert node.subscriptions_ == {}
    node.trigger_deactivate()
    assert node.call("~/detect").success is False
    node.trigger_activate()  # as it was asked for meanwhile
    assert len(node.subscriptions_) == 2


def values_of(message):
    return {each.key: each.value for each in message.status[0].values}


def test_messages_are_filled_in_as_rclpy_takes_them(node):
    run(node)
    found = dict(node.published)
    assert found["/diagnostics"].status[0].level in (b"\x00", b"\x01")
    assert len(found["/dock/pose"].pose.covariance) == 36
    assert found["/tf"].transforms[0].child_frame_id == "dock"
    assert {"A", "B", "1", "10"} < {one.text for one in found["/dock/annotations"].texts}


@pytest.mark.parametrize(
    ("module", "lost", "told"),
    [
        ("foxglove_msgs.msg", {"/dock/annotations"}, "/dock/annotations is not published, for lack of the package"),
        ("std_srvs.srv", set(), "for lack of the package std_srvs"),
    ],
)
def test_without_a_package_of_messages_it_publishes_all_else_and_says_so(monkeypatch, module, lost, told):
    fake_rclpy.install(monkeypatch)
    monkeypatch.setitem(sys.modules, module, None)
    node = make_node(DEFAULTS)
    run(node)
    assert {topic for topic, _ in node.published} == PLAIN - lost
    (sentence,) = node.said
    assert told in sentence


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
    assert {topic for topic, _ in node.published} == PLAIN
    assert node.state == "gone"
    assert "listens on /camera/image_raw" in capsys.readouterr().err


def test_a_dock_file_has_precedence(node, tmp_path):
    path = tmp_path / "dock.yaml"
    save_dock(Dock(0.25, 5, angles_deg=(0, 50, 100, 180, 270)), path)
    node.parameters |= {"dock_file": str(path), "dock_diameter_m": 0.0}
    assert node.trigger_configure() is Return.SUCCESS
    assert logic_of(node.parameters, print)._dock.angles_deg == (0, 50, 100, 180, 270)


def test_a_managed_node_waits(monkeypatch):
    states = []
    fake_rclpy.install(monkeypatch, lambda node: states.append(node.state))
    assert main(["ros", "--managed"]) == 0
    assert states == ["unconfigured"]


def test_what_is_missing_is_said_in_one_sentence(monkeypatch, capfd, refusal):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main(["ros", "--dock-diameter", "0.3"]) == 2
    assert (
        capfd.readouterr().err
        == "dockpose: ros: needs ROS 2 with rclpy, which is not there; source its setup.bash first\n"
    )
    fake_rclpy.install(monkeypatch)
    assert "how large is the dock?" in refusal("ros")
