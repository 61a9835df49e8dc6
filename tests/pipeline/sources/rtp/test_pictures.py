import pytest
from dockpose.sources.rtp.packets import Packet
from dockpose.sources.rtp.pictures import H264, H265, Assembly, Picture, coding_of

START = b"\0\0\0\1"
SPS, PPS, KEY, INTER = b"\x67sps", b"\x68pps", b"\x65key", b"\x41inter"
VPS5, SPS5, PPS5, KEY5 = b"\x40\1v", b"\x42\1s", b"\x44\1p", b"\x26\1ky"
KEY_PICTURE, INTER_PICTURE = (SPS, PPS, KEY), (INTER, INTER)


def taken(assembly: Assembly, *pictures: tuple[bytes, ...], lost=(), are_ends_marked=True) -> list[tuple[int, Picture]]:
    """What comes of pictures of several payloads each, with the number of the one with whose packet it came.

    Those that are lost are named by both their places.
    """
    found, is_after_gap = [], False
    for number, payloads in enumerate(pictures):
        for place, payload in enumerate(payloads):
            is_last = are_ends_marked and place == len(payloads) - 1
            packet = Packet(0, (2**32 - 4000 + 3000 * number) % 2**32, 1, 96, is_last, payload)
            complete = [] if (number, place) in lost else assembly.take(packet, is_after_gap)
            found += [(number, one) for one in complete]
            is_after_gap = (number, place) in lost
    return found


@pytest.mark.parametrize(
    ("coding", "described", "payloads", "units"),
    [
        (H264, [], [SPS, PPS, KEY], [SPS, PPS, KEY]),
        (H264, [], [KEY], None),
        (H264, [SPS, PPS], [KEY], [SPS, PPS, KEY]),
        (H264, [], [b"\x78" + b"\0\4" + SPS + b"\0\4" + PPS, KEY], [SPS, PPS, KEY]),
        # The first part, one between and the last, each with the unit's kind: 5, and 19 of H.265.
        (H264, [SPS, PPS], [b"\x7c\x85k", b"\x7c\x05e", b"\x7c\x45y"], [SPS, PPS, KEY]),
        (H265, [VPS5, SPS5, PPS5], [b"\x62\1\x93k", b"\x62\1\x53y"], [VPS5, SPS5, PPS5, KEY5]),
    ],
    ids=["single", "no sets", "sets of the description", "several in one", "parts", "parts of H.265"],
)
def test_units_make_a_picture(coding, described, payloads, units):
    found = taken(Assembly(coding, described), (INTER,), tuple(payloads))
    data = b"" if units is None else b"".join(START + unit for unit in units)
    assert found == ([] if units is None else [(1, Picture(data, True))])


@pytest.mark.parametrize(
    "payload",
    [b"", b"\x7c\x05e", b"\x7c\x85k", b"\x78\0\x09abc", b"\x78\0\0", b"\x1dxyz"],
    ids=["empty", "a part without its beginning", "or end", "longer than its packet", "of no length", "FU-B"],
)
def test_a_picture_with_what_is_no_unit_is_left_out(payload):
    assembly = Assembly(H264)
    assert [number for number, _ in taken(assembly, (INTER,), KEY_PICTURE, (INTER, payload), (INTER,))] == [1]
    assert assembly.left_out == 3


@pytest.mark.parametrize(
    ("pictures", "lost", "complete"),
    [
        ("IIKI", [(0, 0)], [2, 3]),
        ("KK", [], [1]),
        ("IKIIIKI", [(3, 0)], [1, 2, 5, 6]),
        ("IKIIK", [(2, 1)], [1, 4]),
        ("IKIIK", [(2, 0), (2, 1)], [1, 4]),
    ],
    ids=["no key before", "joined in the middle of a key", "a lost packet", "a lost last packet", "a lost picture"],
)
def test_what_lacks_a_packet_or_needs_what_does_is_left_out(pictures, lost, complete):
    assembly = Assembly(H264)
    sent = [KEY_PICTURE if kind == "K" else INTER_PICTURE for kind in pictures]
    assert [number for number, _ in taken(assembly, *sent, lost=lost)] == complete
    assert assembly.left_out == len(pictures) - len(complete) - ((2, 0) in lost)  # of which nothing came


def test_a_sender_that_marks_no_ends_is_understood_a_picture_later():
    sent = (INTER_PICTURE, KEY_PICTURE, INTER_PICTURE, INTER_PICTURE)
    found = taken(Assembly(H264), *sent, are_ends_marked=False)
    assert [(number, one.is_key) for number, one in found] == [(2, True), (3, False)]


@pytest.mark.parametrize(
    ("payload", "coding"),
    [(SPS, H264), (b"\x7c\1x", H264), (b"\x06\1x", H264), (b"\x78\1x", H264), (b"", H264), (VPS5, H265), (KEY5, H265)]
    + [(b"\x62\1x", H265), (b"\x46\1x", H265), (b"\x4e\1x", H265), (b"\x60\1x", H265)],
)
def test_a_payload_shows_its_coding(payload, coding):
    assert coding_of(payload) == coding
