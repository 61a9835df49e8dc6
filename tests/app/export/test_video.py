import subprocess
import sys

import av
import numpy as np
import pytest
from dockpose.app.errors import UserError
from dockpose.app.export.video import VideoFile
from dockpose.sources import open_frames


def pictures(count, shape, kind=np.uint8):
    rng = np.random.default_rng(0)
    top = 256 if kind == np.uint8 else 65536
    return [rng.integers(0, top, shape).astype(kind) for _ in range(count)]


@pytest.mark.parametrize(("shape", "kind"), [((47, 61), np.uint8), ((48, 64), np.uint16), ((47, 61, 3), np.uint8)])
def test_lossless_videos_give_back_every_level(tmp_path, shape, kind):
    wanted = pictures(4, shape, kind)
    with VideoFile(tmp_path / "a.mkv", 10.0) as video:
        for picture in wanted:
            video.write(picture)
    with open_frames(str(tmp_path / "a.mkv")) as frames:
        found = list(frames)
    for picture, frame in zip(wanted, found, strict=True):
        np.testing.assert_array_equal(frame.image, picture)
    assert [frame.time_s for frame in found] == [0.0, 0.1, 0.2, 0.3]


def test_matroska_keeps_microseconds_and_the_time_of_day(tmp_path):
    times_s = [0.0, 0.013337, 0.5, 0.500041, 1.25, 3600.000001]
    path = tmp_path / "a.mkv"
    with VideoFile(path, 25.0, metadata={"creation_time": "2026-07-01T12:00:00.123456Z"}) as video:
        for picture, time_s in zip(pictures(6, (48, 64)), times_s, strict=True):
            video.write(picture, time_s)
        unfinished = path.read_bytes()  # as a crash would leave it
    (tmp_path / "b.mkv").write_bytes(unfinished)
    for name, count in (("a.mkv", 6), ("b.mkv", 5)):
        with open_frames(str(tmp_path / name)) as frames:
            found = list(frames)
        assert [frame.time_s for frame in found][:count] == times_s[:count]
        taken_s = [1782907200.123456 + time_s for time_s in times_s[:count]]
        assert [frame.time_unix_s for frame in found][:count] == pytest.approx(taken_s, abs=1e-6)
    with av.open(str(path)) as container:  # FFmpeg itself, which checks what it reads, agrees
        assert container.duration == pytest.approx(3600.000001e6, abs=1e6 / 25 + 1)
        assert container.streams.video[0].average_rate == 25


def test_mp4_is_h264_at_the_times_of_the_frames(tmp_path):
    times_s = [0.0, 0.013337, 0.5, 0.500041, 1.25]
    with VideoFile(tmp_path / "a.mp4", 25.0) as video:
        for picture, time_s in zip(pictures(5, (49, 65, 3)), times_s, strict=True):
            video.write(picture, time_s)
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")  # browsers play these
        assert (stream.width, stream.height) == (64, 48)
        assert [float(frame.time) for frame in container.decode(stream)] == pytest.approx(times_s, abs=1e-6)


def test_times_that_do_not_rise_are_kept_apart(tmp_path):
    with VideoFile(tmp_path / "a.mp4", 25.0) as video:
        for picture, time_s in zip(pictures(4, (48, 64)), (0.0, 0.2, 0.2, 0.1), strict=True):
            video.write(picture, time_s)
    with open_frames(str(tmp_path / "a.mp4")) as frames:
        assert len(list(frames)) == 4


_WRITES = """
import sys, numpy as np
from pathlib import Path
from dockpose.app.export.video import VideoFile
video = VideoFile(Path(sys.argv[1]), 25.0)
for number in range(10_000):
    video.write(np.full((48, 64), number % 250, np.uint8))
    print(number, flush=True)
"""


def test_an_mp4_whose_writer_is_killed_has_all_frames_but_the_last(tmp_path):
    path, done = tmp_path / "a.mp4", 0
    with subprocess.Popen([sys.executable, "-c", _WRITES, str(path)], stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        while done < 60:
            done = int(writer.stdout.readline()) + 1
        writer.kill()
    with open_frames(str(path)) as frames:
        assert len(list(frames)) >= done - 1
    with av.open(str(path)) as container:
        assert sum(1 for _ in container.decode(video=0)) >= done - 1


@pytest.mark.parametrize(
    ("name", "shape", "kind", "words"),
    [
        ("a.mp4", (48, 64), np.uint16, "stores 8 bits"),
        ("a.mkv", (48, 64, 3), np.uint16, "stores 8 bits"),
        ("no/a.mp4", (48, 64), np.uint8, "there is no such folder"),
    ],
)
def test_what_cannot_be_written_is_said(tmp_path, name, shape, kind, words):
    with pytest.raises(UserError, match=words), VideoFile(tmp_path / name, 25.0) as video:
        video.write(pictures(1, shape, kind)[0])
