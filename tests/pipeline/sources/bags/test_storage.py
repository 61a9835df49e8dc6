"""Bags made to hang, to fill the memory or to lie: a sentence, and whatever else is whole."""

import bz2
import json
import os
import re
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import zlib
from contextlib import closing

import lz4.frame
import numpy as np
import pytest
import zstandard
from dockpose.sources import Bag, SourceError
from dockpose.sources.bags import chunked, storage
from dockpose.sources.bags.storage import expanded
from mcap.writer import CompressionType, IndexType

from tests.support import bags
from tests.support.bags import PERIOD_NS, ROS1, ROS2, START_NS, TOPIC
from tests.support.bags import noise as pictures
from tests.support.sources import taken

TOPICS = """
    CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
    INSERT INTO topics VALUES(1, '/camera/image_raw', 'sensor_msgs/msg/Image', 'cdr');
"""
MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
ENDLESS = "WITH RECURSIVE r(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM r) SELECT i AS id, 1 AS topic_id, i AS "
VIEW = f"{TOPICS} CREATE VIEW messages AS {ENDLESS} timestamp, x'00' AS data FROM r"
AS_A_TABLE = "PRAGMA writable_schema=ON; UPDATE sqlite_master SET type = 'table', rootpage = 2 WHERE name = 'messages'"
COMPRESS = {
    "zstd": zstandard.ZstdCompressor().compress,
    "lz4": lambda data: lz4.frame.compress(data, store_size=False),
    "bz2": bz2.compress,
}


def database(path, script):
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(script)
    return str(path)


def refused(source):
    with pytest.raises(SourceError) as raised:
        Bag(source).close()
    assert str(raised.value).startswith(source)
    return str(raised.value)


@pytest.mark.parametrize(
    ("script", "message"),
    [
        (VIEW, "hold more bytes than the file"),
        (f"{VIEW} WHERE i < 0", "SQLite finds no row of it in 1000000 steps"),
        (f"{VIEW}; {AS_A_TABLE}", "no such table: messages|hold more bytes than the file"),
        (f"{MESSAGES} CREATE VIEW topics AS {ENDLESS} name, i type, i serialization_format FROM r", "is not a topic"),
        (
            f"{TOPICS} CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, data, timestamp AS (zeroblob(1 << 29)));"
            "INSERT INTO messages(id, topic_id, data) VALUES(7, 1, x'00')",
            "string or blob too big|has no message",
        ),
        (TOPICS, "is not a bag of ROS 2 .no such table: messages"),
        (f"{TOPICS} {MESSAGES} INSERT INTO messages VALUES(7, 1, 'noon', x'00')", "message 7 has .*timestamp 'noon'"),
        (f"{TOPICS} {MESSAGES} INSERT INTO topics VALUES(2, x'2f', 3, NULL)", r"the row \(2, b'/', '3', None\) of its"),
        (
            f"{TOPICS} {MESSAGES} INSERT INTO topics SELECT i, i, i, i FROM"
            " (WITH RECURSIVE r(i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM r LIMIT 20000) SELECT i FROM r)",
            "its table 'topics' is damaged: it has over 10000 rows",
        ),
    ],
)
def test_a_database_that_computes_or_lies_is_refused(tmp_path, script, message):
    assert re.search(message, refused(database(tmp_path / "a.db3", script)))


def test_what_is_no_bytes_in_a_database_is_left_out(tmp_path):
    (path,) = bags.write_rosbag2(tmp_path / "bag", bags.frames(pictures(4))).glob("*.db3")
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE messages SET data = 'words' WHERE id = 2")
        connection.execute("UPDATE messages SET data = 3.5 WHERE id = 3")
        connection.commit()
    found, told, _ = taken(path)
    assert [frame.index for frame in found] == [0, 3]
    assert "its data are 'words', not bytes" in told[0]
    assert "its data are 3.5, not bytes" in told[1]


