"""Connections by the thousand that ask nothing: others are still answered."""

import contextlib
import socket
import time
import urllib.request
import zlib

import pytest
from dockpose.app.web.server import journal, sockets
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.sockets import MOST_OPEN, MOST_WAITING
from dockpose.app.web.server.start import open_server, silence

from tests.attack.requests import frame
from tests.support.visitors import SUBPROTOCOL, asked, cookie_of

resource = pytest.importorskip("resource")


@pytest.fixture(scope="module")
def page():
    guard = Guard("127.0.0.1")
    server = open_server("127.0.0.1", 0, guard)
    yield server.get_port(), guard.token
    with silence():
        server.stop()


def open_sockets():
    """How many descriptors this process has; the server is in it."""
    import os

    return len(os.listdir("/proc/self/fd"))


@pytest.mark.slow
@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\nHost: "])
def test_hundreds_that_ask_nothing_leave_room_for_others(page, said):
    port, token = page
    before = open_sockets()
    ours = []
    with contextlib.ExitStack() as all_sockets:
        for _ in range(400):
            one = all_sockets.enter_context(socket.create_connection(("127.0.0.1", port), timeout=60))
            with contextlib.suppress(OSError):  # who is cut off is so at once
                one.sendall(said)
            ours.append(one)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/?token={token}", timeout=60) as answer:
            assert answer.status == 200
        assert open_sockets() - before - len(ours) <= MOST_WAITING + 5
        assert MOST_WAITING + MOST_OPEN < 1024 / 2  # of what a process may have open by default
        ours[0].settimeout(60)
        with contextlib.suppress(ConnectionError):
            assert ours[0].recv(1) == b""  # the oldest were cut off
        ours[-1].settimeout(0.05)
        with pytest.raises(TimeoutError):  # the newest may still ask
            ours[-1].recv(1)
    end_s = time.monotonic() + 60
    while open_sockets() > before + 5 and time.monotonic() < end_s:
        time.sleep(0.05)
    assert open_sockets() <= before + 5


def opening_of(page, more=""):
    """What a browser asks for to open the page's WebSocket, with further lines."""
    port, token = page
    host = f"127.0.0.1:{port}"
    return (
        f"GET / HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n{more}"
        f"Cookie: {cookie_of(f'http://{host}/?token={token}')}\r\n\r\n"
    ).encode()


def test_frames_that_inflate_are_refused_told_and_let_go_of_where_nobody_reads(page, monkeypatch, caplog):
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)  # the tests before have had their lines in this second
    before, port = open_sockets(), page[0]
    opening = opening_of(page, "Sec-WebSocket-Extensions: permessage-deflate\r\n")
    with contextlib.ExitStack() as open_ones:
        for _ in range(3):
            one = open_ones.enter_context(socket.create_connection(("127.0.0.1", port), timeout=60))
            one.sendall(opening)
            answer = one.recv(4096)
            assert answer.startswith(b"HTTP/1.1 101")
            assert b"deflate" not in answer
            bomb = zlib.compress(bytes(16 * 2**20), wbits=-15)
            one.sendall(frame(bomb, first=0xC2))
        end_s = time.monotonic() + 60
        while open_sockets() > before + 3:  # ours, whose other ends are gone
            assert time.monotonic() < end_s
            time.sleep(0.05)
    told = [text for text in caplog.messages if "reserved bits" in text]
    assert len(told) == 3
    assert all(text.startswith("127.0.0.1: closed its connection: ") for text in told)


def test_where_too_many_pages_are_open_one_more_is_refused_until_one_is_closed(page, monkeypatch, caplog):
    port, token = page
    monkeypatch.setattr(sockets, "MOST_OPEN", 3)
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)
    opening = opening_of(page)
    with contextlib.ExitStack() as open_ones:
        ours = []
        for _ in range(3):
            one = open_ones.enter_context(socket.create_connection(("127.0.0.1", port), timeout=60))
            one.sendall(opening)
            assert one.recv(12) == b"HTTP/1.1 101"
            ours.append(one)
        assert asked(port, opening) == "HTTP/1.1 503 Service Unavailable"
        assert [one.startswith("127.0.0.1: refused a page: too many are open") for one in caplog.messages] == [True]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/?token={token}", timeout=60) as answer:
            assert answer.status == 200  # what is no page is still answered
        ours[0].close()
        end_s = time.monotonic() + 60
        while asked(port, opening) != "HTTP/1.1 101 Switching Protocols" and time.monotonic() < end_s:
            time.sleep(0.05)
        assert time.monotonic() < end_s
