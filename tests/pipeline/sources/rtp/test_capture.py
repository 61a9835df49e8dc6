import contextlib
import queue
import re
import socket
import threading

import numpy as np
import pytest
from dockpose.app.export.recording import record
from dockpose.sources import Live, SourceError, Video, open_frames
from dockpose.sources.rtp import RtpCapture
from dockpose.sources.rtp.capture import Assembly, Whole, _Clock
from dockpose.sources.rtp.packets import Packet
from dockpose.sources.rtp.payload import H264, Jpeg

from tests.pipeline.sources.test_sources import number_of, picture
from tests.support.rtp import datagrams, free_port, restarted

CODINGS = ["H264", "H265", "JPEG"]


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
        return self._numbers.get(timeout=10)[0]

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


def sent(coding: str, count: int = 12, key_every: int = 5) -> list[list[bytes]]:
    """Pictures of several packets each, since there is noise in them."""
    noise = np.random.default_rng(5).integers(-30, 31, (count, 120, 160, 3))
    noisy = [(picture(number) + noise[number]).astype(np.uint8) for number in range(count)]
    found = datagrams(noisy, coding, key_every)
    assert min(map(len, found)) > 2
    return found


@pytest.mark.parametrize("coding", CODINGS)
def test_each_picture_comes_at_once_whichever_coding_it_has(watched, coding):
    stream, seen = watched(), []
    pictures = sent(coding)
    first = 0 if coding == "JPEG" else 5  # nobody knows what was before the very first packet
    for number, parts in enumerate(pictures):
        stream.send(parts)
        if number >= first:
            seen.append(stream.next())  # before anything else is sent
    assert seen == list(range(first, 12))
    assert (
        f"160 x 120 {dict(zip(CODINGS, ('h264', 'hevc', 'mjpeg'), strict=True))[coding]} from 127.0.0.1"
        in stream.told.get(timeout=10)
    )


@pytest.mark.parametrize(
    ("coding", "seen"), [("H264", [5, 6, 10, 11]), ("H265", [5, 6, 10, 11]), ("JPEG", [5, 6, 8, 9, 10, 11])]
)
def test_a_lost_packet_leaves_out_all_that_needs_it(watched, coding, seen):
    stream, pictures = watched(), sent(coding)
    first = 5 if coding == "JPEG" else 4
    for number, parts in enumerate(pictures[first:], first):
        stream.send([*parts[:1], *parts[2:]] if number == 7 else parts)
    assert [stream.next() for _ in seen] == seen
    assert stream.live.skipped == (1 if coding == "JPEG" else 3)