@pytest.mark.parametrize("compression", COMPRESS)
def test_a_chunk_expands_to_what_it_says_and_no_further(compression):
    data = bytes(2_000_000)
    packed = COMPRESS[compression](data)
    assert expanded(compression, packed, len(data)) == data
    assert expanded(compression, packed) == data
    for size in (len(data) - 1, 10):
        with pytest.raises(ValueError, match="a chunk is damaged: it holds more"):
            expanded(compression, packed, size)
    with pytest.raises(ValueError, match="3000 MB is larger than the 256 MB that are read"):
        expanded(compression, packed, 3_000_000_000)


def test_a_chunk_that_does_not_say_its_size_is_read_up_to_a_limit(monkeypatch):
    monkeypatch.setattr(storage, "MOST_BYTES", 3_000_000)
    for count, is_read in ((3, True), (4, False)):
        stream = zstandard.ZstdCompressor().compressobj()
        packed = b"".join(stream.compress(bytes(1_000_000)) for _ in range(count)) + stream.flush()
        if is_read:
            assert len(expanded("zstd", packed)) == 3_000_000
        else:
            with pytest.raises(ValueError, match="it holds more than the 3 MB"):
                expanded("zstd", packed)


def chunks_of(data):
    """Where the chunks of an MCAP begin, and how long they are."""
    at = 8
    while at < len(data) - 8:
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        if data[at] == 6:
            yield at, 9 + length
        at += 9 + length


NO_INDEX = {"index_types": IndexType.NONE, "use_statistics": False}


@pytest.mark.parametrize("options", [{}, NO_INDEX], ids=["index", "no index"])
def test_a_chunk_that_does_not_match_its_checksum_is_left_out(tmp_path, options):
    shown = pictures(9)
    path = bags.write_mcap(
        tmp_path / "a.mcap", bags.frames(shown), compression=CompressionType.NONE, chunk_size=9000, **options
    )
    data = bytearray(path.read_bytes())
    data[data.find(shown[4].tobytes()) + 7] ^= 1
    damaged = next(at for at, length in chunks_of(data) if at < data.find(shown[5].tobytes()) < at + length)
    path.write_bytes(data)
    found, told, bag = taken(path)
    assert [np.flatnonzero([np.array_equal(one.image, each) for each in shown]).tolist() for one in found] == [
        [index] for index in (0, 1, 2, 6, 7, 8)
    ]
    assert bag.skipped >= 1
    assert f"at byte {damaged}, a chunk is damaged: it does not match its checksum" in told[0]
    data[damaged + 9 + 24 : damaged + 9 + 28] = bytes(4)  # 0: none is given
    path.write_bytes(data)
    assert len(taken(path)[0]) == 9


def test_data_that_do_not_match_their_checksum_are_told(tmp_path):
    shown = pictures(3)
    path = bags.write_mcap(tmp_path / "b.mcap", bags.frames(shown), use_chunking=False, enable_data_crcs=True)
    assert taken(path)[1] == []
    data = bytearray(path.read_bytes())
    data[data.find(shown[1].tobytes())] ^= 1
    path.write_bytes(data)
    found, told, _ = taken(path)
    assert len(found) == 3
    assert told == [f"{path}: its data do not match their checksum: some of it is damaged"]


def with_chunk(path, data, size, compression=b"zstd", checksum=0):
    """An MCAP of one chunk and no index."""
    head = struct.pack("<QQQII", 0, 0, size, checksum, len(compression)) + compression + struct.pack("<Q", len(data))
    end = b"\x0f" + struct.pack("<QI", 4, 0) + b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0)
    magic = b"\x89MCAP0\r\n"
    path.write_bytes(magic + b"\x06" + struct.pack("<Q", len(head + data)) + head + data + end + magic)
    return str(path)


