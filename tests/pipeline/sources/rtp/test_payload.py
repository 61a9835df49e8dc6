import io
from typing import Any

import av
import cv2
import numpy as np
import pytest
from dockpose.sources.ffmpeg import opened
from dockpose.sources.rtp.packets import packet_in
from dockpose.sources.rtp.payload import H264, H265, Jpeg, name_of, payload_of

from tests.pipeline.sources.test_sources import number_of, picture
from tests.support.rtp import datagrams

START = b"\0\0\0\1"
SPS, PPS, KEY, INTER = b"\x67sps", b"\x68pps", b"\x65key", b"\x41inter"


V5, S5, P5 = b"\x40\1v", b"\x42\1s", b"\x44\1p"


@pytest.mark.parametrize(
    ("payload", "told", "parts", "units", "is_key"),
    [
        (H264(), [], [SPS, PPS, KEY], [SPS, PPS, KEY], True),
        (H264(), [], [INTER], [INTER], False),
        (H264(), [], [KEY], [KEY], False),
        (H264(), [SPS, PPS], [KEY], [SPS, PPS, KEY], True),
        (H264(), [], [b"\x78" + b"\0\4" + SPS + b"\0\4" + PPS, KEY], [SPS, PPS, KEY], True),
        # The first part, one between and the last, each with the unit's kind: 5, and 19 of H.265.
        (H264(), [], [b"\x7c\x85k", b"\x7c\x05e", b"\x7c\x45y"], [KEY], False),
        (H265(), [V5, S5, P5], [b"\x62\1\x93k", b"\x62\1\x53y"], [V5, S5, P5, b"\x26\1ky"], True),
    ],
    ids=["single", "needs another", "no sets", "sets of the description", "several in one", "parts", "parts of H.265"],
)
def test_units_make_a_picture(payload, told, parts, units, is_key):
    payload.remember(told)
    for part in parts:
        payload.add(part)
    assert payload.finish() == (b"".join(START + unit for unit in units), is_key)


@pytest.mark.parametrize(
    "payloads",
    [
        [b""],
        [b"\x7c\x05e"],  # a part without its beginning
        [b"\x7c\x85k"],  # or end
        [b"\x78\0\x09abc"],  # a unit longer than its packet
        [b"\x78\0\0"],
        [b"\x1dxyz"],  # FU-B
    ],
)
def test_what_is_no_unit_is_refused(payloads):
    payload = H264()

    def put_together() -> None:
        for one in payloads:
            payload.add(one)
            payload.finish()

    with pytest.raises(ValueError, match=r"payload|part|unit"):
        put_together()


def test_tables_of_jpeg_by_quality_are_those_of_the_standard():
    """At quality 50 the tables of T.81, annex K, unscaled: 16, 11, 12, 14 begin them in zigzag order; 17, 18, 18."""
    payload = Jpeg()
    payload.add(bytes([0, 0, 0, 0, 1, 50, 2, 2]) + b"scan")
    data, _ = payload.finish()
    first = data.index(b"\xff\xdb\0\x43\0") + 5
    second = data.index(b"\xff\xdb\0\x43\1") + 5
    assert list(data[first : first + 8]) == [16, 11, 12, 14, 12, 10, 16, 14]
    assert list(data[second : second + 6]) == [17, 18, 18, 24, 21, 24]
    assert list(data[first + 60 : first + 64]) == [92, 101, 103, 99]


@pytest.mark.parametrize(
    "payload",
    [
        b"\0\0\0\0\1",
        bytes([0, 0, 0, 9, 1, 50, 2, 2]) + b"later part",
        bytes([0, 0, 0, 0, 7, 50, 2, 2]) + b"of another type",
        bytes([0, 0, 0, 0, 1, 50, 0, 2]) + b"without a size",
        bytes([0, 0, 0, 0, 1, 255, 2, 2, 0, 0, 0, 0]) + b"without tables",
    ],
)
def test_what_is_no_jpeg_is_refused(payload):
    with pytest.raises(ValueError, match=r"JPEG|part|payload"):
        Jpeg().add(payload)


def test_a_jpeg_cut_into_packets_by_hand_is_the_one_that_was_cut():
    """OpenCV's file at quality 80, its scan cut in two, in colour halved both ways as OpenCV writes it."""
    rng = np.random.default_rng(3)
    image = cv2.resize(rng.integers(0, 255, (8, 10, 3), dtype=np.uint8), (160, 128))
    file = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
    scan = file[file.index(b"\xff\xda") + 14 : -2]
    payload = Jpeg()
    for at in (0, 700):
        part = scan[at : at + 700] if at == 0 else scan[at:]
        payload.add(bytes([0]) + at.to_bytes(3, "big") + bytes([1, 80, 20, 16]) + part)
    data, is_key = payload.finish()
    assert is_key
    seen, wanted = (next(opened(io.BytesIO(one), format="mjpeg").decode(video=0)) for one in (data, file))
    np.testing.assert_array_equal(seen.to_ndarray(format="bgr24"), wanted.to_ndarray(format="bgr24"))


@pytest.mark.parametrize("coding", ["H264", "H265", "JPEG"])
def test_what_ffmpeg_sends_is_put_together_and_named(coding):
    payload = payload_of(coding)
    assert payload is not None
    decoder: Any = av.CodecContext.create(payload.codec, "r")
    seen, keys, names = [], [], set()
    for number, parts in enumerate(datagrams([picture(number) for number in range(12)], coding, key_every=5)):
        for data in parts:
            packet = packet_in(data)
            assert packet is not None
            names.add(name_of(packet.payload_type, packet.payload))
            payload.add(packet.payload)
        data, is_key = payload.finish()
        payload.begin()
        keys += [number] if is_key else []
        seen += decoder.decode(av.Packet(data))
    seen += decoder.decode(None)
    assert [number_of(frame.to_ndarray(format="gray")) for frame in seen] == list(range(12))
    assert keys == (list(range(12)) if coding == "JPEG" else [0, 5, 10])
    assert names - {None} == {coding}


def test_codings_that_are_not_read_have_no_name():
    assert payload_of("VP8") is None
    assert name_of(96, b"") is None
    assert name_of(96, b"\x50\1x") is None
