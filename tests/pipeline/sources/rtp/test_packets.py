import socket

import pytest
from dockpose.sources.rtp.packets import Ordered, Packet, Receiver, is_multicast, packet_in

from tests.support.rtp import free_port


def packet(sequence: int, is_last: bool = False) -> Packet:
    return Packet(sequence % 2**16, 0, 7, 96, is_last, b"x")


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


def test_groups_and_hosts_that_are_none():
    assert is_multicast("224.0.0.1")
    assert is_multicast("239.255.255.255")
    assert not any(map(is_multicast, ("223.255.255.255", "240.0.0.1", "localhost", "", "224a.example")))


def order(ordered: Ordered, *numbers: int) -> list[tuple[int, bool]]:
    return [(one.sequence, is_after_gap) for number in numbers for one, is_after_gap in ordered.put(packet(number))]


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
    assert order(Ordered(), *numbers) == found


def test_a_missing_packet_is_waited_for_until_eight_later_ones_have_come():
    ordered = Ordered()
    assert order(ordered, 0, *range(2, 9)) == [(0, False)]
    assert order(ordered, 9) == [(2, True), *((number, False) for number in range(3, 10))]
    assert order(ordered, 1) == []
    assert ordered.lost == 1


def test_two_gaps_are_two():
    ordered = Ordered()
    assert order(ordered, 0, 3, *range(5, 12))[:2] == [(0, False), (3, True)]
    assert order(ordered, 12)[0] == (5, True)
    assert ordered.lost == 3


def test_the_first_sender_is_listened_to_while_it_sends(monkeypatch):
    port, now_s = free_port(), [0.0]
    monkeypatch.setattr("dockpose.sources.rtp.packets.time.monotonic", lambda: now_s[0])
    receiver = Receiver("rtp://here", "127.0.0.1", port)
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
