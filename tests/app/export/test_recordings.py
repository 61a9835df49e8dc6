"""MCAP files read back by `mcap` and by `rosbags`, as the JSON lines."""

import contextlib
import json
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from dockpose import Dock, Entrance, estimate, open_frames
from dockpose.app.cli import main
from dockpose.app.export.recordings.ros import TOPICS, write_bag
from dockpose.app.inputs.pictures import save_dock
from dockpose.simulate import Approach, FilmPlan, render
from dockpose.simulate.files import save_sequence
from dockpose.sources import Bag
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from tests.support import bags, foxglove
from tests.support.scenes import CAMERA, random_scene

STORE = foxglove.register(get_typestore(Stores.ROS2_HUMBLE))
EACH_FRAME = {"/diagnostics", "/dock/annotations", "/dock/image", "/dock/camera_info"}
FRAMES, DARK = 12, (4, 5)  # frames, of which these show no dock


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with what `estimate --out` made of a bag, and the JSON lines of the same run."""
    folder = tmp_path_factory.mktemp("written")
    known = bags.write_approach(folder, FRAMES, DARK)
    dock = Dock(0.30, 10, entrance=Entrance(position_m=(0.0, 0.0, 0.25)))
    save_dock(dock, folder / "dock.yaml")
    (folder / "vehicle.yaml").write_text("T_body_camera: {position_m: [0.2, 0.0, 0.1], pitch_deg: -10}\nframe: frd\n")
    known = [*known[:2], "--dock", str(folder / "dock.yaml"), "--vehicle", str(folder / "vehicle.yaml")]
    files = ["--out", str(folder / "poses.mcap"), "--json", str(folder / "lines.jsonl")]
    assert main(["estimate", str(folder / "run.mcap"), *known, *files]) == 0
    return folder


def lines_of(folder):
    return [json.loads(line) for line in (folder / "lines.jsonl").read_text().splitlines()]


def by_mcap(path):
    """Topic, time and message of every message, as the library `mcap` finds them."""
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding, schema.name) == ("ros2msg", "cdr", TOPICS[channel.topic])
            yield channel.topic, message.log_time, STORE.deserialize_cdr(message.data, schema.name)


def by_rosbags(path):
    """The same, as `rosbags` finds them, by the definitions in the file alone."""
    with AnyReader([path], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, time_ns, data in reader.messages():
            yield connection.topic, time_ns, reader.deserialize(data, connection.msgtype)


@pytest.mark.slow
@pytest.mark.parametrize("read", [by_mcap, by_rosbags])
def test_every_message_is_what_the_line_says(written, read):
    found = list(read(written / "poses.mcap"))
    lines = lines_of(written)
    for line in lines:
        stamp_ns = bags.START_NS + line["frame"] * bags.PERIOD_NS
        messages = {topic: message for topic, time_ns, message in found if abs(time_ns - stamp_ns) < 1000}
        if line["frame"] in DARK:
            assert set(messages) == EACH_FRAME
        else:
            assert set(messages) == set(TOPICS)
            check_poses(messages, line)
        check_diagnostics(messages["/diagnostics"], line)
        check_annotations(messages.pop("/dock/annotations"), line, stamp_ns)
        for message in messages.values():
            header = message.transforms[0].header if hasattr(message, "transforms") else message.header
            assert abs(header.stamp.sec * 10**9 + header.stamp.nanosec - stamp_ns) < 1000
            in_body = message is messages.get("/dock/pose_body")
            assert header.frame_id == ("base_link" if in_body else "camera_optical_frame")
    assert len(found) == 4 * len(lines) + 7 * (FRAMES - len(DARK))


def check_poses(messages, line):
    poses = {"/dock/pose": line["chosen"]}
    poses |= dict(zip(("/dock/pose_a", "/dock/pose_b"), line["candidates"], strict=True))
    for topic, expected in poses.items():
        stamped = messages[topic].pose
        position, turn = stamped.pose.position, stamped.pose.orientation
        assert [position.x, position.y, position.z] == expected["position_m"]
        assert [turn.x, turn.y, turn.z, turn.w] == expected["quaternion_xyzw"]
        assert stamped.covariance.reshape(6, 6).tolist() == expected["covariance_total_m_rad"]
    dock, entrance, camera = messages["/tf"].transforms
    assert [one.child_frame_id for one in (dock, entrance, camera)] == ["dock", "dock_entrance", "camera_optical_frame"]
    assert dock.transform.translation.z == line["chosen"]["position_m"][2]
    assert dock.transform.rotation.w == line["chosen"]["quaternion_xyzw"][3]
    assert entrance.transform.translation.z == line["entrance"]["position_m"][2]
    assert messages["/detected_dock_pose"].pose == messages["/dock/pose"].pose.pose
    check_body(messages["/dock/pose_body"], camera, line)
    about = messages["/dock/camera_info"]
    assert (about.k[0], about.width, len(about.d)) == (line["camera"]["fx_px"], 640, 5)
    picture = messages["/dock/image"]
    assert picture.format == "png"
    decoded = cv2.imdecode(np.array(picture.data), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.shape == (480, 640)


def check_annotations(message, line, stamp_ns):
    """Foxglove's coordinates begin at the corner of the first pixel, ours in its middle."""
    texts = [one.text for one in message.texts]
    circles = sorted((one.position.x, one.position.y) for one in message.circles)
    lights = sorted((one["x_px"] + 0.5, one["y_px"] + 0.5) for one in line["markers"] if one["on_ring"])
    if line["frame"] in DARK:
        assert (texts, circles, list(message.points)) == (["No pose"], [], [])
    else:
        assert sorted(texts) == sorted(["Dock found", "A", "B", *map(str, range(1, 11))])
        np.testing.assert_allclose([one for one in circles if one in lights], lights, atol=1e-9)
        assert len(circles) == 14  # with the tips of both normals and the dock's centre
        colours = {tuple(round(255 * part) for part in (each.r, each.g, each.b)) for each in _outlines(message)}
        assert colours == {(0, 114, 178), (230, 159, 0), (204, 121, 167)}  # of A, B and the ellipse
    for one in (*message.texts, *message.circles, *message.points):
        assert abs(one.timestamp.sec * 10**9 + one.timestamp.nanosec - stamp_ns) < 1000


