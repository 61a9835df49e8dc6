"""Recordings of cameras and streams: every frame and its times, kept whatever happens."""

import contextlib
import socket
import threading
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import pytest
from av.error import FFmpegError
from dockpose.app.export import recording
from dockpose.app.export.recording import Recording
from dockpose.sources import Arrival, Frame, Live, open_frames
from dockpose.sources import capture as streaming

from tests.support.clock import until
from tests.support.streams import MjpegServer

NOON_S = 1782907200.123456
# As a camera of 50 frames a second gives them, with one that is late.
TIMES_S = [0.0, 0.020013, 0.041999, 0.06, 0.0801, 0.15, 0.160001]


def picture(number, shape=(48, 64), kind: type = np.uint8):
    return np.random.default_rng(number).integers(0, np.iinfo(kind).max + 1, shape, kind)


def arrivals(times_s=TIMES_S, **more):
    return [
        Arrival(Frame(picture(number, **more), number, time_s, "camera 0", time_unix_s=NOON_S + time_s))
        for number, time_s in enumerate(times_s)
    ]


def recorded(path, taken, told=None):
    kept = Recording(path, [].append if told is None else told.append)
    for arrival in taken:
        kept.take(arrival)
    kept.close()
    return kept


def read(path):
    with open_frames(str(path)) as frames:
        return list(frames)


def record_live(path, frames, count, told=None):
    """Record a live source until so many frames were looked at; those and the recording."""
    kept, arrived = Recording(path, [].append if told is None else told.append), []

    def take(arrival):
        arrived.append(arrival.frame)
        kept.take(arrival)

    frames.on_arrival = take
    with frames:
        for frame in frames:
            if frame.index >= count:
                break
        frames.on_arrival = None
    kept.close()
    return arrived, kept


def test_pictures_come_back_bit_by_bit_at_their_times(tmp_path):
    told, taken = [], arrivals(shape=(47, 61), kind=np.uint16)
    kept = recorded(tmp_path / "tank.mkv", taken, told)
    found = read(tmp_path / "tank.mkv")
    assert [frame.time_s for frame in found] == TIMES_S
    assert [frame.time_unix_s for frame in found] == pytest.approx([NOON_S + time_s for time_s in TIMES_S], abs=1e-6)
    for frame, arrival in zip(found, taken, strict=True):
        np.testing.assert_array_equal(frame.image, arrival.frame.image)
    assert (kept.frames, kept.missing) == (7, 0)
    assert told == [f"{tmp_path / 'tank.mkv'}: 7 frames recorded, {kept.size_bytes / 1e6:.1f} MB"]


def test_a_recording_from_the_middle_begins_at_its_own_first_frame(tmp_path):
    recorded(tmp_path / "tank.mkv", arrivals()[2:5])
    found = read(tmp_path / "tank.mkv")
    assert [frame.time_s for frame in found] == pytest.approx([0.0, 0.018001, 0.038101], abs=1e-9)
    assert [frame.time_unix_s for frame in found] == pytest.approx([NOON_S + t for t in TIMES_S[2:5]], abs=1e-6)


def test_frames_of_another_kind_go_to_a_file_of_their_own(tmp_path):
    told = []
    taken = arrivals()
    other = arrivals(shape=(24, 32))
    kept = recorded(tmp_path / "tank.mkv", [*taken[:3], *other[3:]], told)
    assert [len(read(tmp_path / name)) for name in ("tank.mkv", "tank-2.mkv")] == [3, 4]
    assert kept.frames == 7
    assert "tank-2.mkv: the frames are of another kind from here on" in told[0]
    assert "tank.mkv and " in told[1]


def test_a_recording_without_frames_leaves_no_file(tmp_path):
    told = []
    recorded(tmp_path / "tank.mkv", [], told)
    assert list(tmp_path.iterdir()) == []
    assert "0 frames recorded" in told[0]


