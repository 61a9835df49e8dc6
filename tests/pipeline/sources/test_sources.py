# pyright: reportArgumentType=false

import socketserver
import threading
import time
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose.simulate import Approach, ClosedLoop, FilmPlan, film
from dockpose.simulate.files import save_sequence
from dockpose.sources import Kind, Live, Pictures, SourceError, kind_of, open_frames, read_ahead
from dockpose.sources.capture import Capture

from tests.support.scenes import CAMERA, random_scene
from tests.support.sources import by_number_as_in_order
from tests.support.streams import MjpegServer

SMALL = msgspec.structs.replace(random_scene(1), camera=CAMERA.for_size(320, 240))
RATE_HZ = 20.0


def picture(number: int) -> np.ndarray:
    """A picture of eight fields that are dark or bright as the bits of its number, which any codec keeps."""
    levels = np.array([40 + 150 * (number >> place & 1) for place in range(8)], np.uint8)
    return np.repeat(levels, 20)[None, :, None].repeat(120, 0).repeat(3, 2)


def number_of(image: np.ndarray) -> int:
    fields = image.reshape(120, 8, -1).mean(axis=(0, 2)) > 115
    return int(sum(1 << place for place in np.flatnonzero(fields)))


def write_video(path: Path, codec: str, frames: int = 100) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), RATE_HZ, (160, 120))
    for number in range(frames):
        writer.write(picture(number))
    writer.release()
    return path


def write_folder(folder: Path, numbers: range) -> Path:
    folder.mkdir()
    for number in numbers:
        cv2.imwrite(str(folder / f"frame{number}.png"), picture(number))
    return folder


@pytest.mark.parametrize(
    ("source", "kind"),
    [
        ("rtsp://127.0.0.1/x.mp4", Kind.STREAM),
        ("HTTP://127.0.0.1:80/?a=*", Kind.STREAM),
        ("rtp://:5600", Kind.STREAM),
        ("tank.SDP", Kind.STREAM),
        ("tank.mp4", Kind.VIDEO),
        ("tank.AVI", Kind.VIDEO),
        ("http/tank.mp4", Kind.VIDEO),
        ("scene.yaml", Kind.SIMULATED),
        ("frame*.png", Kind.GLOB),
        ("tank.png", Kind.PICTURE),
        ("no ending", Kind.PICTURE),
        ("x" * 5000, Kind.PICTURE),
    ],
)
def test_what_a_text_names(source, kind):
    assert kind_of(source) is kind


