"""Video files made by FFmpeg's own encoders: formats, levels, times, seeking, and files that are damaged."""

import re
import threading
from fractions import Fraction
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from dockpose.sources import SourceError, open_frames
from dockpose.sources.ffmpeg import whole_boxes

from tests.support.sources import by_number_as_in_order, taken

MICROSECONDS = Fraction(1, 1_000_000)
WIDTH, HEIGHT = 64, 48
# x265 gives the first of few frames any time of decoding where it may order them anew.
LOSSLESS = "lossless=1:bframes=0:log-level=none"


def ramp(number: int, levels: int) -> np.ndarray:
    """A picture that has all of so many levels, from another one on in each frame."""
    count = WIDTH * HEIGHT
    return ((np.arange(count) * levels // count + 37 * number) % levels).reshape(HEIGHT, WIDTH)


def write(path, codec, pixels, frames, times=None, options=None, rate_hz=25, tick=MICROSECONDS, date=None, flags=""):
    """Encode frames at times in ticks, or else so many a second."""
    frames = list(frames)
    with av.open(str(path), "w", container_options={"movflags": flags} if flags else {}) as container:
        container.metadata.update({} if date is None else {"creation_time": date})
        stream = container.add_stream(codec, rate=rate_hz, options=options or {})
        stream.width, stream.height, stream.pix_fmt = frames[0].width, frames[0].height, pixels
        if times is not None:
            stream.time_base = stream.codec_context.time_base = tick
        for number, frame in enumerate(frames):
            if times is None:
                frame.pts, frame.time_base = number, Fraction(1, rate_hz)
            else:
                frame.pts, frame.time_base = int(times[number]), tick
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def greys(count, levels=256, pixels="gray"):
    for number in range(count):
        picture = ramp(number, levels)
        deep = picture.astype(np.uint16)
        yield av.VideoFrame.from_ndarray(picture.astype(np.uint8) if levels == 256 else deep, format=pixels)


def luma(count, levels, pixels, low=0):
    """Frames whose brightness is the ramp, and without colour."""
    bits = levels.bit_length() - 1
    for number in range(count):
        frame = av.VideoFrame(WIDTH, HEIGHT, pixels)
        for place, plane in enumerate(frame.planes):
            wide = plane.line_size // (1 if bits == 8 else 2)
            values = np.full((plane.height, wide), levels // 2, np.uint8 if bits == 8 else np.uint16)
            if place == 0:
                values[:, :WIDTH] = low + ramp(number, levels - 2 * low)
            plane.update(values.tobytes())
        yield frame


@pytest.mark.parametrize(
    ("name", "codec", "pixels", "levels"),
    [("a.mkv", "ffv1", "gray", 256), ("a.avi", "ffv1", "gray16le", 65536), ("b.mkv", "ffv1", "gray10le", 1024)],
)
@pytest.mark.parametrize("grey", [False, True])
def test_lossless_grey_keeps_every_level(tmp_path, name, codec, pixels, levels, grey):
    path = write(tmp_path / name, codec, pixels, greys(3, levels, pixels), options={"level": "3"})
    found = taken(path, grey=grey)[0]
    assert len(found) == 3
    for number, frame in enumerate(found):
        assert frame.image.dtype == (np.uint8 if levels == 256 else np.uint16)
        np.testing.assert_array_equal(frame.image, ramp(number, levels))


def test_full_range_10_bit_h265_keeps_its_levels(tmp_path):
    options = {"x265-params": "lossless=1:log-level=none:range=full"}
    pictures = list(luma(3, 1024, "yuv420p10le"))
    for picture in pictures:
        picture.color_range = 2
    path = write(tmp_path / "a.mkv", "libx265", "yuv420p10le", pictures, options=options)
    for number, frame in enumerate(taken(path, grey=True)[0]):
        np.testing.assert_array_equal(frame.image, ramp(number, 1024))


def test_video_range_is_stretched_to_the_full_scale_and_keeps_levels_apart(tmp_path):
    # ITU-R BT.601: black is 16 and white 235 of 8 bits, four times that of 10 bits.
    options = {"x265-params": LOSSLESS}
    path = write(tmp_path / "a.mkv", "libx265", "yuv420p10le", luma(1, 1024, "yuv420p10le", low=64), options=options)
    stored = 64 + ramp(0, 1024 - 128)
    image = taken(path, grey=True)[0][0].image
    assert image.dtype == np.uint16
    np.testing.assert_array_equal(image, np.clip(np.rint((stored - 64) / 876 * 1023), 0, 1023))
    assert len(np.unique(image)) == 877  # 64 to 940; what is whiter than white is white


def test_brightness_alone_is_that_of_the_colours(tmp_path):
    # Grey in, so that colour plays no part; two roundings, in range and colour, of one level each.
    path = write(tmp_path / "a.mp4", "libx264", "yuv420p", luma(2, 256, "yuv420p", low=16), options={"qp": "0"})
    for colour, grey in zip(taken(path)[0], taken(path, grey=True)[0], strict=True):
        assert (colour.image.shape, grey.image.shape) == ((HEIGHT, WIDTH, 3), (HEIGHT, WIDTH))
        assert np.abs(colour.image.astype(int) - grey.image[..., None]).max() <= 2
        np.testing.assert_array_equal(grey.picture(), colour.image)


@pytest.mark.parametrize(
    ("name", "codec", "options", "rate_hz"),
    [
        ("a.mp4", "libx264", {"bf": "3", "g": "20"}, 1_000_000),
        ("a.mkv", "libx265", {"x265-params": "bframes=3:keyint=20:log-level=none"}, 1000),  # as Matroska's clock
        ("a.mp4", "mpeg4", {"g": "12", "bf": "2"}, 1000),  # whose clock has 65,535 ticks a second at most
    ],
)
def test_times_are_those_of_the_file_at_a_varying_rate(tmp_path, name, codec, options, rate_hz):
    times = np.cumsum(np.random.default_rng(1).integers(rate_hz // 300, rate_hz * 2 // 5, 60))
    times -= times[0]
    pictures = luma(60, 256, "yuv420p", 16)
    path = write(tmp_path / name, codec, "yuv420p", pictures, times, options, tick=Fraction(1, rate_hz))
    with open_frames(str(path), grey=True) as frames:
        found = by_number_as_in_order(frames, 60, (59, 3, 41, 0, 40, 58, 17), range(33, 52))
    assert [frame.time_s for frame in found] == pytest.approx(times / rate_hz, abs=1e-6)


@pytest.fixture(scope="module", params=["faststart", "frag_keyframe+empty_moov"])
def mp4(request, tmp_path_factory):
    """An MP4 of 100 frames, and where each begins and ends in it."""
    path = write(
        tmp_path_factory.mktemp("mp4") / "whole.mp4",
        "libx264",
        "yuv420p",
        luma(100, 256, "yuv420p", 16),
        options={"g": "5", "bf": "0"},
        flags=request.param,
    )
    with av.open(str(path)) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size]
    return path.read_bytes(), [(packet.pos or 0, (packet.pos or 0) + packet.size) for packet in packets]


# The encoder does not always give the same bytes, so that places are told by the frames. Frame 60 begins a fragment,
# 8 bytes after its box, before which there is the fragment's own head.
@pytest.mark.parametrize(("number", "before"), [(44, -5), (55, -5), (67, -5), (60, 1), (60, 6), (60, 8), (60, 20)])
def test_an_mp4_cut_in_the_middle_gives_every_whole_frame_and_one_line(tmp_path, mp4, number, before):
    data, places = mp4
    at, path = places[number][0] - before, tmp_path / "a.mp4"
    path.write_bytes(data[:at])
    whole = sum(end <= at for _, end in places)
    found, told, frames = taken(path, grey=True)
    # In fragments the index of a fragment stands before its frames, so that all whole ones are found in both.
    assert [frame.index for frame in found[:whole]] == list(range(whole))
    assert len(found) <= whole + 1  # the frame that was cut may be decoded in part
    (line,) = told
    words = re.search(r"a\.mp4: the video is cut short: (\d+) (of the 100 )?frames are there", line)
    assert int(words[1]) - len(found) in (0, 1)
    assert frames.is_cut_short


@pytest.mark.parametrize(
    ("end", "is_cut"),
    [
        (b"", False),
        (b"\0", True),
        (b"\0\0\0", True),
        (b"\0\0\0\x10mda", True),
        (b"\0\0\0\x10mdat", True),
        (b"\0\0\0\x10mdat12345678", False),
        (b"\0\0\0\x01mdat\0\0\0", True),  # its size would follow in 64 bits
        (b"\0\0\0\x01mdat\0\0\0\0\0\0\0\x10", False),
        (b"\0\0\0\0mdat1234", False),  # as far as the file goes
        (b"\0\0\0\x08moof", True),  # frames would follow
        (b"\x7f\0\0\1\x0a\x85\1\x0a9876", False),  # a camera's own data behind the boxes
        (b"\0\0\0\x08moof\x7f\0\0\1\x0a\x85\1\x0a", True),
    ],
)
def test_boxes_break_off_wherever_the_file_does(tmp_path, end, is_cut):
    (tmp_path / "a.mp4").write_bytes(b"\0\0\0\x0cftypisom" + end)
    assert whole_boxes(tmp_path / "a.mp4")[1] is is_cut


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv"])
def test_a_track_of_few_large_pictures_is_not_the_film(tmp_path, name):
    with av.open(str(tmp_path / name), "w") as container:
        streams = [container.add_stream("mpeg4", rate=25) for _ in range(2)]
        for stream, scale in zip(streams, (2, 1), strict=True):
            stream.width, stream.height, stream.pix_fmt = scale * WIDTH, scale * HEIGHT, "yuv420p"
        for number in range(10):
            for stream in streams[0 if number < 2 else 1 :]:
                frame = av.VideoFrame(stream.width, stream.height, "yuv420p")
                frame.pts, frame.time_base = number, Fraction(1, 25)
                container.mux(stream.encode(frame))
        for stream in streams:
            container.mux(stream.encode(None))
    found, told, _ = taken(tmp_path / name)
    assert [frame.image.shape[:2] for frame in found] == [(HEIGHT, WIDTH)] * 10
    assert told == [f"{tmp_path / name}: has 2 video streams; number 1 (64 x 48) is taken, not 0 (128 x 96)"]


def test_a_file_of_sound_alone_has_no_video(tmp_path):
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    with pytest.raises(SourceError, match="has no video in it"):
        open_frames(str(tmp_path / "a.mkv"))


def test_a_recording_on_a_server_is_refused(tmp_path):
    name = made(tmp_path / "a.mkv").name
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=tmp_path)) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}).start()
        try:
            with pytest.raises(SourceError, match=r"a\.mkv: is a recording and not live; download it"):
                open_frames(f"http://127.0.0.1:{server.server_port}/{name}", timeout_s=60)
        finally:
            server.shutdown()