def test_a_sender_that_stops_and_comes_back_anew_is_followed_and_said(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.capture._SILENT_S", 0.3)
    stream, pictures = watched(), sent("H264")
    for parts in pictures[4:8]:
        stream.send(parts)
    assert [stream.next() for _ in range(3)] == [5, 6, 7]
    assert "160 x 120 h264" in stream.told.get(timeout=10)
    assert "no more packets come, for 0.3 s" in stream.told.get(timeout=10)
    monkeypatch.setattr("dockpose.sources.rtp.packets._NEW_SENDER_S", 0.0)
    for parts in pictures[2:]:
        stream.send([restarted(data, 12345) for data in parts])
    assert [stream.next() for _ in range(7)] == [5, 6, 7, 8, 9, 10, 11]
    assert "160 x 120 h264" in stream.told.get(timeout=10)


def test_a_sender_that_changes_coding_is_followed(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.packets._NEW_SENDER_S", 0.0)
    stream = watched()
    for parts in sent("H264")[4:7]:
        stream.send(parts)
    assert [stream.next(), stream.next()] == [5, 6]
    for parts in sent("JPEG")[3:5]:
        stream.send(parts)
    assert [stream.next(), stream.next()] == [3, 4]


def test_nothing_that_comes_is_said(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.capture._TELL_EVERY_S", 0.1)
    stream = watched()
    assert "nothing comes to UDP port" in stream.told.get(timeout=10)
    for parts in sent("H264")[1:4]:
        stream.send(parts)
    while "that begins by itself" not in stream.told.get(timeout=10):
        pass


def test_lost_packets_are_said(watched, monkeypatch):
    monkeypatch.setattr("dockpose.sources.rtp.capture._TELL_EVERY_S", 0.1)
    stream, pictures = watched(), sent("H264")
    for number, parts in enumerate(pictures[4:], 4):
        stream.send(parts[1:] if number == 7 else parts)
    lost = left_out = 0
    while (lost, left_out) != (1, 3):
        numbers = re.findall(r"(\d+) packets were lost, and (\d+) pictures are left out", stream.told.get(timeout=10))
        lost, left_out = lost + sum(int(one) for one, _ in numbers), left_out + sum(int(one) for _, one in numbers)


def test_a_description_is_opened_as_an_address_is(watched, tmp_path):
    port = free_port()
    (tmp_path / "tank.sdp").write_text(f"v=0\nm=video {port} RTP/AVP 96\na=rtpmap:96 H265/90000\n")
    stream = Watched(str(tmp_path / "tank.sdp"), port)
    with contextlib.closing(stream):
        for parts in sent("H265")[4:6]:
            stream.send(parts)
        assert stream.next() == 5


def test_garbage_is_passed_over(watched):
    stream, pictures = watched(), sent("H264")
    for parts in pictures[4:7]:
        stream.send([b"", b"garbage", bytes(2000), *parts])
    assert [stream.next(), stream.next()] == [5, 6]


@pytest.mark.parametrize("coding", CODINGS)
def test_a_recording_has_all_that_was_sent_from_the_first_key_on(tmp_path, coding):
    port = free_port()
    told: list[str] = []
    with open_frames(f"rtp://127.0.0.1:{port}", told.append) as live:
        assert isinstance(live, Live)
        recording = record(live, tmp_path / "kept.mkv", told.append)
        assert recording is not None
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        frames, seen = iter(live), []
        for parts in sent(coding, 15)[5 if coding == "JPEG" else 4 :]:
            for data in parts:
                sender.sendto(data, ("127.0.0.1", port))
        while not seen or seen[-1] != 14:
            seen.append(number_of(next(frames).image))
        sender.close()
        recording.close()
    with Video(str(tmp_path / "kept.mkv")) as kept:
        assert [number_of(frame.image) for frame in kept] == list(range(5, 15))


@pytest.mark.parametrize(
    ("sent_s", "came_s", "wanted_s"),
    [
        # The second came 50 ms late, of which 10 may be the clock; the third quicker than the first.
        ([0, 0.1, 0.2, 0.3], [100, 100.15, 100.19, 100.33], [100, 100.11, 100.19, 100.30]),
        (0.9999 * np.arange(3600), 50 + np.arange(3600), [50 + 3599]),
        (np.arange(1000) / 10, 50 + np.arange(1000) / 9.5, [50 + 999 / 9.5]),
        ([0, 5000], [100, 100.1], [100, 100.1]),
    ],
    ids=["late ones", "a slow clock, over an hour", "fewer frames than it counts", "a clock that is set"],
)
def test_times_are_those_of_sending_by_our_clock(sent_s, came_s, wanted_s):
    clock = _Clock()
    found_s = [clock.time_of(float(sent), float(came)) for sent, came in zip(sent_s, came_s, strict=True)]
    assert found_s[-len(wanted_s) :] == pytest.approx(wanted_s, abs=1e-3)


def test_a_port_that_is_taken_is_told():
    port = free_port()
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as other:
        other.bind(("127.0.0.1", port))
        with pytest.raises(SourceError, match=f"UDP port {port} cannot be listened to"):
            open_frames(f"rtp://127.0.0.1:{port}")


def test_nothing_can_be_set():
    capture = RtpCapture(f"rtp://127.0.0.1:{free_port()}", print)
    assert capture.ask(None) == ()  # pyright: ignore[reportArgumentType]
    assert capture.retrieve() is None
    capture.release()


KEY, INTER = (b"\x67s", b"\x68p", b"\x65k"), (b"\x41a", b"\x41b")


def whole_of(assembly: Assembly, *pictures: tuple[bytes, ...], lost=(), stamp=0, are_ends_marked=True) -> list[Whole]:
    """What is whole of pictures of several units each, of which those that are lost are named by both their places."""
    found, is_after_gap = [], False
    for number, units in enumerate(pictures):
        for place, unit in enumerate(units):
            is_last = are_ends_marked and place == len(units) - 1
            packet = Packet(0, (stamp + 3000 * number) % 2**32, 1, 96, is_last, unit)
            found += [] if (number, place) in lost else assembly.take(packet, is_after_gap)
            is_after_gap = (number, place) in lost
    return found


def numbers_of(found: list[Whole]) -> list[int]:
    return [round(whole.sent_s * 30) for whole in found]


@pytest.mark.parametrize(
    ("pictures", "lost", "whole"),
    [
        ((INTER, INTER, KEY, INTER), [(0, 0)], [2, 3]),
        ((KEY, KEY), [], [1]),
        ((INTER, KEY, INTER, INTER, INTER, KEY, INTER), [(3, 0)], [1, 2, 5, 6]),
        ((INTER, KEY, INTER, INTER, KEY), [(2, 1)], [1, 4]),
        ((INTER, KEY, INTER, INTER, KEY), [(2, 0), (2, 1)], [1, 4]),
    ],
    ids=["no key before", "joined in the middle of a key", "a lost packet", "a lost last packet", "a lost picture"],
)
def test_what_lacks_a_packet_or_needs_what_does_is_not_whole(pictures, lost, whole):
    assembly = Assembly(H264())
    assert numbers_of(whole_of(assembly, *pictures, lost=lost)) == whole
    # What lost its last packet is counted with the next, to which the loss is put.
    assert assembly.left_out == len(pictures) - len(whole) - ((2, 0) in lost)


def test_each_jpeg_stands_for_itself():
    parts = tuple(bytes([0, 0, 0, at, 1, 50, 2, 2]) + b"scan" for at in (0, 4))
    assert numbers_of(whole_of(Assembly(Jpeg()), *[parts] * 5, lost=[(1, 0), (3, 1)])) == [0, 2, 4]


def test_the_first_key_after_a_loss_begins_and_no_other():
    found = whole_of(Assembly(H264()), INTER, KEY, INTER, KEY)
    assert [(whole.is_key, whole.begins) for whole in found] == [(True, True), (False, False), (True, False)]


def test_times_go_on_where_the_stamps_of_32_bits_begin_anew():
    assert numbers_of(whole_of(Assembly(H264()), INTER, KEY, KEY, KEY, stamp=2**32 - 4000)) == [1, 2, 3]


def test_a_sender_that_marks_no_ends_is_understood_a_picture_later():
    found = whole_of(Assembly(H264()), INTER, KEY, INTER, INTER, are_ends_marked=False)
    assert [(number, whole.is_key) for number, whole in zip(numbers_of(found), found, strict=True)] == [
        (1, True),
        (2, False),
    ]


def test_a_picture_that_cannot_be_decoded_is_as_one_that_is_lost():
    assembly = Assembly(H264())
    assert numbers_of(whole_of(assembly, INTER, KEY, INTER)) == [1, 2]
    assembly.spoil()
    found = whole_of(assembly, INTER, KEY, stamp=9000)
    assert (numbers_of(found), found[0].begins) == ([4], True)
