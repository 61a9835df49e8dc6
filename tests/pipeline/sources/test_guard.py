"""Films whose packets are lost or damaged: no picture is given that differs from that of the whole film."""

import io
from fractions import Fraction

import av
import numpy as np
import pytest
from dockpose.sources.guard import Guard

KEYS = 10  # frames from one key frame to the next
COUNT = 30
QUIET = "log-level=none:"
CODINGS = {
    "slices": (
        "libx264",
        {"tune": "zerolatency", "x264-params": f"{QUIET}sliced-threads=0:slices=3:keyint={KEYS}:scenecut=0"},
    ),
    "B frames": ("libx264", {"x264-params": f"{QUIET}bframes=3:keyint={KEYS}:scenecut=0"}),
    "open GOP": ("libx264", {"x264-params": f"{QUIET}bframes=3:keyint={KEYS}:open-gop=1:scenecut=0"}),
    "intra refresh": ("libx264", {"tune": "zerolatency", "x264-params": f"{QUIET}intra-refresh=1:keyint={KEYS}"}),
    "H.265": ("libx265", {"x265-params": f"{QUIET}slices=3:bframes=0:ctu=16:keyint={KEYS}:scenecut=0"}),
    "H.265, open GOP": ("libx265", {"x265-params": f"{QUIET}bframes=2:keyint={KEYS}:open-gop=1:scenecut=0"}),
    "MPEG-2": ("mpeg2video", {"g": str(KEYS), "bf": "2", "sc_threshold": "1000000000"}),
    "MPEG-4": ("mpeg4", {"g": str(KEYS)}),
    "VP9": ("libvpx-vp9", {"g": str(KEYS), "deadline": "realtime", "cpu-used": "8"}),
    "FFV1": ("ffv1", {"level": "3", "slicecrc": "1"}),
    "Motion JPEG": ("mjpeg", {}),
}


def film(name, container="matroska"):
    codec, options = CODINGS[name]
    still, file = np.random.default_rng(0).integers(0, 60, (192, 192)), io.BytesIO()
    with av.open(file, "w", format=container) as out:
        stream = out.add_stream(codec, rate=25, options=options)
        stream.width = stream.height = 192
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.codec_context.gop_size = KEYS
        for number in range(COUNT):
            picture = still.astype(np.uint8)
            picture[40:90, 10 + 3 * number : 20 + 3 * number] = 250
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format=stream.pix_fmt)
            frame.pts, frame.time_base = number, Fraction(1, 25)
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))
    return file.getvalue()


def guarded(data, change=lambda number, data: data, threads=1):
    """The pictures of a film by their times, of which each packet was changed; None loses it."""
    given = {}
    with av.open(io.BytesIO(data), "r") as container:
        stream = container.streams.video[0]
        # As films are opened: of several FFV1 frames at a time FFmpeg spoils that before a damaged one.
        stream.thread_type = "SLICE" if stream.codec_context.name == "ffv1" else "FRAME"
        stream.codec_context.thread_count = threads
        guard = Guard(stream.codec_context)
        for number, packet in enumerate(container.demux(stream)):
            changed = change(number, bytes(packet)) if packet.size else b""
            if changed is None:
                continue
            other = packet
            if changed != bytes(packet):
                other = av.Packet(changed)
                other.pts, other.dts, other.time_base = packet.pts, packet.dts, packet.time_base
            given.update({frame.pts: frame.to_ndarray(format="gray") for frame in guard.decode(other)})
    return given, guard.left_out


def units(data):
    at = 0
    while at < len(data):
        begin, at = at, at + 4 + int.from_bytes(data[at : at + 4], "big")
        yield data[begin:at]


def without_slice(data, which):
    return b"".join(unit for number, unit in enumerate(units(data)) if number != which)


def is_right(given, whole):
    return all(np.array_equal(picture, whole[time]) for time, picture in given.items())


@pytest.mark.parametrize("name", CODINGS)
@pytest.mark.parametrize("threads", [1, 3])
def test_of_a_whole_film_each_picture_is_given_as_it_is(name, threads):
    data = film(name)
    with av.open(io.BytesIO(data), "r") as container:
        plain = {frame.pts: frame.to_ndarray(format="gray") for frame in container.decode(video=0)}
    given, left_out = guarded(data, threads=threads)
    assert (len(plain), left_out) == (COUNT, 0)
    assert list(given) == list(plain)
    assert is_right(given, plain)


@pytest.mark.parametrize("name", [name for name in CODINGS if name != "VP9"])  # whose decoder takes what there is
@pytest.mark.parametrize("threads", [1, 3])
def test_of_a_film_with_half_a_packet_no_picture_is_made_up(name, threads):
    data = film(name)
    whole, _ = guarded(data)
    given, _ = guarded(data, lambda number, data: data[: len(data) // 2] if number == 13 else data, threads)
    assert is_right(given, whole)
    # Those before, and of those after all from the next key frame on; a wave of intra refresh takes twice as long.
    least = COUNT - 1 if name == "Motion JPEG" else COUNT - 2 * KEYS if name == "intra refresh" else COUNT - KEYS
    assert least <= len(given) < COUNT


@pytest.mark.parametrize("name", ["slices", "B frames", "intra refresh", "H.265", "H.265, open GOP"])
def test_a_picture_that_is_lost_is_missed(name):
    data = film(name)
    whole, _ = guarded(data)
    given, _ = guarded(data, lambda number, data: None if number in (12, 13, 14) else data)
    assert is_right(given, whole)
    assert COUNT - 2 * KEYS <= len(given) < COUNT - 3


@pytest.mark.parametrize("name", ["slices", "H.265"])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_slice_that_is_lost_is_missed(name, which):
    data = film(name)
    whole, _ = guarded(data)
    given, _ = guarded(data, lambda number, data: without_slice(data, which) if number == 13 else data)
    assert is_right(given, whole)
    assert len(given) == COUNT - 7  # 13 to 19


@pytest.mark.parametrize("name", ["slices", "open GOP", "H.265, open GOP", "MPEG-2", "MPEG-4"])
def test_of_a_film_that_begins_between_key_frames_pictures_are_whole_from_the_first_one_on(name):
    data = film(name)
    whole, _ = guarded(data)
    given, _ = guarded(data, lambda number, data: None if number < 4 else data)
    assert is_right(given, whole)
    assert COUNT - KEYS - 2 <= len(given) <= COUNT - KEYS + 2