def test_a_file_or_folder_that_is_there_comes_before_all_else(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("0").write_bytes(b"")
    Path("7").mkdir()
    Path("a[1].mp4").write_bytes(b"")
    assert [kind_of(name) for name in ("0", "7", "a[1].mp4")] == [Kind.PICTURE, Kind.FOLDER, Kind.VIDEO]


def test_a_folder_comes_in_numeric_order_and_a_broken_picture_is_left_out(tmp_path):
    folder = write_folder(tmp_path / "film", range(8, 12))
    (folder / "frame9.png").write_text("not a picture")
    told = []
    with open_frames(str(folder), told.append, rate_hz=10) as frames:
        found = list(frames)
        assert frames.count == 4
        assert frames.skipped == 1
        assert np.array_equal(frames.at(3).image, found[2].image)
        with pytest.raises(SourceError, match="frame 1 of 4"):
            frames.at(1)
    seen = [(frame.index, frame.time_s, number_of(frame.image)) for frame in found]
    assert seen == [(0, 0.0, 8), (2, 0.2, 10), (3, 0.3, 11)]
    assert len(told) == 2  # once in order, once by its number
    assert "frame9.png: is not a picture" in told[0]
    assert found[0].name == str(folder / "frame8.png")
    assert len(found[0].sha256 or "") == 64


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "mp4v"), ("a.avi", "MJPG"), ("b.avi", "FFV1")])
def test_a_video_gives_each_frame_by_its_number_as_in_order(tmp_path, name, codec):
    path = write_video(tmp_path / name, codec)
    with open_frames(str(path)) as frames:
        found = by_number_as_in_order(frames, 100, (99, 0, 1, 2, 50, 13, 49, 90, 90), range(37, 71))
        assert (frames.count, frames.rate_hz, frames.skipped) == (100, RATE_HZ, 0)
        assert [number_of(frame.image) for frame in found] == list(range(100))
        assert [frame.time_s for frame in found] == pytest.approx(np.arange(100) / RATE_HZ)
        for index in (-1, 100):
            with pytest.raises(SourceError, match=f"frame {index} of 100"):
                frames.at(index)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("a.mp4", "a.mp4: is not a video, or one of a format that is not read"),
        ("a.mkv", "a.mkv: begins as a video, but is damaged or cut short"),
        ("a.h264", "a.h264: the file is empty"),
        ("cut.mp4", "cut.mp4: is an MP4 that is cut short before its index"),
        ("gone.mp4", "gone.mp4: "),
        ("gone.png", "gone.png: "),
        ("words.yaml", "words.yaml: "),
        ("97", "camera 97: no camera has that number"),
    ],
)
def test_what_gives_no_frames_is_told_in_a_sentence_that_names_it(tmp_path, source, words, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, data in {"a.mp4": b"words " * 99, "a.mkv": b"\x1a\x45\xdf\xa3", "a.h264": b""}.items():
        Path(name).write_bytes(data)
    Path("words.yaml").write_text("camera: 7")
    path = write_video(Path("cut.mp4"), "mp4v")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(SourceError, match=words) as error:
        open_frames(source)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize("motion", [Approach(frames=6, start_m=2, drift_m=0.05), ClosedLoop(frames=6)])
def test_a_simulated_course_is_that_of_the_simulator(tmp_path, motion):
    sequence = FilmPlan(scene=SMALL, motion=motion)
    save_sequence(sequence, tmp_path / "scene.yaml")
    with open_frames(str(tmp_path / "scene.yaml")) as frames:
        assert (frames.count, frames.rate_hz, frames.camera) == (6, 10.0, SMALL.camera)
        found = list(frames)
        assert np.array_equal(frames.at(4).image, found[4].image)
    if isinstance(motion, Approach):
        expected = list(film(sequence))
        assert [frame.time_s for frame in found] == [frame.time_s for frame in expected]
        assert all(np.array_equal(one.image, other.image) for one, other in zip(found, expected, strict=True))


def test_reading_ahead_keeps_the_order_raises_where_it_was_due_and_stops_when_left():
    def items():
        yield from range(10)
        raise SourceError("the eleventh")

    seen = []
    with pytest.raises(SourceError, match="eleventh"):
        seen.extend(read_ahead(items()))
    assert seen == list(range(10)) or seen == []
    began = threading.active_count()
    endless = iter(int, 1)
    ahead = read_ahead(endless)
    assert next(ahead) == 0
    ahead.close()  # pyright: ignore[reportAttributeAccessIssue]
    assert threading.active_count() == began


class FakeCapture(Capture):
    """Gives what is in a script: a picture's number, or None for a failure; None for ever at its end."""

    def __init__(self, script):
        super().__init__()
        self.script = list(script)
        self.released = False

    def grab(self):
        now = self.script.pop(0) if self.script else None
        self.now = now or 0
        return now is not None

    def retrieve(self):
        return picture(self.now)

    def release(self):
        self.released = True


def answering(answers, asked_s):
    """A way to connect that gives one answer after another, and notes when it was asked."""

    def connect():
        asked_s.append(time.monotonic())
        answer = answers.pop(0)
        if isinstance(answer, SourceError):
            raise answer
        return answer

    return connect


def test_a_camera_that_goes_away_is_tried_again_with_growing_pauses_and_said_so(monkeypatch):
    monkeypatch.setattr("dockpose.sources.live.FIRST_PAUSE_S", 0.05)
    monkeypatch.setattr("dockpose.sources.live.LONGEST_PAUSE_S", 0.2)
    first, second = FakeCapture([0, 1, None, 2]), FakeCapture([3] * 1000)
    answers = [first, *[SourceError("camera 0: no camera has that number")] * 2, second]
    asked_s, told = [], []
    frames = Live("camera 0", answering(answers, asked_s), told.append)
    with frames:
        for frame in frames:
            if number_of(frame.image) == 3:
                break
    assert first.released
    assert second.released
    assert frames.skipped == 1
    pauses_s = np.diff(asked_s)[1:]
    assert (pauses_s >= [0.1, 0.2]).all()
    begins = "1 frame was corrupt ", "no more frames come;", *["no camera has that n"] * 2, "is back after"
    assert [text.startswith(f"camera 0: {begin}") for text, begin in zip(told, begins, strict=True)] == [True] * 5
    assert "after 0.05 s" in told[1]


def test_a_source_that_is_not_there_yet_is_waited_for_if_it_may_come_later(monkeypatch):
    monkeypatch.setattr("dockpose.sources.live.FIRST_PAUSE_S", 0.01)
    answers = [*[SourceError("blueos://127.0.0.1: does not answer")] * 3, FakeCapture([7] * 1000)]
    told = []
    with Live("blueos://127.0.0.1", answering(answers, []), told.append, waits=True) as frames:
        assert "does not answer; it is waited for" in frames.about
        assert number_of(next(iter(frames)).image) == 7
    assert [text.partition(": ")[2][:14] for text in told] == [*["does not answe"] * 3, "is back after "]
    assert answers == []
    with pytest.raises(SourceError, match="does not answer"):
        Live("blueos://127.0.0.1", answering([SourceError("blueos://127.0.0.1: does not answer")], []))


def test_a_source_that_cannot_be_read_any_more_ends_with_a_sentence_rather_than_silence():
    class Broken(FakeCapture):
        def retrieve(self):
            raise RuntimeError("a driver's own error")

    with Live("camera 0", lambda: Broken([0])) as frames:
        with pytest.raises(SourceError, match=r"camera 0: cannot be read any more \(a driver's own error\)"):
            next(iter(frames))
        with pytest.raises(SourceError, match="cannot be read any more"):
            next(iter(frames))


def test_a_live_source_that_is_never_looked_at_is_released():
    capture = FakeCapture([0])
    Live("camera 0", lambda: capture).close()
    assert capture.released


def test_a_live_source_keeps_the_newest_frame_and_counts_the_others():
    pictures = [picture(number) for number in range(200)]
    with MjpegServer(pictures, rate_hz=100) as server, open_frames(server.address) as frames:
        assert frames.is_live
        assert frames.count is None
        found = []
        for frame in frames:
            found.append((frame, number_of(frame.image)))
            if len(found) == 6:
                break
            before = frames.dropped
            while frames.dropped < before + 3:
                time.sleep(0.005)
        dropped = frames.dropped
        with pytest.raises(SourceError, match="is live"):
            frames.at(0)
    indices = [frame.index for frame, _ in found]
    missing = indices[-1] + 1 - len(found)
    assert dropped >= missing >= 10
    steps = np.diff([frame.index for frame, _ in found])
    turned = (np.diff([number for _, number in found]) - steps) % len(pictures)  # they begin anew after the last
    assert np.minimum(turned, len(pictures) - turned).tolist() == pytest.approx([0] * 5)
    assert np.all(np.diff([frame.time_s for frame, _ in found]) > 0)


def test_a_stream_that_is_cut_comes_back_and_a_corrupt_frame_is_counted():
    pictures = [picture(number) for number in range(20)]
    told = []
    server = MjpegServer([*pictures[:5], b"no picture" * 50, *pictures[5:]], rate_hz=50)
    try:
        with open_frames(server.address, told.append, timeout_s=60) as frames:
            last = next(frame.index for frame in frames if frame.index >= 12)
            assert frames.skipped == 1
            server.close()
            time.sleep(0.2)
            server = MjpegServer(pictures, rate_hz=50, port=server.port)
            for frame in frames:
                is_back = any("is back" in text for text in told)
                if (is_back and frame.index > last + 5) or frame.index > last + 500:  # else nobody said it
                    break
    finally:
        server.close()
    assert "1 frame was corrupt" in told[0]
    assert any("no more frames come; it is tried again after 0.5 s" in text for text in told)
    assert "is back after" in told[-1]


def test_a_stream_that_never_answers_has_a_time_limit():
    with MjpegServer([b""], rate_hz=1, repeat=0) as server:
        start_s = time.monotonic()
        with pytest.raises(SourceError, match=r"does not answer within 0\.5 s"):
            open_frames(server.address, timeout_s=0.5)
        assert time.monotonic() - start_s < 60
    with pytest.raises(SourceError, match="nothing answers there"):
        open_frames(server.address, timeout_s=60)


_SDP = "v=0\r\ns=x\r\nt=0 0\r\nm=video 0 RTP/AVP 96\r\na=rtpmap:96 H264/90000\r\na=control:track1\r\n"


class RefusingRtsp(socketserver.StreamRequestHandler):
    """Describes a stream, or answers with another status, and can set up none over TCP."""

    describe = "200 OK"

    def handle(self):
        while first := self.rfile.readline():
            headers = list(iter(self.rfile.readline, b"\r\n"))
            (number,) = (line.decode().strip() for line in headers if line.lower().startswith(b"cseq"))
            status = {b"DESCRIBE": self.describe, b"SETUP": "461 Unsupported Transport"}.get(first.split()[0], "200 OK")
            body = _SDP if first.startswith(b"DESCRIBE") and status == "200 OK" else ""
            kind = f"Content-Type: application/sdp\r\nContent-Length: {len(body)}\r\n" if body else ""
            self.wfile.write(f"RTSP/1.0 {status}\r\n{number}\r\n{kind}\r\n{body}".encode())


@pytest.mark.parametrize(
    ("describe", "said"),
    [
        ("200 OK", "does not send RTP over TCP"),
        ("404 Not Found", "has no such stream"),
        ('401 Unauthorized\r\nWWW-Authenticate: Basic realm="tank"', "a name and a password"),
        ("500 Internal Server Error", "what answers is not a video"),
    ],
)
def test_an_rtsp_server_that_refuses_is_told_by_its_reason(describe, said):
    handler = type("Refusing", (RefusingRtsp,), {"describe": describe})
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            with pytest.raises(SourceError, match=said):
                open_frames(f"rtsp://127.0.0.1:{server.server_address[1]}/tank")
        finally:
            server.shutdown()


def test_pictures_may_be_given_as_paths(tmp_path):
    folder = write_folder(tmp_path / "film", range(3))
    frames = Pictures([folder / "frame2.png", folder / "frame0.png"], "two", rate_hz=4)
    assert [(number_of(frame.image), frame.time_s) for frame in frames] == [(2, 0.0), (0, 0.25)]


@pytest.mark.parametrize("at", [0, 3])
def test_frames_of_a_size_that_the_camera_cannot_be_for_are_left_out_and_said_once(tmp_path, at):
    folder, told = write_folder(tmp_path / "film", range(8)), []
    for number in (at, at + 1, 6):
        cv2.imwrite(str(folder / f"frame{number}.png"), np.zeros((120, 100), np.uint8))
    cv2.imwrite(str(folder / "frame7.png"), cv2.resize(picture(7), (320, 240)))  # as the camera rescaled
    with open_frames(str(folder), told.append, rate_hz=10) as frames:
        found = [frame.index for frame in frames.fitting(frames, CAMERA.for_size(160, 120))]
        assert frames.skipped == 3
    assert found == [index for index in range(8) if index not in (at, at + 1, 6)]
    assert [line.partition("film: ")[2] for line in told] == [
        f"frame {at} has 100 x 120 pixels, but the camera is for 160 x 120; such frames are left out"
    ]
