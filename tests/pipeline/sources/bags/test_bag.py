"""Bags that other libraries wrote, as frames; and those that are cut short, are none, or leave a question open."""

import sys
import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest
from dockpose.camera.camera import Camera
from dockpose.sources import Bag, Kind, SourceError, kind_of, open_frames
from mcap.writer import CompressionType, IndexType
from rosbags import rosbag2

from tests.support import bags
from tests.support.bags import COMPRESSED, PERIOD_NS, ROS1, ROS2, START_NS, STRING, TOPIC
from tests.support.bags import noise as pictures
from tests.support.sources import taken

K = (700.0, 0.0, 319.5, 0.0, 700.0, 239.5, 0.0, 0.0, 1.0)


def compressed(mode):
    return lambda writer: writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)


def single_database(path, frames):
    (database,) = bags.write_rosbag2(path, frames(ROS2)).glob("*.db3")
    return database


def mcap(**options):
    return lambda path, frames: bags.write_mcap(path / "a.mcap", frames(ROS2), **options)


def ros1(compression=None, chunk_bytes=1 << 20):
    return lambda path, frames: bags.write_rosbag1(path / "a.bag", frames(ROS1), compression, chunk_bytes)


def folder(storage="SQLITE3", prepare=lambda writer: None):
    return lambda path, frames: bags.write_rosbag2(path / "bag", frames(ROS2), storage, prepare)


WRITERS = {
    "mcap": mcap(),
    "mcap, zstd, chunks of three": mcap(compression=CompressionType.ZSTD, chunk_size=9000),
    "mcap, lz4, chunks of three": mcap(compression=CompressionType.LZ4, chunk_size=9000),
    "mcap, chunks of three": mcap(compression=CompressionType.NONE, chunk_size=9000),
    "mcap without chunks": mcap(use_chunking=False),
    "mcap without an index": mcap(chunk_size=9000, index_types=IndexType.NONE, use_statistics=False),
    "mcap of ROS 1": lambda path, frames: bags.write_mcap(path / "a.mcap", frames(ROS1), store=ROS1),
    "folder of SQLite": folder(),
    "folder of mcap": folder("MCAP"),
    "compressed messages": folder(prepare=compressed(rosbag2.CompressionMode.MESSAGE)),
    "compressed messages, alone": lambda path, frames: next(
        folder(prepare=compressed(rosbag2.CompressionMode.MESSAGE))(path, frames).glob("*.db3")
    ).rename(path / "alone.db3"),
    "a folder's description": lambda path, frames: folder()(path, frames) / "metadata.yaml",
    "compressed file": folder(prepare=compressed(rosbag2.CompressionMode.FILE)),
    "single db3": lambda path, frames: single_database(path / "bag", frames),
    "ROS 1, chunks of three": ros1(chunk_bytes=9000),
    "ROS 1, bz2, chunks of three": ros1("BZ2", 9000),
    "ROS 1, lz4, chunks of three": ros1("LZ4", 9000),
}


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
def test_every_kind_of_bag_gives_the_pictures_with_their_times(tmp_path, write):
    shown, told = pictures(), []
    path = write(tmp_path, lambda store: bags.frames(shown, store=store))
    assert kind_of(str(path)) is Kind.BAG
    with open_frames(str(path), told.append) as frames:
        assert frames.count == len(shown)
        assert frames.rate_hz == pytest.approx(10.0)
        found = list(frames)
        with ThreadPoolExecutor(1) as other:  # as the page reads them
            again = list(other.map(frames.at, (7, 2, 11)))
        part = list(frames.between(3, 6))
    assert told == []
    assert [frame.index for frame in found] == list(range(len(shown)))
    assert np.array_equal([frame.image for frame in found], shown)
    assert [frame.time_s for frame in found] == [round(0.1 * k, 9) for k in range(len(shown))]
    unix = [(START_NS + k * PERIOD_NS) / 1e9 for k in range(len(shown))]
    assert [frame.time_unix_s for frame in found] == pytest.approx(unix, abs=1e-6)
    assert np.array_equal([frame.image for frame in again], [shown[index] for index in (7, 2, 11)])
    assert [frame.index for frame in part] == [3, 4, 5]
    assert np.array_equal(part[0].image, shown[3])