@pytest.mark.parametrize(
    ("name", "codec", "date", "began_s"),
    [
        ("a.mkv", "ffv1", "2026-07-01T12:00:00.123456Z", 1782907200.123456),
        ("a.mkv", "ffv1", "2026-07-01T12:00:00Z", None),  # as programs date a file that they convert
        ("a.mkv", "ffv1", "1970-01-01T00:00:07.250000Z", None),  # a clock that was never set
        ("a.mkv", "ffv1", "2190-01-01T00:00:07.250000Z", None),
        ("a.mkv", "ffv1", None, None),
        ("a.mp4", "libx264", "2026-07-01T12:00:00.123456Z", None),  # in whole seconds, and perhaps of the end
    ],
)
def test_the_time_of_day_is_told_where_the_file_is_sure_of_it(tmp_path, name, codec, date, began_s, monkeypatch):
    monkeypatch.setattr("time.time", lambda: 1782907200.0 + 3600)
    path = write(tmp_path / name, codec, "yuv420p", luma(3, 256, "yuv420p"), date=date)
    with open_frames(str(path)) as frames:
        found = [frame.time_unix_s for frame in frames]
        again = frames.at(2).time_unix_s
    wanted = [None] * 3 if began_s is None else [began_s + number / 25 for number in range(3)]
    assert found == (wanted if began_s is None else pytest.approx(wanted, abs=2e-6))
    assert again == found[2]