def test_frames_that_there_is_no_time_for_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "MOST_WAITING_BYTES", 3 * 48 * 64)
    has_begun, may_go = threading.Event(), threading.Event()
    write = recording._Pictures.write

    def slowly(self, arrival):
        has_begun.set()
        assert may_go.wait(60)
        write(self, arrival)

    monkeypatch.setattr(recording._Pictures, "write", slowly)
    told = []
    kept = Recording(tmp_path / "tank.mkv", told.append)
    for arrival in arrivals():
        kept.take(arrival)
        assert has_begun.wait(60)
    assert kept.missing == 3  # of seven, one is being written, and three wait
    may_go.set()
    kept.close()
    assert len(read(tmp_path / "tank.mkv")) == 4
    assert len(told) == 2
    assert "frames come faster than they can be written" in told[0]
    assert "4 frames recorded" in told[1]
    assert "3 are missing" in told[1]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux has a disk that is always full")
def test_a_full_disk_ends_the_recording_with_one_sentence(tmp_path):
    told = []
    kept = Recording(tmp_path / "tank.mkv", told.append)
    taken = arrivals(np.arange(40) / 50, shape=(480, 640))
    for arrival in taken[:20]:
        kept.take(arrival)
    until(lambda: kept.frames == 20)
    file: Any = kept._part._video._file  # pyright: ignore
    file._file.close()
    file._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115
    for arrival in taken[20:]:
        kept.take(arrival)
    until(lambda: not kept.is_running)
    kept.close()
    assert told[0].endswith(
        "cannot be written (the disk is full); what was written before is kept (pictures: 19); "
        "it is no longer recorded, and all else goes on"
    )
    assert len(told) == 2  # with how much there is
    assert [frame.index for frame in read(tmp_path / "tank.mkv")] == list(range(19))  # one was not yet written out


def test_whatever_goes_wrong_with_the_file_only_the_recording_ends(tmp_path, monkeypatch):
    def broken(self, arrival):
        raise RuntimeError("what nobody thought of")

    monkeypatch.setattr(recording._Pictures, "write", broken)
    told = []
    recorded(tmp_path / "tank.mkv", arrivals(), told)
    assert "cannot be written (what nobody thought of); it is no longer recorded" in told[0]
    assert "0 frames recorded" in told[1]
    assert list(tmp_path.iterdir()) == []


def test_a_stream_of_jpeg_is_kept_byte_by_byte_with_the_dropped_frames(tmp_path):
    pictures = [cv2.imencode(".jpg", picture(number, (120, 160)))[1].tobytes() for number in range(80)]
    with MjpegServer(pictures, 100) as server:
        arrived, kept = record_live(tmp_path / "tank.mkv", open_frames(server.address), 40)
    with av.open(str(tmp_path / "tank.mkv")) as container:
        found = [bytes(packet) for packet in container.demux(video=0) if packet.size]
    first = pictures.index(found[0])
    assert found == pictures[first : first + len(found)]
    assert len(found) == len(arrived) == kept.frames > 40
    again = read(tmp_path / "tank.mkv")
    began_s = arrived[0].time_s
    assert [frame.time_s for frame in again] == pytest.approx([f.time_s - began_s for f in arrived], abs=2e-6)
    assert [frame.time_unix_s for frame in again] == pytest.approx([f.time_unix_s for f in arrived], abs=2e-6)


def shared_by(found, arrived):
    """Those frames that were both kept and looked at, by their time of day; of some no whole one came before."""
    kept_s = np.array([frame.time_unix_s for frame in found])
    nearest = [int(np.abs(kept_s - frame.time_unix_s).argmin()) for frame in arrived]
    pairs = [(found[k], frame) for k, frame in zip(nearest, arrived, strict=True)]
    shared = [(one, other) for one, other in pairs if abs(one.time_unix_s - other.time_unix_s) < 0.005]
    assert len(shared) >= len(arrived) - 10
    return shared


