"""The node's logic, with messages of a bag and without ROS."""

import msgspec
import pytest
from dockpose.app.commands.ros.logic import NodeLogic, Options
from dockpose.app.export.recordings.messages import TOPICS
from dockpose.simulate import render
from dockpose.simulate.parts import Text

from tests.support import bags
from tests.support.scenes import CAMERA, DOCK, random_scene

PICTURE, TRUTH = render(random_scene(3))
INFO = bags.camera_info(CAMERA.matrix.ravel(), (640, 480))


@pytest.fixture
def told():
    return []


@pytest.fixture
def logic(told):
    return NodeLogic(Options(DOCK), told.append)


def status_of(messages):
    (status,) = dict(messages)["/diagnostics"]["status"]
    return status


def test_a_picture_gives_all_messages_with_its_own_time_and_frame(logic):
    logic.take_camera_info(INFO)
    messages = dict(logic.take_image(bags.image(PICTURE, "mono8"), 0.0))
    assert set(messages) == set(TOPICS)
    stamp = {"sec": bags.START_NS // 10**9, "nanosec": bags.START_NS % 10**9}
    header = messages["/dock/pose"]["header"]
    assert header["frame_id"] == "camera"
    assert header["stamp"]["sec"] == stamp["sec"]
    assert abs(header["stamp"]["nanosec"] - stamp["nanosec"]) < 1000
    position = messages["/dock/pose"]["pose"]["pose"]["position"]
    assert [position[axis] for axis in "xyz"] == pytest.approx(TRUTH.position_m, abs=0.02)


def test_without_a_camera_it_says_so_and_no_pose_is_made_up(logic, told):
    for _ in range(3):
        messages = logic.take_image(bags.image(PICTURE, "mono8"), 0.0)
        assert [topic for topic, _ in messages] == ["/diagnostics"]
        assert status_of(messages)["level"] == 2
        assert "no camera is known yet: /camera/camera_info is silent" in status_of(messages)["message"]
    assert len(told) == 1


def test_a_dark_picture_gives_diagnostics_alone(logic):
    logic.take_camera_info(INFO)
    messages = logic.take_image(bags.image(0 * PICTURE + 10, "mono8"), 0.0)
    assert [topic for topic, _ in messages] == ["/diagnostics"]
    assert status_of(messages)["message"].startswith("No lights")


def test_frames_are_tracked_until_it_is_restarted(logic):
    logic.take_camera_info(INFO)
    ages = []
    for number in range(4):
        if number == 3:
            logic.restart()
        message = bags.image(PICTURE, "mono8", stamp_ns=bags.START_NS + number * bags.PERIOD_NS)
        values = {each["key"]: each["value"] for each in status_of(logic.take_image(message, 0.0))["values"]}
        ages.append(values["track_age"])
    assert ages == ["1", "2", "3", "1"]


def test_text_that_stays_put_is_masked(logic, told):
    logic.take_camera_info(INFO)
    text = Text(text="REC 7", x_px=20, y_px=430, height_px=20)
    for number in range(10):
        scene = random_scene(4, position_m=(0.01 * number, 0.05, 1.0))
        picture, _ = render(msgspec.structs.replace(scene, texts=(text,)))
        stamp_ns = bags.START_NS + number * bags.PERIOD_NS
        logic.take_image(bags.image(picture, "mono8", stamp_ns=stamp_ns), 0.0)
    (sentence,) = told
    assert sentence.startswith("/camera/image_raw frame 7: something bright stays put")


def test_a_picture_without_a_stamp_has_the_time_at_which_it_came(logic, told):
    logic.take_camera_info(INFO)
    messages = dict(logic.take_image(bags.image(PICTURE, "mono8", stamp_ns=0), 1_760_000_000.5))
    assert messages["/dock/pose"]["header"]["stamp"] == {"sec": 1_760_000_000, "nanosec": 500_000_000}
    assert told == ["pictures have no time stamps; the time at which they arrive is taken"]


def test_a_camera_file_has_precedence_and_a_camera_of_another_shape_is_told(told):
    logic = NodeLogic(Options(DOCK, camera=CAMERA), told.append)
    logic.take_camera_info(bags.camera_info((99.0, 0, 1, 0, 99.0, 1, 0, 0, 1), (640, 480)))
    assert len(logic.take_image(bags.image(PICTURE, "mono8"), 0.0)) == len(TOPICS)
    messages = logic.take_image(bags.image(PICTURE[:, :480].copy(), "mono8"), 0.0)
    assert "not the same picture rescaled" in status_of(messages)["message"]
    messages = logic.take_image(bags.image(PICTURE, "32FC1"), 0.0)
    assert "has the encoding '32FC1'" in status_of(messages)["message"]


def test_compressed_pictures_have_their_camera_beside_the_others():
    options = Options(DOCK, image_topic="/left/image_raw/compressed")
    assert (options.is_compressed, options.info_topic) == (True, "/left/camera_info")
    logic = NodeLogic(options, print)
    logic.take_camera_info(INFO)
    assert len(logic.take_image(bags.compressed(PICTURE, "png"), 0.0)) == len(TOPICS)