def made(path, codec="libx264", options=None, frames=range(20), **how):
    """A video whose frames are told by their brightness."""
    pictures = (
        av.VideoFrame.from_ndarray(np.full((HEIGHT, WIDTH), 20 + 4 * n, np.uint8), format="gray") for n in frames
    )
    write(path, codec, "yuv420p", (picture.reformat(format="yuv420p") for picture in pictures), options=options, **how)
    return path


def order_by_brightness(found):
    return bool((np.diff([int(frame.image[20, 40]) for frame in found]) > 0).all())


@pytest.mark.parametrize("bf", ["0", "2"])
@pytest.mark.parametrize("later_s", [0, 1000])  # FFmpeg takes the second for a clock that went round
def test_joined_transport_streams_give_every_frame_at_times_that_grow(tmp_path, bf, later_s):
    parts = []
    for number, shift_s in enumerate((later_s, 0)):
        how = {"times": range(25 * shift_s, 25 * shift_s + 20), "tick": Fraction(1, 25)}
        frames = range(20 * number, 20 * number + 20)
        part = made(tmp_path / f"{number}.ts", options={"bf": bf, "g": "10"}, frames=frames, **how)
        parts.append(part.read_bytes())
    (tmp_path / "joined.ts").write_bytes(b"".join(parts))
    told = []
    with open_frames(str(tmp_path / "joined.ts"), told.append, grey=True) as frames:
        found = list(frames)
        assert frames.at(25).time_s == 1.0
    assert [frame.time_s for frame in found] == pytest.approx(np.arange(40) / 25)
    assert order_by_brightness(found)
    assert len(told) == 1
    assert "joined.ts: its clock jumps at frame 20, as where files were joined" in told[0]