def test_a_chunk_that_is_a_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(chunked, "MOST_RECORDS", 1000)
    packed = COMPRESS["zstd"](bytes(1000))
    message = refused(with_chunk(tmp_path / "a.mcap", packed, 3_000_000_000))
    assert "at byte 8, a chunk of 3000 MB is larger than the 256 MB that are read" in message
    empty = bytes(9 * 1005)  # records without content
    message = refused(with_chunk(tmp_path / "b.mcap", COMPRESS["zstd"](empty), len(empty), checksum=zlib.crc32(empty)))
    assert "the chunk at byte 8 has over 1000 records" in message


@pytest.mark.parametrize("says_size", [True, False])
def test_a_compressed_file_that_is_a_bomb_is_refused(tmp_path, monkeypatch, says_size):
    monkeypatch.setattr(storage, "MOST_BYTES", 1_000_000)
    data = bytes(20_000_000)
    stream = zstandard.ZstdCompressor().compressobj()
    packed = COMPRESS["zstd"](data) if says_size else stream.compress(data) + stream.flush()
    (tmp_path / "a.mcap.zstd").write_bytes(packed)
    folder = {"rosbag2_bagfile_information": {"relative_file_paths": ["a.mcap.zstd"], "compression_format": "zstd"}}
    (tmp_path / "metadata.yaml").write_text(json.dumps(folder))
    assert "a.mcap.zstd: expands to more than 1000 times its size" in refused(str(tmp_path))
    (tmp_path / "a.mcap.zstd").write_bytes(b"nothing of the kind")
    assert "a.mcap.zstd: is damaged" in refused(str(tmp_path))


def test_a_bag_of_ros_1_whose_chunk_is_a_bomb_is_read_without_it(tmp_path):
    path = bags.write_rosbag1(tmp_path / "a.bag", bags.frames(pictures(9), store=ROS1), "BZ2", chunk_bytes=9000)
    data = path.read_bytes()
    at = data.find(b"size=")
    path.write_bytes(data[: at + 5] + struct.pack("<I", 3_000_000_000) + data[at + 9 :])
    found, told, _ = taken(path)
    assert len(found) == 6  # the topic is described at the end as well
    assert "a chunk of 3000 MB is larger than the 256 MB that are read" in told[0]