def _outlines(message):
    """The colours of the lines; all are strips, and the ellipse's cross is separate lines."""
    assert {one.type for one in message.points} == {3, 4}
    return [one.outline_color for one in message.points]


def check_body(stamped, camera, line):
    """In base_link y is to the left and z up; the vehicle file has y to the right and z down."""
    x, y, z = line["vehicle"]["position_m"]
    at = stamped.pose.pose.position
    assert [at.x, at.y, at.z] == pytest.approx([x, -y, -z], abs=1e-12)
    total = np.array(line["vehicle"]["covariance_total_m_rad"])
    turned = np.diag([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    np.testing.assert_allclose(stamped.pose.covariance.reshape(6, 6), turned @ total @ turned, atol=1e-12)
    # The way from the vehicle to the dock by way of the camera is the same.
    turn, place = camera.transform.rotation, camera.transform.translation
    rotation = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    there = rotation @ line["chosen"]["position_m"] + [place.x, place.y, place.z]
    np.testing.assert_allclose(there, [x, -y, -z], atol=1e-12)


def check_diagnostics(message, line):
    (status,) = message.status
    values = {each.key: each.value for each in status.values}
    assert status.message.startswith(line["message"])
    assert values["status"] == line["status"]
    assert values["stamps"] == "time of day"
    assert values["track_predicted"] == str(line["track"]["predicted"]).lower()
    if line["frame"] in DARK:
        assert (status.level, values["probability"], values["pose"]) == (2, "", "")
    else:
        assert status.level == (0 if line["track"]["probability"] >= 0.95 else 1)
        assert float(values["probability"]) == line["candidates"][line["selected"]]["probability"]


def test_it_is_a_bag_of_pictures_again(written):
    with Bag(str(written / "poses.mcap")) as bag:
        assert bag.count == FRAMES


def test_without_a_time_of_day_it_is_said_and_no_stamp_is_0(written, tmp_path, capsys):
    scene = tmp_path / "scene.yaml"
    save_sequence(FilmPlan(scene=random_scene(3), motion=Approach(start_m=1.5, end_m=1.4, frames=3, rate_hz=10)), scene)
    assert main(["estimate", str(scene), "--out", str(tmp_path / "a.mcap"), "--json", str(tmp_path / "a.jsonl")]) == 0
    told = capsys.readouterr().err
    assert told.count("time stamps in") == 1
    assert "are seconds since the first frame, plus 1; the source does not know the time of day" in told
    found: list[Any] = list(by_mcap(tmp_path / "a.mcap"))
    assert sorted({time_ns for _, time_ns, _ in found}) == [1_000_000_000, 1_100_000_000, 1_200_000_000]
    values = {each.key: each.value for each in found[0][2].status[0].values}
    assert values["stamps"].startswith("seconds since the first frame")


def test_pictures_by_themselves_go_there_too(written, tmp_path):
    bag = Bag(str(written / "run.mcap"))
    path = tmp_path / "one.png"
    cv2.imwrite(str(path), bag.at(0).image)
    bag.close()
    words = ["--camera", str(written / "camera.yaml"), "--dock-diameter", "0.30", "--lights", "10"]
    assert main(["estimate", str(path), *words, "--out", str(tmp_path / "a.mcap")]) == 0
    alone = set(TOPICS) - {"/dock/pose_body", "/dock/entrance"}  # of a dock without entrance, on no known vehicle
    assert {topic for topic, _, _ in by_rosbags(tmp_path / "a.mcap")} == alone


@pytest.mark.slow
def test_a_program_that_is_killed_leaves_all_frames_but_the_last(tmp_path):
    """Frames without a picture are smallest, and so the most that may be lost."""
    path, script = (
        tmp_path / "killed.mcap",
        """
import os, signal, sys
from pathlib import Path
import numpy as np
from dockpose import Camera, Dock, estimate
from dockpose.app.export.recordings.ros import PoseFile
from dockpose.app.export.recordings.ros import Seen
from dockpose.app.state.trust import Trust
dark = np.full((48, 64), 10, np.uint8)
found = estimate(dark, Camera(70, 70, 31.5, 23.5, 64, 48), Dock(0.3, 10))
file = PoseFile(Path(sys.argv[1]), "test", print)
for number in range(200):
    file.write(Seen("test", number, found, Trust("red", "No pose")), 0.1 * number, 1.75e9 + 0.1 * number)
os.kill(os.getpid(), signal.SIGKILL)
""",
    )
    assert subprocess.run([sys.executable, "-c", script, str(path)], timeout=60, check=False).returncode == -9
    found, topics = [], {}
    with path.open("rb") as file, contextlib.suppress(McapError, struct.error):  # at the end, which is missing
        for record in StreamReader(file).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            if isinstance(record, Message) and topics[record.channel_id] == "/diagnostics":
                found.append(STORE.deserialize_cdr(record.data, "diagnostic_msgs/msg/DiagnosticArray"))
    assert 200 - 40 <= len(found) <= 200  # 16 KiB of messages
    numbers = [{each.key: each.value for each in message.status[0].values}["frame"] for message in found]
    assert numbers == [str(number) for number in range(len(found))]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--out", "poses.txt"], "--out poses.txt: must be NAME.mcap"),
        (["--out", "nowhere/poses.mcap"], "nowhere/poses.mcap: cannot be written"),
        (["other.png", "run.mp4", "--out", "poses.mcap"], "poses.mcap: takes one source"),
    ],
)
def test_what_cannot_be_written_is_refused(written, monkeypatch, capsys, words, sentence):
    monkeypatch.chdir(written)
    known = ["--camera", "camera.yaml", "--dock-diameter", "0.30"]
    assert main(["estimate", "run.mcap", *words, *known]) == 2
    assert sentence in capsys.readouterr().err
    assert not Path("poses.txt").exists()


def test_without_the_packages_one_sentence_says_how_to_get_them(written, monkeypatch, capsys, tmp_path):
    save_sequence(FilmPlan(scene=random_scene(3), motion=Approach(frames=2)), tmp_path / "scene.yaml")
    for name in ("mcap", "mcap.writer"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(["estimate", str(tmp_path / "scene.yaml"), "--out", str(tmp_path / "a.mcap")]) == 2
    assert "pip install 'dockpose[ros]'" in capsys.readouterr().err


def test_a_bag_that_was_written_is_read_with_its_camera_alone(tmp_path):
    scene = random_scene(4, camera=CAMERA, position_m=(0.05, 0.0, 1.0))
    image = render(scene)[0]
    found = estimate(image, scene.camera, scene.dock)
    assert found.status == "ok"
    write_bag(tmp_path / "a.mcap", [(image, None, found), (image, None, found)], tell=lambda text: None)
    with open_frames(tmp_path / "a.mcap") as frames:
        assert frames.count == 2
        assert frames.camera is not None
        np.testing.assert_array_equal(frames.camera.matrix, scene.camera.matrix)
        assert frames.camera.distortion[:4] == (*scene.camera.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
        np.testing.assert_array_equal(frames.at(1).image, image)