@pytest.mark.parametrize(
    ("name", "codec", "options", "told_hz"),
    [
        ("a.h264", "libx264", {"bf": "2"}, 25.0),
        ("a.264", "libx264", {"bf": "0"}, 25.0),
        ("a.hevc", "libx265", {"x265-params": "log-level=none:vui-timing-info=0"}, None),
        ("a.avi", "libx264", {"bf": "2"}, 25.0),  # has no times for showing
    ],
)
def test_raw_videos_come_in_order_by_their_rate_or_that_which_is_given(tmp_path, name, codec, options, told_hz):
    ending = {".264": ".h264"}.get(Path(name).suffix, Path(name).suffix)
    path = made(tmp_path / f"made{ending}", codec, options, range(20)).rename(tmp_path / name)
    found, told, _ = taken(path, grey=True)
    assert order_by_brightness(found)
    assert [frame.time_s for frame in found] == pytest.approx(np.arange(20) / 25)
    assert [("gives no frame rate; 25 frames" in line) for line in told] == ([True] if told_hz is None else [])
    times_s = [frame.time_s for frame in taken(path, rate_hz=10.0)[0]]
    assert times_s == pytest.approx(np.arange(20) / (25 if name == "a.avi" else 10))


@pytest.mark.parametrize("name", ["a.avi", "a.mjpeg"])
@pytest.mark.parametrize("number", [6, 18])
def test_a_frame_that_is_damaged_is_named(tmp_path, name, number):
    write(tmp_path / name, "mjpeg", "yuvj420p", (frame.reformat(format="yuvj420p") for frame in greys(20)))
    data = bytearray((tmp_path / name).read_bytes())
    begins = [match.start() for match in re.finditer(b"\xff\xd8\xff", data)]
    data[begins[number] + 4 : begins[number + 1] - 40] = bytes(begins[number + 1] - begins[number] - 44)
    (tmp_path / name).write_bytes(data)
    found, told, _ = taken(tmp_path / name)
    assert [frame.index for frame in found] == [index for index in range(20) if index != number]
    assert f"frame {number} is corrupt and left out" in told[-1]