def serve_h264(port_of, count, stop):
    """Send MPEG-TS with H.264 and B-frames over TCP, at the frames' rate."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port_of.append(server.getsockname()[1])
        connection, _ = server.accept()
        with connection, av.open(connection.makefile("wb"), "w", format="mpegts") as container:
            options = {"preset": "ultrafast", "g": "10", "bf": "2", "b_adapt": "0"}
            stream = container.add_stream("libx264", rate=50, options=options)
            stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
            for number in range(count):
                frame = av.VideoFrame.from_ndarray(np.full((180, 160), number % 200, np.uint8), format="yuv420p")
                frame.pts, frame.time_base = number, Fraction(1, 50)
                container.mux(stream.encode(frame))
                if stop.wait(1 / 100):
                    return


def test_a_stream_of_h264_is_kept_as_it_was_sent_with_the_senders_times(tmp_path):
    port_of, stop = [], threading.Event()
    sender = threading.Thread(target=serve_h264, args=(port_of, 400, stop), daemon=True)
    sender.start()
    while not port_of:
        time.sleep(0.01)
    frames = open_frames(f"tcp://127.0.0.1:{port_of[0]}", timeout_s=60)
    assert isinstance(frames, Live)
    arrived, kept = record_live(tmp_path / "tank.mkv", frames, 60)
    stop.set()
    found = read(tmp_path / "tank.mkv")
    with av.open(str(tmp_path / "tank.mkv")) as container:
        assert kept.frames == sum(packet.size > 0 for packet in container.demux(video=0))
    with av.open(str(tmp_path / "tank.mkv")) as container:
        assert container.streams.video[0].codec_context.name == "h264"
    steps_s = np.diff([frame.time_s or 0.0 for frame in found])[:-2]  # the last ones came before others
    assert steps_s == pytest.approx(np.full(len(steps_s), 0.02), abs=3e-6)
    shared = shared_by(found, arrived)
    assert [frame.time_unix_s for frame, _ in shared] == pytest.approx([f.time_unix_s for _, f in shared], abs=3e-6)
    for frame, original in shared:
        np.testing.assert_array_equal(frame.image, original.image)


def connected_rtsp(port):
    """A container to send H.264 by RTSP with, and its stream, once somebody listens there."""
    options = {"preset": "ultrafast", "tune": "zerolatency", "g": "10"}
    for _ in range(200):
        try:
            container = av.open(f"rtsp://127.0.0.1:{port}/tank", "w", format="rtsp", options={"rtsp_transport": "tcp"})
            stream = container.add_stream("libx264", rate=50, options=options)
            stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
            container.start_encoding()
        except FFmpegError:
            time.sleep(0.05)
        else:
            return container, stream
    raise AssertionError("nobody listens")


def push_rtsp(port, began, stop):
    """Send frames whose level tells their number, with reports of the sender's clock."""
    container, stream = connected_rtsp(port)
    began.append(time.time())
    with contextlib.suppress(FFmpegError):  # the listener hangs up
        for number in range(300):
            frame = av.VideoFrame.from_ndarray(np.full((180, 160), 40 + number % 150, np.uint8), format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, 50)
            container.mux(stream.encode(frame))
            if stop.wait(max(0.0, began[0] + (number + 1) / 50 - time.time())):
                return


@pytest.mark.slow
def test_rtsp_gives_the_senders_time_of_day_and_is_kept_as_it_was_sent(tmp_path, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    options = {**streaming._OPTIONS, "rtsp_flags": "listen", "listen_timeout": "10"}
    monkeypatch.setattr(streaming, "opened", lambda address, **_: av.open(address, options=options))
    began, stop = [], threading.Event()
    sender = threading.Thread(target=push_rtsp, args=(port, began, stop), daemon=True)
    sender.start()
    frames = open_frames(f"rtsp://127.0.0.1:{port}/tank", grey=True)
    assert isinstance(frames, Live)
    arrived, _ = record_live(tmp_path / "tank.mkv", frames, 60)
    stop.set()
    # A frame's level tells its number, and so when it was made, however late it came.
    offsets_s = []
    for frame in arrived:
        level = float(np.median(frame.image)) * 219 / 255 + 16  # from the full scale back to that of video
        number = round(level) - 40
        offsets_s.append(frame.time_unix_s - began[0] - number / 50)
    assert np.abs(offsets_s).max() < 0.1
    assert np.ptp(offsets_s) < 1e-3
    found = read(tmp_path / "tank.mkv")
    for frame, original in shared_by(found, arrived):
        np.testing.assert_array_equal(frame.image, original.picture())