def test_a_bag_is_not_read_into_memory(tmp_path):
    shown = pictures(40, (200, 300))
    path = bags.write_mcap(tmp_path / "a.mcap", bags.frames(shown), chunk_size=100_000)
    with Bag(str(path)) as bag:
        tracemalloc.start()
        try:
            assert np.array_equal(bag.at(20).image, shown[20])
            assert tracemalloc.get_traced_memory()[1] < 500_000  # of 2.4 MB: the chunk with that picture
        finally:
            tracemalloc.stop()


def test_the_topic_that_was_asked_for(tmp_path):
    left, right = pictures(4), pictures(8)[4:]
    entries = bags.frames(left, topic="/left/image_raw") + bags.frames(right, topic="/right/image_raw")
    path = str(bags.write_mcap(tmp_path / "a.mcap", entries))
    with pytest.raises(SourceError, match=r"which topic\? Say --topic with one of /left/image_raw, /right/image_raw"):
        Bag(path)
    for topic in ("/right/image_raw", "right/image_raw"):
        with Bag(path, topic=topic) as bag:
            assert np.array_equal(bag.at(0).image, right[0])
    with pytest.raises(SourceError, match="topic /up: there is no such topic; pictures are on /left/image_raw, /right"):
        Bag(path, topic="/up")


def test_a_bag_without_pictures_names_its_topics(tmp_path):
    path = bags.write_mcap(tmp_path / "a.mcap", [("/chatter", STRING, START_NS, bags.text("hello"))])
    with pytest.raises(SourceError, match=r"no topic of the bag has pictures; its topics are /chatter \(std_msgs"):
        Bag(str(path))
    with pytest.raises(SourceError, match=r"topic /chatter: it is std_msgs/msg/String; no topic has pictures"):
        Bag(str(path), topic="/chatter")


@pytest.mark.parametrize(("ending", "shape"), [("jpeg", (48, 64, 3)), ("png", (48, 64)), ("png", (48, 64, 3))])
def test_compressed_pictures(tmp_path, ending, shape):
    shown = [cv2.GaussianBlur(picture, (9, 9), 3) for picture in pictures(3, shape)]
    entries = [("/c/image_raw/compressed", COMPRESSED, START_NS, bags.compressed(one, ending)) for one in shown]
    found = [frame.image for frame in taken(bags.write_mcap(tmp_path / "a.mcap", entries))[0]]
    assert [image.shape for image in found] == [shape] * 3
    most = 0 if ending == "png" else 12  # levels that JPEG may change
    assert all(np.abs(a.astype(int) - b).max() <= most for a, b in zip(found, shown, strict=True))


def test_a_damaged_message_is_left_out_counted_and_told(tmp_path):
    shown = pictures(4)
    entries = bags.frames(shown)
    topic, kind, time_ns, _ = entries[1]
    entries[1] = (topic, kind, time_ns, bags.image(shown[1], "32FC3"))
    entries[2] = (topic, kind, time_ns + PERIOD_NS, bags.image(shown[2], "mono8", data=np.zeros(10, np.uint8)))
    found, told, bag = taken(bags.write_mcap(tmp_path / "a.mcap", entries))
    assert [frame.index for frame in found] == [0, 3]
    assert (bag.skipped, bag.count) == (2, 4)
    assert "frame 1: has the encoding '32FC3'; those read are mono8, " in told[0]
    assert "frame 2: says 64 x 48 pixels of 1 bytes in rows of 64, but has 10" in told[1]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("write", [name for name in WRITERS if "chunks of three" in name])
