"""Foxglove's messages with pictures, video and cameras, in every encoding in which programs write them."""

import json

import numpy as np
import pytest
from dockpose.camera.camera import Camera
from dockpose.sources import Bag, SourceError
from dockpose.sources.bags.decoding import fields_of, stamp_ns
from dockpose.sources.bags.storage import Topic, kind_of_message
from mcap.writer import Writer

from tests.support import bags, foxglove_messages, videos_in_bags
from tests.support.bags import noise as pictures
from tests.support.sources import taken

K = [70.0, 0.0, 31.5, 0.0, 71.0, 23.5, 0.0, 0.0, 1.0]
D = (-0.1, 0.01, 0.0, 0.0, 0.0)
CALIBRATION = ("/camera/calibration", "CameraCalibration", foxglove_messages.calibration(K, (64, 48), D))


def compressed(data, coding):
    return {"frame_id": "", "data": data, "format": coding}


def png(picture):
    return compressed(bytes(bags.compressed(picture, "png").data), "png")


@pytest.mark.parametrize("encoding", foxglove_messages.ENCODINGS)
def test_pictures_and_their_camera_are_read(tmp_path, encoding):
    shown = pictures(3)
    for kind, values in (
        ("RawImage", [foxglove_messages.raw(one, "mono8") for one in shown]),
        ("CompressedImage", map(png, shown)),
    ):
        entries = [("/camera/image", kind, each) for each in values]
        path = foxglove_messages.write(tmp_path / f"{kind}.mcap", encoding, [*entries, CALIBRATION])
        found, told, bag = taken(path)
        assert np.array_equal([frame.image for frame in found], shown)
        assert [frame.time_s for frame in found] == pytest.approx([0.0, 0.1, 0.2])
        assert found[0].time_unix_s == pytest.approx(bags.START_NS / 1e9)
        assert (bag.camera, told) == (Camera(70, 71, 31.5, 23.5, 64, 48, D), [])
        assert bag.camera_notes == ["the camera is that of the bag's topic /camera/calibration"]


@pytest.mark.parametrize(
    ("encoding", "prefix"),
    [
        *(
            ("cdr", prefix)
            for prefix in ("foxglove.", "foxglove_msgs/msg/", "foxglove_msgs/", "foxglove::", "foxglove/msg/")
        ),
        *(("protobuf", "foxglove."), ("json", "foxglove."), ("ros1", "foxglove_msgs/")),
    ],
)
def test_video_is_read_under_every_name_of_its_type(tmp_path, encoding, prefix):
    entries = [
        ("video/Camera/stream", "CompressedVideo", compressed(packet, "h264"))
        for packet in videos_in_bags.packets("h264", 14)
    ]
    found, told, _ = taken(foxglove_messages.write(tmp_path / "a.mcap", encoding, entries, prefix))
    assert [round((frame.image.mean() - 20) / 5) for frame in found] == list(range(14))
    assert told == []


@pytest.mark.parametrize("coding", ["h264", "hevc", "h265", "H.264"])
def test_video_in_compressed_pictures_is_told_by_their_format(tmp_path, coding):
    data = videos_in_bags.packets("h264" if "264" in coding else "h265", 14)
    entries = []
    for at, packet in enumerate(data):
        message = bags.compressed(pictures(1)[0], "png", stamp_ns=bags.START_NS + at * bags.PERIOD_NS)
        message.format, message.data = coding, np.frombuffer(packet, np.uint8)
        entries.append(("/c/image_raw/compressed", bags.COMPRESSED, bags.START_NS + at, message))
    found, told, _ = taken(bags.write_mcap(tmp_path / "a.mcap", entries))
    assert [round((frame.image.mean() - 20) / 5) for frame in found] == list(range(14))
    assert told == []


@pytest.mark.parametrize(("name", "kind"), [
    ("sensor_msgs::msg::dds_::Image_", "sensor_msgs/msg/Image"), ("sensor_msgs/Image", "sensor_msgs/msg/Image"),
    ("foxglove.PointCloud", "foxglove.PointCloud"), ("my.foxglove.RawImage", "my.foxglove.RawImage"), ("", ""),
])  # fmt: skip
def test_names_of_types(name, kind):
    assert kind_of_message(name) == kind


def test_an_encoding_that_is_not_read_is_named(tmp_path):
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel(
            "/c", "flatbuffer", writer.register_schema("foxglove.RawImage", "flatbuffer", b"")
        )
        writer.add_message(channel, 1, b"", 1)
        writer.finish()
    with pytest.raises(
        SourceError, match=r"its topics are /c \(foxglove_msgs/msg/RawImage in flatbuffer, which is not read"
    ):
        Bag(str(tmp_path / "a.mcap"))


@pytest.mark.parametrize("encoding", foxglove_messages.ENCODINGS)
def test_a_message_that_breaks_off_is_damaged(encoding):
    topic = Topic("/c", "foxglove_msgs/msg/RawImage", encoding)
    data = foxglove_messages.encoded(
        "RawImage", encoding, bags.START_NS, foxglove_messages.raw(pictures(1)[0], "mono8")
    )
    assert fields_of(topic, data).width == 64
    assert stamp_ns(topic, data) == bags.START_NS
    for share in (0.0, 0.001, 0.5) if encoding != "protobuf" else (0.5, 0.9):
        with pytest.raises(SourceError, match=r"the message is damaged \(\d+ bytes\)"):
            fields_of(topic, data[: int(share * len(data)) + (share > 0) * 9])


def test_what_json_leaves_open_is_refused():
    topic = Topic("/c", "foxglove_msgs/msg/RawImage", "json")
    for content in ({"data": "no base64!"}, {"width": "64"}, {"timestamp": 5}, [1], {"K": [1, "x"]}):
        with pytest.raises(SourceError, match="damaged"):
            fields_of(topic, json.dumps(content).encode())


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"K": K[:8]}, "its matrix has 8 numbers, where it must have 9"),
        ({"K": [float("nan"), *K[1:]]}, "cannot be used"),
        ({"width": 0}, "it does not say for which pictures it is"),
        ({"width": 128, "height": 96}, "it is for pictures of 128 x 96 pixels, but they have 64 x 48"),
        ({"distortion_model": "fisheye62"}, "distortion_model is 'fisheye62', which is not read"),
        ({"K": []}, "was not calibrated"),
    ],
)
def test_a_calibration_that_cannot_be_theirs_is_not_taken(tmp_path, changed, words):
    topic, kind, values = CALIBRATION
    entries = [
        ("/camera/image", "RawImage", foxglove_messages.raw(pictures(1)[0], "mono8")),
        (topic, kind, values | changed),
    ]
    with Bag(str(foxglove_messages.write(tmp_path / "a.mcap", "protobuf", entries))) as bag:
        assert bag.camera is None
        assert words in bag.camera_notes[0]
