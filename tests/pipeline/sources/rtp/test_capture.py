import contextlib
import queue
import re
import socket
import threading
import time

import numpy as np
import pytest
from dockpose.app.export.recording import record
from dockpose.sources import Live, SourceError, Video, open_frames

from tests.pipeline.sources.test_sources import number_of, picture
from tests.support.rtp import datagrams, free_port, restarted

CODECS = {"H264": "h264", "H265": "hevc"}


class Watched:
    """A stream that is open, its frames as they come, and what is told."""

    def __init__(self, address: str, port: int) -> None:
        self.told: queue.Queue[str] = queue.Queue()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._port = port
        self.live = open_frames(address, self.told.put)
        assert isinstance(self.live, Live)
        self._numbers: queue.Queue[tuple[int, int]] = queue.Queue()
        self.live.on_arrival = lambda arrival: self._numbers.put((number_of(arrival.frame.image), arrival.frame.index))
        self._thread = threading.Thread(target=lambda: [None for _ in self.live])
        self._thread.start()

    def send(self, parts: list[bytes]) -> None:
        for data in parts:
            self._socket.sendto(data, ("127.0.0.1", self._port))

    def next(self) -> int:
        return self._numbers.get(timeout=60)[0]

    def close(self) -> None:
        self.live.close()
        self._thread.join()
        self._socket.close()


@pytest.fixture
def watched():
    with contextlib.ExitStack() as stack:

        def open_(address: str = "rtp://127.0.0.1:{}") -> Watched:
            port = free_port()
            return stack.enter_context(contextlib.closing(Watched(address.format(port), port)))

        yield open_


def sent(coding: str, count: int = 12, key_every: int = 5, more: str = "") -> list[list[bytes]]:
    """Pictures of several packets each, since there is noise in them."""
    noise = np.random.default_rng(5).integers(-30, 31, (count, 120, 160, 3))
    noisy = [(picture(number) + noise[number]).astype(np.uint8) for number in range(count)]
    found = datagrams(noisy, coding, key_every, more)
    assert min(map(len, found)) > 2
    return found


@pytest.mark.parametrize("coding", CODECS)
def test_each_picture_comes_at_once_whichever_coding_it_has(watched, coding):
    stream, seen = watched(), []
    for number, parts in enumerate(sent(coding)):
        stream.send(parts)
        if number >= 5:  # nobody knows what was before the very first packet
            seen.append(stream.next())  # before anything else is sent
    assert seen == list(range(5, 12))
    assert f"160 x 120 {CODECS[coding]} from 127.0.0.1" in stream.told.get(timeout=60)


@pytest.mark.parametrize(
    ("coding", "damage"),
    [
        *((coding, lambda parts: [*parts[:1], *parts[2:]]) for coding in CODECS),  # a packet is lost
        ("H264", lambda parts: [data[:14] + bytes(len(data) - 14) for data in parts]),  # none can be decoded
    ],
)
def test_a_picture_that_is_damaged_is_left_out_with_all_that_needs_it(watched, coding, damage):
    stream = watched()
    for number, parts in enumerate(sent(coding)[4:], 4):
        stream.send(damage(parts) if number == 7 else parts)
    assert [stream.next() for _ in range(4)] == [5, 6, 10, 11]
    assert stream.live.skipped == 3


def test_a_key_picture_brings_no_older_one_out_that_the_decoder_held_back(watched, monkeypatch):
    # Of a sender whose pictures need later ones, the decoder holds each key picture back, so that none comes in time.
    monkeypatch.setattr("dockpose.sources.rtp.packets._NEW_SENDER_S", 0.0)
    stream = watched()
    for parts in sent("H264", more=":bframes=1:b-adapt=0"):
        stream.send(parts)
    for parts in sent("H264")[9:]:
        stream.send([restarted(data, 12345) for data in parts])
    assert stream.next() == 10  # 5 without the flush, which is the key picture before the one that is decoded


