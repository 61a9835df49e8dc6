"""What RTSP servers send, with packets lost on the way to them."""

import socket
import threading

import pytest
from dockpose.sources.rtp.relay import MARK, Marks, Relay

ABOUT = b"v=0\r\n\r\na=rtpmap:96 H264/90000\r\n"
ANSWER = b"RTSP/1.0 200 OK\r\nCSeq: 2\r\nContent-Length: %d\r\n\r\n%s" % (len(ABOUT), ABOUT)


def packet(number, payload=b"\x41abc", channel=0, kind=96):
    data = bytes([0x80, kind]) + number.to_bytes(2, "big") + bytes(8) + payload
    return b"$" + bytes([channel]) + len(data).to_bytes(2, "big") + data


def test_what_has_no_gap_is_passed_on_as_it_is_however_it_comes():
    sent = ANSWER + b"".join(packet(number % 2**16) for number in range(65530, 65542)) + ANSWER + packet(6)
    for step in (1, 7, len(sent)):
        marks = Marks()
        assert b"".join(marks.pass_on(sent[at : at + step]) for at in range(0, len(sent), step)) == sent


@pytest.mark.parametrize("numbers", [(1, 3), (1, 2, 1), (65535, 1)])
def test_either_side_of_a_gap_is_marked(numbers):
    passed = Marks().pass_on(ANSWER + b"".join(map(packet, numbers)))
    before, between, after = passed.split(MARK)
    assert before.startswith(ANSWER + b"".join(map(packet, numbers[:-1])))
    assert between.startswith(packet(numbers[-1]))
    assert after == b""


@pytest.mark.parametrize("more", [{"channel": 1}, {"kind": 97}])
def test_reports_and_what_is_not_known_are_not_marked(more):
    sent = ANSWER + packet(1, **more) + packet(5, **more)
    assert Marks().pass_on(sent) == sent


def test_what_is_no_rtsp_is_not_kept_for_long():
    with pytest.raises(ConnectionError):
        Marks().pass_on(b"x" * 100_000)


def test_each_side_hears_the_other_until_one_closes():
    with socket.create_server(("127.0.0.1", 0)) as server:
        relay = Relay(f"rtsp://me:secret@127.0.0.1:{server.getsockname()[1]}/film", 10)
        there, _ = server.accept()
        assert relay.address.startswith("rtsp://me:secret@127.0.0.1:")
        assert relay.address.endswith("/film")
        port = int(relay.address.rpartition(":")[2].removesuffix("/film"))
        with there, socket.create_connection(("127.0.0.1", port), 10) as client:
            client.sendall(b"DESCRIBE")
            assert there.recv(100) == b"DESCRIBE"
            there.sendall(ANSWER)
            assert client.recv(100) == ANSWER
            there.shutdown(socket.SHUT_RDWR)
            assert client.recv(100) == b""
    assert not [thread for thread in threading.enumerate() if thread.name == "dockpose RTSP" and thread.join(10)]


def test_where_nothing_listens_that_is_said():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(ConnectionRefusedError):
        Relay(f"rtsp://127.0.0.1:{port}/film", 10)