def test_of_a_bag_that_breaks_off_every_whole_frame_is_there(tmp_path, seed, write):
    """What lies before the cut, by the places at which the writer put the messages of a bag without compression."""
    shown = pictures()
    path = WRITERS[write](tmp_path, lambda store: bags.frames(shown, store=store))
    whole = path.read_bytes()
    cut = int(np.random.default_rng(seed).integers(len(whole) // 3, len(whole) - 2000))
    path.write_bytes(whole[:cut])
    found, told, bag = taken(path)
    if "lz4" not in write and "zstd" not in write and "bz2" not in write:
        assert len(found) == sum(whole.find(picture.tobytes()) + picture.nbytes <= cut for picture in shown)
    else:  # noise keeps its size, so at most the chunk at the cut is missing
        assert len(found) >= cut * len(shown) // len(whole) - 4
    assert 0 < len(found) < len(shown) or cut > whole.rfind(shown[-1].tobytes())
    assert all(np.array_equal(frame.image, picture) for frame, picture in zip(found, shown, strict=False))
    assert bag.is_cut_short
    assert told == [f"{path}: the bag is cut short: {len(found)} frame{' is' if len(found) == 1 else 's are'} there"]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_of_a_database_that_breaks_off_the_frames_before_are_there(tmp_path, share):
    shown = pictures(40)
    (path,) = bags.write_rosbag2(tmp_path / "bag", bags.frames(shown)).glob("*.db3")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    found, told, _ = taken(path)
    places = [whole.find(picture.tobytes()) for picture in shown]
    assert min(places) > 0  # each in one piece
    assert len(found) == sum(place + 3072 <= share * len(whole) for place in places) < len(shown)
    assert all(np.array_equal(frame.image, picture) for frame, picture in zip(found, shown, strict=False))
    assert told == [f"{path}: the bag is cut short: {len(found)} frames are there"]


def test_a_picture_without_a_time_stamp_among_others_follows_the_one_before(tmp_path):
    entries = bags.frames(pictures(4))
    topic, kind, time_ns, _ = entries[2]
    entries[2] = (topic, kind, time_ns, bags.image(pictures(1)[0], "mono8", stamp_ns=0))
    found, told, _ = taken(bags.write_mcap(tmp_path / "a.mcap", entries))
    assert told == []
    assert [frame.time_s for frame in found] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert found[2].time_unix_s == pytest.approx(found[1].time_unix_s)


def test_a_folder_of_a_recorder_that_was_killed(tmp_path):
    folder = bags.write_rosbag2(tmp_path / "bag", bags.frames(pictures()), "MCAP")
    (folder / "metadata.yaml").unlink()
    found, told, _ = taken(folder)
    assert len(found) == len(pictures())
    assert told == [f"{folder}: the bag was not closed, as it has no metadata.yaml: 12 frames are there"]


@pytest.mark.parametrize(
    ("stamps_s", "is_dated", "words"),
    [
        ((0, 0, 0), True, "its pictures have no time stamps; the times of the recording are taken"),
        ((12, 13, 14), False, "its time stamps begin at 12.000 s, which is not a time of day"),
    ],
)
def test_pictures_without_a_time_of_day_say_so(tmp_path, stamps_s, is_dated, words):
    entries = []
    for k, (one, stamp_s) in enumerate(zip(pictures(3), stamps_s, strict=True)):
        message = bags.image(one, "mono8", stamp_ns=stamp_s * 10**9)
        entries.append((TOPIC, bags.IMAGE, START_NS + k * 10**9, message))
    found, told, _ = taken(bags.write_mcap(tmp_path / "a.mcap", entries))
    assert [frame.time_s for frame in found] == [0.0, 1.0, 2.0]
    unix_s = [START_NS / 1e9 + k for k in range(3)] if is_dated else [None] * 3
    assert [frame.time_unix_s for frame in found] == (pytest.approx(unix_s, abs=1e-6) if is_dated else unix_s)
    assert len(told) == 1
    assert words in told[0]


SMALL = (70.0, 0.0, 31.5, 0.0, 70.0, 23.5, 0.0, 0.0, 1.0)  # for pictures of 64 x 48


def info(topic="/camera/camera_info", K=SMALL, *, frame="camera", **how):
    message = bags.camera_info(K, (64, 48), **how)
    message.header.frame_id = frame
    return topic, bags.CAMERA_INFO, START_NS, message


def described(path, entries, **how):
    """The camera of a bag, and what is noted of it."""
    with Bag(str(bags.write_mcap(path / "a.mcap", entries, **how))) as bag:
        return bag.camera, bag.camera_notes


@pytest.mark.parametrize("store", [ROS1, ROS2], ids=["ROS 1", "ROS 2"])
def test_the_camera_beside_the_pictures(tmp_path, store):
    entries = [info(store=store, D=(-0.1, 0.01, 0.0, 0.0, 0.0)), *bags.frames(pictures(2), store=store)]
    camera, notes = described(tmp_path, entries, store=store)
    assert camera == Camera(70, 70, 31.5, 23.5, 64, 48, (-0.1, 0.01, 0.0, 0.0, 0.0))
    assert notes == ["the camera is that of the bag's topic /camera/camera_info"]


def test_a_camera_that_changes_is_named_and_one_that_is_calibrated_late_is_taken(tmp_path):
    shown = bags.frames(pictures(2))
    rounded = info(K=(70.0 + 1e-9, *SMALL[1:]))
    camera, notes = described(tmp_path, [info(), *shown, rounded])
    assert notes == ["the camera is that of the bag's topic /camera/camera_info"]
    zoomed = info(K=(140.0, *SMALL[1:]))
    camera, (note,) = described(tmp_path, [info(), *shown, info(), zoomed])
    assert camera is None
    assert "/camera/camera_info changes during the recording (fx from 70 to 140, cx from 31.5 to 31.5" in note
    camera, notes = described(tmp_path, [info(K=(0.0,) * 9), *shown, zoomed])
    assert (camera.fx, len(notes)) == (140.0, 1)


@pytest.mark.parametrize("count", [1, 3])
def test_pictures_of_which_none_can_be_read_are_named_before_a_camera_is_asked_for(tmp_path, count):
    packed = [(TOPIC, bags.IMAGE, START_NS, bags.image(one, "mono12p")) for one in pictures(count)]
    with pytest.raises(SourceError, match=r"no picture of /\S+ can be read: the first has the encoding 'mono12p'"):
        described(tmp_path, packed)
    camera, _ = described(tmp_path, [info(), *packed, *bags.frames(pictures(1))])
    assert camera is not None


@pytest.mark.parametrize(
    ("topic", "infos", "chosen"),
    [
        ("/0/Color_0/image/data", [("/0/Color_0/info/camera_info", ""), ("/0/IR/info/camera_info", "")], 0),
        ("/cam/front", [("/cam/calibration", "")], 0),
        ("/cam/front", [("/calibration", "")], 0),
        ("/left/image", [("/infos/a", "camera"), ("/infos/b", "other")], 0),
        ("/left/image", [("/left/info", ""), ("/right/info", "")], 0),
        ("/cam/front", [("/cam/info_1", ""), ("/cam/info_2", "")], None),
        ("/front/image", [("/rear/camera_info", "rear")], None),
        ("/robot/front/image", [("/robot/rear/camera_info", "")], None),
        ("/robot/front/image", [("/robot/info", "rear")], None),
    ],
)
def test_a_camera_by_an_unusual_name_is_taken_where_it_can_be_no_other(tmp_path, topic, infos, chosen):
    entries = [info(name, (70.0 + at, *SMALL[1:]), frame=frame) for at, (name, frame) in enumerate(infos)]
    camera, notes = described(tmp_path, [*entries, *bags.frames(pictures(1), topic=topic)])
    if chosen is None:
        assert camera is None
        assert f"its cameras are on {', '.join(name for name, _ in infos)}; " in notes[-1]
    else:
        assert (camera.fx, notes) == (70.0 + chosen, [f"the camera is that of the bag's topic {infos[chosen][0]}"])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.mcap", b"", "the file is empty"),
        ("a.mcap", b"nothing of the kind", "is not an MCAP file"),
        ("a.bag", b"#ROSBAG V1.2\n", "is not a bag of ROS 1"),
        ("a.db3", b"nothing of the kind", "is not an SQLite database"),
        ("a.db3", b"SQLite format 3\0" + bytes(84), "is not a bag of ROS 2"),
    ],
)
def test_files_that_are_none_are_refused_by_name(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SourceError, match=message) as raised:
        Bag(str(path))
    assert str(path) in str(raised.value)


def test_a_bag_that_is_missing_or_lacks_a_file_is_named(tmp_path):
    with pytest.raises(SourceError, match=r"a\.mcap: cannot be read"):
        Bag(str(tmp_path / "a.mcap"))
    folder = bags.write_rosbag2(tmp_path / "bag", bags.frames(pictures(2)))
    for path in folder.glob("*.db3"):
        path.unlink()
    with pytest.raises(SourceError, match=r"the bag's .*\.db3 is not there"):
        Bag(str(folder))


def test_without_the_packages_one_sentence_says_how_to_get_them(tmp_path, monkeypatch):
    path = bags.write_mcap(tmp_path / "a.mcap", bags.frames(pictures(2)))
    monkeypatch.setitem(sys.modules, "mcap", None)
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    with pytest.raises(SourceError, match=r"pip install 'dockpose\[ros\]'"):
        Bag(str(path))
