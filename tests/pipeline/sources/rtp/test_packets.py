import socket

import pytest
from dockpose.sources import SourceError
from dockpose.sources.rtp.packets import Described, Ordered, Packet, Receiver, described, packet_in

from tests.support.rtp import free_port

SDP = """v=0
o=- 0 0 IN IP4 127.0.0.1
s=tank
c=IN IP4 239.1.2.3/32
t=0 0
m=audio 5004 RTP/AVP 97
a=rtpmap:97 opus/48000
m=video 5600 RTP/AVP 96
a=rtpmap:96 H264/90000
a=fmtp:96 packetization-mode=1; sprop-parameter-sets=Z0LAFA==,aM48gA==; profile-level-id=42C014
"""


def packet(sequence: int, is_last: bool = False) -> Packet:
    return Packet(sequence % 2**16, 0, 7, 96, is_last, b"x")


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("rtp://:5600", Described("", 5600)),
        ("RTP://127.0.0.1:5600", Described("127.0.0.1", 5600)),
        ("rtp://239.1.2.3:5004", Described("239.1.2.3", 5004)),
    ],
)
def test_an_address_names_a_port(address, found):
    assert described(address) == found


@pytest.mark.parametrize("address", ["rtp://", "rtp://tank", "rtp://:99999", "rtp://:x"])
def test_an_address_without_a_port_is_told(address):
    with pytest.raises(SourceError, match="names no UDP port"):
        described(address)


def test_a_description_tells_port_coding_group_and_parameter_sets(tmp_path):
    (tmp_path / "tank.sdp").write_text(SDP)
    found = described(str(tmp_path / "tank.sdp"))
    assert found == Described("239.1.2.3", 5600, 96, "H264", (b"\x67\x42\xc0\x14", b"\x68\xce\x3c\x80"))


def test_a_description_of_jpeg_needs_no_name(tmp_path):
    (tmp_path / "tank.sdp").write_text("v=0\r\nc=IN IP4 127.0.0.1\r\nm=video 5000/2 RTP/AVP 26\r\n")
    assert described(str(tmp_path / "tank.sdp")) == Described("", 5000, 26, "JPEG")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "describes no video over RTP"),
        ("m=audio 5004 RTP/AVP 97", "describes no video over RTP"),
        ("m=video 0 RTP/AVP 96", "describes no video over RTP"),
        ("m=video 5600 RTP/AVP 96\na=rtpmap:96 VP8/90000", "describes VP8; H264, H265 and JPEG"),
        ("m=video 5600 RTP/AVP 33", "describes payload 33;"),
    ],
)
def test_a_description_of_something_else_is_told(tmp_path, text, why):
    (tmp_path / "tank.sdp").write_text(text)
    with pytest.raises(SourceError, match=why):
        described(str(tmp_path / "tank.sdp"))


def test_a_description_that_is_not_there_is_told(tmp_path):
    with pytest.raises(SourceError, match=r"none\.sdp: cannot be read"):
        described(str(tmp_path / "none.sdp"))


def test_a_packet_by_hand():
    head = bytes([0x80, 0x80 | 96, 0x12, 0x34, 0, 0, 0, 9, 0, 0, 0, 5])
    assert packet_in(head + b"abc") == Packet(0x1234, 9, 5, 96, True, b"abc")


def test_a_packet_with_everything_that_it_may_have():
    head = bytes([0x80 | 0x20 | 0x10 | 1, 96, 0, 1, 0, 0, 0, 9, 0, 0, 0, 5])
    contributing, extension, padding = b"cccc", b"\xbe\xde\0\1eeee", b"\0\0\3"
    assert packet_in(head + contributing + extension + b"abc" + padding) == Packet(1, 9, 5, 96, False, b"abc")


@pytest.mark.parametrize(
    "data",
    [b"", b"\x80" * 11, b"\x40" + bytes(20), bytes([0x80, 200]) + bytes(30), bytes([0xB0, 96]) + b"\xff" * 30],
    ids=["empty", "short", "version 1", "a report", "an extension beyond its end"],
)
def test_what_is_no_packet(data):
    assert packet_in(data) is None


def order(ordered: Ordered, *arrivals: tuple[int, float]) -> list[tuple[int, bool]]:
    return [(one.sequence, gap) for number, at in arrivals for one, gap in ordered.put(packet(number), at)]


@pytest.mark.parametrize(
    ("numbers", "found"),
    [
        ([65534, 0, 65535, 1, 3, 2], [(number, False) for number in (65534, 65535, 0, 1, 2, 3)]),
        ([5, 5, 4, 6], [(5, False), (6, False)]),
        ([20000, 10, 11], [(20000, False), (10, True), (11, False)]),
    ],
    ids=["over the end of the count", "twice or too late", "a sender that counts from elsewhere"],
)
def test_packets_come_in_their_order(numbers, found):
    assert order(Ordered(), *((number, 0.0) for number in numbers)) == found


def test_a_packet_that_does_not_come_is_waited_for_30_ms():
    ordered = Ordered()
    assert order(ordered, (1, 0.0), (3, 0.001), (4, 0.030)) == [(1, False)]
    assert order(ordered, (5, 0.032)) == [(3, True), (4, False), (5, False)]
    assert ordered.lost == 1
    assert order(ordered, (2, 0.040)) == []


def test_two_gaps_are_two():
    ordered = Ordered()
    assert order(ordered, (1, 0.0), (3, 0.0), (5, 0.0), (6, 0.1)) == [(1, False), (3, True)]
    assert order(ordered, (7, 0.1)) == [(5, True), (6, False), (7, False)]
    assert ordered.lost == 2


def test_a_missing_packet_is_not_waited_for_behind_many():
    ordered = Ordered()
    assert order(ordered, (0, 0.0), *((number, 0.0) for number in range(2, 34))) == [(0, False)]
    assert order(ordered, (34, 0.0))[0] == (2, True)


def test_an_address_of_another_machine_is_told():
    with pytest.raises(SourceError, match="cannot be listened to"):
        Receiver(Described("192.0.2.1", free_port()), "rtp://192.0.2.1:5600")


def test_the_first_sender_is_listened_to_while_it_sends(monkeypatch):
    port, now_s = free_port(), [0.0]
    monkeypatch.setattr("dockpose.sources.rtp.packets.time.monotonic", lambda: now_s[0])
    receiver = Receiver(Described("127.0.0.1", port), "rtp://here")
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def received(source: int, kind: int = 96):
        head = bytes([0x80, kind, 0, 1, 0, 0, 0, 9]) + source.to_bytes(4, "big")
        sender.sendto(head + b"abc", ("127.0.0.1", port))
        packet, is_new = receiver.receive()
        return packet and packet.source, is_new

    assert received(1) == (1, True)
    assert received(1) == (1, False)
    assert received(2) == (None, False)
    assert received(1, kind=33) == (None, False)
    now_s[0] = 1.5
    assert received(2) == (2, True)
    sender.close()
    receiver.close()