@pytest.mark.parametrize("codec", ["libx264", "libx265", "mpeg2video"])
@pytest.mark.parametrize(("number", "left"), [(0, range(10, 20)), (6, [*range(6), *range(10, 20)]), (16, range(16))])
def test_after_a_damaged_frame_none_is_given_until_the_next_key_frame(tmp_path, codec, number, left):
    # Of the damaged frame a packet is missing; those after it are predicted from it, and the key frames are 0 and 10.
    rng, path = np.random.default_rng(0), tmp_path / "a.ts"
    still = rng.integers(0, 200, (HEIGHT, WIDTH))
    pictures = [(still + rng.integers(0, 40, still.shape)).astype(np.uint8) for _ in range(20)]
    grey = (av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p") for picture in pictures)
    how = {"libx265": {"x265-params": "log-level=none:bframes=0:keyint=10:qp=4"}, "mpeg2video": {"g": "10", "b": "9M"}}
    write(path, codec, "yuv420p", grey, options=how.get(codec, {"bf": "0", "qp": "4", "g": "10", "sc_threshold": "0"}))
    with av.open(str(path)) as container:
        places = [packet.pos or 0 for packet in container.demux(video=0) if packet.size]
    data = path.read_bytes()
    path.write_bytes(data[: places[number] + 188 * 6] + data[places[number] + 188 * 7 :])
    found, told, frames = taken(path)
    assert [frame.index for frame in found] == list(left)
    assert (frames.skipped, len(told)) == (20 - len(left), 1)
    assert f"{20 - len(left)} in all: damaged, or predicted from damaged ones" in told[0]
    with open_frames(str(path)) as frames:
        for index in (19, 9, 0, 12):
            if index in left:
                np.testing.assert_array_equal(frames.at(index).image, found[list(left).index(index)].image)
            else:
                with pytest.raises(SourceError, match=f"frame {index} of 20 is not there or corrupt"):
                    frames.at(index)


def test_a_coding_that_nothing_here_decodes_is_told(tmp_path):
    path = made(tmp_path / "a.mp4", frames=range(2))
    path.write_bytes(path.read_bytes().replace(b"avc1", b"zzzz"))
    with pytest.raises(SourceError, match="coding cannot be decoded here"):
        open_frames(str(path))


def eight_frames(path, codec, pix_fmt="yuv420p"):
    """A video of eight frames, ten a second, each of its own brightness."""
    levels = (np.full((72, 96), 20 * number + 30, np.uint8) for number in range(8))
    frames = (av.VideoFrame.from_ndarray(image, format="gray") for image in levels)
    return bytearray(write(path, codec, pix_fmt, frames, rate_hz=10).read_bytes())


def taken_of(path, data):
    path.write_bytes(data)
    return taken(path)


def test_the_head_of_a_matroska_file_may_give_its_size_in_eight_bytes(tmp_path):
    data = eight_frames(tmp_path / "a.mkv", "ffv1")
    assert data[4] & 0x80
    data[4:5] = bytes([1, *bytes(6), data[4] & 0x7F])  # as GStreamer writes it
    assert not taken_of(tmp_path / "a.mkv", data)[2].is_cut_short
    assert taken_of(tmp_path / "a.mkv", data[: len(data) * 2 // 3])[2].is_cut_short


def test_a_header_that_counts_more_frames_than_there_are_is_an_estimate(tmp_path):
    data = eight_frames(tmp_path / "a.avi", "mjpeg", "yuvj420p")
    for begin in (data.find(b"avih") + 24, data.find(b"strh") + 40):
        assert data[begin : begin + 4] == bytes((8, 0, 0, 0))
        data[begin : begin + 4] = bytes((0x39, 1, 0, 0))
    found, told, frames = taken_of(tmp_path / "a.avi", data)
    assert (len(found), frames.count, frames.skipped, frames.is_cut_short, told) == (8, 8, 0, False, [])


def test_frames_before_the_start_of_an_edit_list_are_not_missed(tmp_path):
    data = eight_frames(tmp_path / "a.mp4", "mpeg4")
    begin = data.find(b"elst") + 12  # the duration in thousandths of a second, and the start in 10240ths
    assert int.from_bytes(data[begin : begin + 4], "big") == 800
    data[begin : begin + 8] = (600).to_bytes(4, "big") + (2048).to_bytes(4, "big")
    found, told, frames = taken_of(tmp_path / "a.mp4", data)
    assert [round((frame.image.mean() - 30) / 20) for frame in found] == [2, 3, 4, 5, 6, 7]
    assert (frames.count, frames.skipped, frames.is_cut_short, told) == (6, 0, False, [])


@pytest.mark.parametrize(("name", "codec", "pix_fmt"), [("a.avi", "mjpeg", "yuvj420p"), ("a.mkv", "ffv1", "yuv420p")])
def test_a_file_that_is_shorter_than_its_container_says_is_cut_short(tmp_path, name, codec, pix_fmt):
    data = eight_frames(tmp_path / name, codec, pix_fmt)
    found, told, frames = taken_of(tmp_path / name, data[: len(data) * 2 // 3])
    assert 1 < len(found) < 8
    assert frames.is_cut_short
    assert "the video is cut short" in told[0]


def noisy(number):
    rng = np.random.default_rng(number)
    return av.VideoFrame.from_ndarray(rng.integers(60, 200, (HEIGHT, WIDTH)).astype(np.uint8), format="gray")


@pytest.mark.parametrize("most_b", [0, 2])
@pytest.mark.parametrize("codec", ["h264", "hevc"])
def test_a_bare_stream_that_is_cut_in_the_midst_of_a_picture_gives_only_whole_ones(tmp_path, codec, most_b):
    encoder = {"h264": "libx264", "hevc": "libx265"}[codec]
    options = {f"{encoder[3:]}-params": f"keyint=6:bframes={most_b}:log-level=none"}
    frames = [noisy(number).reformat(format="yuv420p") for number in range(10)]
    path = write(tmp_path / f"a.{codec}", encoder, "yuv420p", frames, options=options)
    data = path.read_bytes()
    whole = {frame.image.tobytes() for frame in taken(path)[0]}
    assert len(whole) == 10
    begins = [match.start() for match in re.finditer(b"\0\0\1", data)]
    slices = [(begin, end) for begin, end in pairwise([*begins, len(data)]) if end - begin > 200]
    for begin, end in slices[-5:]:
        cut = int(np.random.default_rng(end).integers(begin + 20, end - 10))  # of fewer bytes nobody can tell
        found, told, frames = taken_of(path, data[:cut])
        assert {frame.image.tobytes() for frame in found} < whole
        assert frames.skipped
        assert told[-1].endswith("the file ends there, perhaps cut short") or most_b


def test_bytes_behind_the_last_whole_frame_of_a_y4m_are_a_frame_that_is_cut(tmp_path):
    data = b"YUV4MPEG2 W64 H48 F25:1 Cmono\n" + 3 * (b"FRAME\n" + bytes(64 * 48))
    found, told, frames = taken_of(tmp_path / "a.y4m", data)
    assert (len(found), frames.is_cut_short, told) == (3, False, [])
    found, told, frames = taken_of(tmp_path / "a.y4m", data[:-100])
    assert (len(found), frames.is_cut_short, len(told)) == (2, True, 1)


@pytest.mark.parametrize("name", ["a.avi", "a.mov"])
def test_raw_grey_of_16_bits_that_its_container_calls_colours_is_refused(tmp_path, name):
    frames = (av.VideoFrame.from_ndarray(np.full((HEIGHT, WIDTH), 999, np.uint16), format="gray16le") for _ in "ab")
    write(tmp_path / name, "rawvideo", "gray16le", frames)
    with pytest.raises(SourceError, match=r"grey or in colours \(RGB555\), and does not say which; convert it to FFV1"):
        open_frames(tmp_path / name)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_an_mxf_that_is_cut_short_is_told(tmp_path, share):
    noise = (np.random.default_rng(number).integers(0, 255, (480, 640)).astype(np.uint8) for number in range(10))
    frames = (av.VideoFrame.from_ndarray(each, format="gray") for each in noise)
    write(tmp_path / "whole.mxf", "mpeg2video", "yuv420p", frames)
    data = (tmp_path / "whole.mxf").read_bytes()
    (tmp_path / "cut.mxf").write_bytes(data[: int(share * len(data))])
    found, told, _ = taken(tmp_path / "whole.mxf")
    assert len(found) == 10
    assert told == []
    assert "the video is cut short" in taken(tmp_path / "cut.mxf")[1][0]


def test_a_jpeg_with_half_its_pixels_and_an_end_is_left_out(tmp_path):
    picture = np.random.default_rng(0).integers(0, 60, (480, 640)).astype(np.uint8)
    data = cv2.imencode(".jpg", picture)[1].tobytes()
    (tmp_path / "a.mjpeg").write_bytes(data + data[: len(data) // 2] + b"\xff\xd9" + 2 * data)
    assert [frame.index for frame in taken(tmp_path / "a.mjpeg")[0]] == [0, 2, 3]