def test_a_sender_that_stops_and_comes_back_anew_is_followed_and_said(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.capture._SILENT_S", 0.3)
    stream, pictures = watched(), sent("H264")
    for parts in pictures[4:8]:
        stream.send(parts)
    assert [stream.next() for _ in range(3)] == [5, 6, 7]
    assert "160 x 120 h264" in stream.told.get(timeout=60)
    assert "no more packets come, for 0.3 s" in stream.told.get(timeout=60)
    monkeypatch.setattr("dockpose.sources.rtp.packets._NEW_SENDER_S", 0.0)
    for parts in pictures[2:]:
        stream.send([restarted(data, 12345) for data in parts])
    assert [stream.next() for _ in range(7)] == [5, 6, 7, 8, 9, 10, 11]
    assert "160 x 120 h264" in stream.told.get(timeout=60)


def test_a_sender_that_changes_coding_is_followed(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.packets._NEW_SENDER_S", 0.0)
    stream = watched()
    for parts in sent("H264")[4:7]:
        stream.send(parts)
    assert [stream.next(), stream.next()] == [5, 6]
    for parts in sent("H265")[4:7]:
        stream.send(parts)
    assert [stream.next(), stream.next()] == [5, 6]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (bytes((0x80, 0x80 | 26)) + bytes(30), "RTP of type 26 (JPEG) comes to UDP port"),
        (bytes((0x80, 33)) + bytes(30), "RTP of type 33 (MPEG-TS) comes to UDP port"),
        (bytes((0x80, 8)) + bytes(30), "RTP of type 8 (neither H.264 nor H.265) comes to UDP port"),
        (b"\x47" + bytes(187), "MPEG-TS without RTP"),
        (b"no video", "nothing comes to UDP port"),
    ],
)
def test_what_comes_and_is_not_read_is_said(watched, monkeypatch, data, words):
    monkeypatch.setattr("dockpose.sources.rtp.capture._TELL_EVERY_S", 0.1)
    stream = watched()
    deadline = time.monotonic() + 60
    told = ""
    while words not in told and time.monotonic() < deadline:
        stream.send([data])
        told = stream.told.get(timeout=60)
    assert words in told
    assert ("H.264 and H.265 over RTP are read" in told) == (data != b"no video")
    for parts in sent("H264")[1:4]:
        stream.send(parts)
    while "that begins by itself" not in stream.told.get(timeout=60):
        pass


def test_lost_packets_are_said(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.capture._TELL_EVERY_S", 0.1)
    stream, pictures = watched(), sent("H264")
    for number, parts in enumerate(pictures[4:], 4):
        stream.send(parts[1:] if number == 7 else parts)
    lost = left_out = 0
    while (lost, left_out) != (1, 3):
        numbers = re.findall(r"(\d+) packets were lost, and (\d+) pictures are left out", stream.told.get(timeout=60))
        lost, left_out = lost + sum(int(one) for one, _ in numbers), left_out + sum(int(one) for _, one in numbers)


@pytest.mark.parametrize("coding", CODECS)
def test_a_recording_has_all_that_was_sent_from_the_first_key_on(tmp_path, coding):
    port = free_port()
    told: list[str] = []
    with open_frames(f"rtp://127.0.0.1:{port}", told.append) as live:
        assert isinstance(live, Live)
        recording = record(live, tmp_path / "kept.mkv", told.append)
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        frames, seen = iter(live), []
        for parts in sent(coding, 15)[4:]:
            for data in parts:
                sender.sendto(data, ("127.0.0.1", port))
        while not seen or seen[-1] != 14:
            seen.append(number_of(next(frames).image))
        sender.close()
        recording.close()
    with Video(str(tmp_path / "kept.mkv")) as kept:
        assert [number_of(frame.image) for frame in kept] == list(range(5, 15))


def test_a_port_that_is_taken_is_told():
    port = free_port()
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as other:
        other.bind(("127.0.0.1", port))
        with pytest.raises(SourceError, match=f"UDP port {port} cannot be listened to"):
            open_frames(f"rtp://127.0.0.1:{port}")