@pytest.mark.parametrize("clock", ["of the camera", "of the recording"])
def test_where_the_clock_jumps_back_time_goes_on(tmp_path, clock):
    shown, told, entries = pictures(8), [], []
    for number, picture in enumerate(shown):
        jumped_ns = START_NS + number * PERIOD_NS - (3_000_000_000 if number >= 5 else 0)
        stamp_ns = jumped_ns if clock == "of the camera" else 0
        entries.append((TOPIC, bags.IMAGE, jumped_ns, bags.image(picture, "mono8", stamp_ns=stamp_ns)))
    with Bag(str(bags.write_mcap(tmp_path / "a.mcap", entries)), told.append) as bag:
        found = list(bag)
        assert bag.at(6).time_s == pytest.approx(0.6)
        assert bag.rate_hz == pytest.approx(10.0)
    assert np.array_equal([frame.image for frame in found], shown)
    assert [frame.time_s for frame in found] == pytest.approx([0.1 * number for number in range(8)])
    assert [frame.time_unix_s for frame in found] == [None] * 8  # which of the two is right is not known
    assert told[-1].endswith("its clock jumps back by 2.9 s at frame 5; time goes on by the usual interval there")


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="has no SIGTERM")
def test_sigterm_ends_the_reading_of_a_database(tmp_path):
    """It comes while SQLite's rows are read, over and over."""
    (path,) = bags.write_rosbag2(tmp_path / "bag", bags.frames(pictures(200))).glob("*.db3")
    code = (
        "import signal, sys\n"
        "from dockpose.sources import Bag\n"
        "def end(*_): raise KeyboardInterrupt\n"
        "signal.signal(signal.SIGTERM, end)\n"
        "try:\n"
        "    for number in range(10**9):\n"
        "        Bag(sys.argv[1]).close()\n"
        "        if number == 0: print('at work', flush=True)\n"
        "except KeyboardInterrupt: print('ended')\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as program:
        try:
            assert program.stdout.readline() == "at work\n"
            program.send_signal(signal.SIGTERM)
            assert program.communicate(timeout=60)[0] == "ended\n"
        finally:
            program.kill()


def killed(folder, mode, shown, more=0):
    """A database as SQLite leaves it when its program is killed: what was not yet brought in is in a log beside it."""
    (path,) = bags.write_rosbag2(folder / "written", bags.frames(shown)).glob("*.db3")
    killed, end = folder / "killed" / "a.db3", {"wal": "-wal", "delete": "-journal"}[mode]
    killed.parent.mkdir()
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute(f"PRAGMA journal_mode={mode}")
        connection.execute("PRAGMA cache_size=1")  # what is changed is written before it is committed
        connection.execute("BEGIN")
        data = bytes(ROS2.serialize_cdr(bags.image(np.zeros((48, 64), np.uint8), "mono8"), bags.IMAGE))
        for number in range(more):
            connection.execute("INSERT INTO messages VALUES(?, 1, ?, ?)", (100 + number, START_NS + number, data))
        if mode == "wal":
            connection.execute("COMMIT")
        for name in (path, path.with_name(path.name + end)):
            if name.exists():
                shutil.copyfile(name, killed.with_name("a.db3" + name.name.removeprefix(path.name)))
    return killed, killed.with_name(f"a.db3{end}")


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_rows_in_the_log_of_a_killed_recorder_are_read_and_nothing_beside_it_changes(tmp_path):
    path, log = killed(tmp_path, "wal", pictures(3), more=40)
    before = contents(path.parent)
    found, told, _ = taken(path)
    assert len(found) == 43
    assert told[0] == f"{path}: the bag was not closed, as there is a.db3-wal: 43 frames are there"
    assert contents(path.parent) == before
    link = tmp_path / "link.db3"
    link.symlink_to(path)
    assert len(taken(link)[0]) == 43
    log.unlink()
    assert len(taken(path)[0]) == 3


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.999])
def test_of_a_log_that_breaks_off_what_was_committed_is_read(tmp_path, share):
    path, log = killed(tmp_path, "wal", pictures(3), more=40)
    data = log.read_bytes()
    log.write_bytes(data[: int(share * len(data))])
    assert len(taken(path)[0]) == 3


def test_what_was_never_committed_is_rolled_back_in_a_copy(tmp_path):
    shown = pictures(3)
    path, log = killed(tmp_path, "delete", shown, more=40)
    kept = tmp_path / "precious.txt"
    kept.write_bytes(b"nothing of SQLite's")
    name = str(kept).encode()
    checksum = sum(struct.unpack(f"{len(name)}b", name)) & 0xFFFFFFFF
    end = struct.pack(">II", len(name), checksum) + b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
    log.write_bytes(log.read_bytes() + struct.pack(">I", 1) + name + end)  # says which file is to be deleted with it
    before = contents(path.parent)
    found, told, _ = taken(path)
    assert np.array_equal([frame.image for frame in found], shown)
    assert "as there is a.db3-journal: 3 frames are there" in told[0]
    assert contents(path.parent) == before
    assert kept.exists()


def test_a_database_that_says_it_has_a_log_is_read_without_one_and_left_as_it_is(tmp_path):
    path, log = killed(tmp_path, "wal", pictures(3))
    log.unlink(missing_ok=True)
    before = contents(path.parent)
    found, told, _ = taken(path)
    assert (len(found), told) == (3, [])
    assert contents(path.parent) == before


def test_where_there_is_no_room_for_a_copy_it_is_said(tmp_path, monkeypatch):
    path, _ = killed(tmp_path, "wal", pictures(3), more=4)

    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(shutil, "copyfile", full)
    assert re.search(
        r"a\.db3: must be copied to .* with its a\.db3-wal, which failed \(No space left", refused(str(path))
    )
