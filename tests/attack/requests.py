"""Requests and WebSocket frames that no browser with the token would send."""

import contextlib
import functools
import os
import socket
import time
import zlib

from dockpose.app.web.server.connections import MOST_WAITING

from tests.support.visitors import SUBPROTOCOL, Visitor, asked, cookie_of

FORBIDDEN = "403 Forbidden"


def http(program, source, *lines, path="/", host=None, cookie=False):
    """The status of a request, each character a byte."""
    own = [] if host == "" else [f"Host: {host or f'127.0.0.1:{program.port}'}"]
    own += [f"Cookie: {cookie_of(program.address)}"] if cookie else []
    text = "\r\n".join([f"GET {path} HTTP/1.1", *own, *lines, "", ""])
    return asked(program.port, text.encode("latin-1"), source=source).removeprefix("HTTP/1.1 ")


def upgrade(program, source, *lines, origin=None, **keywords):
    own = f"http://127.0.0.1:{program.port}"
    key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
    asks = ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", key]
    return http(program, source, *asks, f"Origin: {origin or own}", *lines, **keywords)


def page(*lines, **keywords):
    return http, lines, keywords


def websocket(*lines, **keywords):
    return upgrade, lines, keywords


def either(origin):
    """As a page, and as a WebSocket, of that origin."""
    return [page(f"Origin: {origin}", cookie=True), websocket(origin=origin, cookie=True)]


# Each of these requests is refused; {port}, {next_port} and {token} are the running page's.
REFUSED = {
    "No token": [page(), websocket()],
    "A wrong token": [
        page(path="/?token=wrong"),
        page(path="/?token="),
        websocket("Cookie: dockpose_{port}=wrong"),
    ],
    "The token in a header, a path, another cookie, a WebSocket's address": [
        page("X-Token: {token}"),
        page("Authorization: Bearer {token}"),
        page("Cookie: token={token}"),
        page("Cookie: dockpose_1={token}"),
        page(path="/{token}"),
        page(path="/?tokens={token}"),
        websocket(path="/?token={token}"),
    ],
    "A name that was rebound to this machine (Host)": [
        page(host=host, cookie=True)
        for host in ("evil.example", "evil.example:{port}", "127.0.0.1.evil.example:{port}", "192.168.0.9", "")
    ],
    "A malformed Host, or two": [
        page("Host: localhost", cookie=True),
        *(page(host=host, cookie=True) for host in ("[", "[::1", "a]", "127.0.0.1:x]", "\xe9")),
    ],
    "A page of another origin, with the cookie": [
        *either("http://evil.example"),
        *either("http://evil.example:{port}"),
        *either("http://localhost:{port}.evil.example"),
    ],
    "Origin null, with the cookie": either("null"),
    "A page of another port of this machine, with the cookie": either("http://127.0.0.1:{next_port}"),
    "A malformed Origin": [page(f"Origin: {origin}", cookie=True) for origin in ("http://[", "[", "\xff", "")],
    "Two Upgrade headers": [
        page("Upgrade: websocket", f"Upgrade: {second}", cookie=True) for second in ("websocket", "h2c")
    ],
    "Bytes that are no ASCII in token, path, cookie": [
        *(page(path=path) for path in ("/?token=\xe9", "/?token=%ff", "/?token=%C3%A9", "/\xe9?token=x")),
        page(path="http://[/?token=x"),
        page("Cookie: dockpose_{port}=\xe9"),
    ],
    "Paths of 256 to 20,000 characters": [page(path="/" + "a" * size, cookie=True) for size in (256, 4000)],
}


def refused(program, source, name):
    """Make all requests of that name."""
    token = cookie_of(program.address).split("=")[1]
    own = {"port": program.port, "next_port": program.port + 1, "token": token}
    for send, lines, keywords in REFUSED[name]:
        filled = {key: value.format(**own) if isinstance(value, str) else value for key, value in keywords.items()}
        answer = send(program, source, *(line.format(**own) for line in lines), **filled)
        assert answer == FORBIDDEN, (lines, keywords, answer)
    return "403"


def bytes_that_are_no_ascii(program, source):
    """Browsers send the cookies of all ports of a machine along: those of other programs lock nobody out."""
    own = cookie_of(program.address)
    for cookie in ("caf\xe9=1", "x=\xff\xfe", "dockpose_1=\xe9; y", f"dockpose_{program.port}=\xe9"):
        assert http(program, source, f"Cookie: {cookie}; {own}") == "200 OK"
        assert http(program, source, f"Cookie: {cookie}", f"Cookie: {own}") == "200 OK"
    refused(program, source, "Bytes that are no ASCII in token, path, cookie")
    return "403; in another program's cookie 200"


def long_path(program, source):
    assert http(program, source, path="/" + "a" * 20_000, cookie=True) == ""
    return refused(program, source, "Paths of 256 to 20,000 characters")


def traversal(program, source):
    paths = ("/../pyproject.toml", "/%2e%2e/%2e%2e/etc/passwd", "/..%5c..%5cetc%5cpasswd", "//etc/passwd", "/./../x")
    paths += ("/app/guard.py", "/a%00b", "/\xe9")
    answers = {http(program, source, path=path, cookie=True) for path in paths}
    assert answers <= {"404 NOT FOUND", FORBIDDEN}, answers
    assert http(program, source, path=paths[1]) == FORBIDDEN
    return "404, and 403 without the token"


def no_http(program, source):
    for raw in (
        b"\x00" * 3000 + b"\r\n\r\n",
        b"GET\r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n\xff: x\r\n\r\n",
    ):
        assert asked(program.port, raw, source=source) == ""
    many = "".join(f"X-{number}: x\r\n" for number in range(500))
    assert asked(program.port, f"GET / HTTP/1.1\r\n{many}\r\n".encode(), source=source) == ""
    return "closed"


def never_ending_request(program, source):
    """A hundred connections that send a byte a second and no end."""
    open_ones = [socket.create_connection(("127.0.0.1", program.port), 5, (source, 0)) for _ in range(100)]
    end_s = time.monotonic() + 15
    for one in open_ones:
        one.sendall(b"GET / HTTP/1.1\r\nX: ")
        one.setblocking(False)
    while open_ones and time.monotonic() < end_s:
        time.sleep(0.5)
        open_ones = [one for one in open_ones if _is_open(one)]
    assert not open_ones, f"{len(open_ones)} stay open"
    return "closed after 10 s"


def thousands_that_say_nothing(program, source):
    """Three thousand connections without a word, while a page is asked for as usual."""
    slowest_s = 0.0
    with contextlib.ExitStack() as open_ones:
        for number in range(3000):
            one = socket.create_connection(("127.0.0.1", program.port), 5, (source, 0))
            open_ones.enter_context(contextlib.closing(one))
            if number % 500 == 499:
                began_s = time.monotonic()
                assert "200" in http(program, source, cookie=True)
                slowest_s = max(slowest_s, time.monotonic() - began_s)
    assert slowest_s < 2, f"a page came after {slowest_s:.1f} s"
    return f"all but the last {MOST_WAITING} cut off; a page within {max(slowest_s, 0.1):.1f} s"


def _is_open(one):
    try:
        one.sendall(b"a")
        return one.recv(10) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


def frame(payload, first=0x82, length=None, masked=True, short=False):
    size = len(payload) if length is None else length
    mark = 0x80 if masked else 0
    if short:
        return bytes([first, mark | size]) + b"\0\0\0\0" + payload
    head = bytes([first, mark | 127]) + size.to_bytes(8, "big")
    return head + (b"\0\0\0\0" if masked else b"") + payload


def opening(program, *lines):
    """What a page sends to open its WebSocket."""
    text = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{program.port}\r\nOrigin: http://127.0.0.1:{program.port}\r\n"
    text += "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    text += f"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: {SUBPROTOCOL}\r\n"
    text += "".join(f"{line}\r\n" for line in lines)
    return f"{text}Cookie: {cookie_of(program.address)}\r\n\r\n".encode()


def look_of_others(program, source):
    """Requests by which a page of another port would give all browsers other colours."""
    with Visitor(program.address) as other:
        assert other.until(lambda page: page.is_replayed.is_set() and page.is_dark is False)
        for path in ("/prefers-dark", "/software-webgl", "/look"):
            look = f"Cookie: dockpose_{program.port}={program.token}; dockpose_{program.port}_look=idx.dark.software"
            for line in ("X: x", "Sec-Fetch-Site: same-site", "Referer: http://127.0.0.1:1/"):
                assert http(program, source, look, line, path=path)[:3] in ("200", "404")
            assert http(program, source, look, "Origin: http://127.0.0.1:1", path=path) == FORBIDDEN
        assert not other.until(lambda page: page.is_dark, 1)
    return "changes nothing"


def inflating_frames(program, source):
    """Compressed frames of 400 kB that would inflate to 400 MB, on a hundred connections that stay open meanwhile."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    bomb = frame(packer.compress(bytes(400 * 2**20)) + packer.flush(zlib.Z_SYNC_FLUSH), first=0xC2)
    with contextlib.ExitStack() as open_ones:
        ours = []
        for _ in range(100):
            one = open_ones.enter_context(socket.create_connection(("127.0.0.1", program.port), 15, (source, 0)))
            one.sendall(opening(program, "Sec-WebSocket-Extensions: permessage-deflate"))
            answer = one.recv(4096)
            assert answer.startswith(b"HTTP/1.1 101"), answer[:100]
            assert b"deflate" not in answer
            with contextlib.suppress(ConnectionError):
                one.sendall(bomb)
            ours.append(one)
        for one in ours:
            with contextlib.suppress(ConnectionError):
                while one.recv(2**20):
                    pass
    return "not inflated: closed"


def malformed_frames(program, source):
    """Frames that break the protocol, or say that they are larger than they may be."""
    bad = [
        frame(b"x", masked=False),
        frame(b"x", first=0xF2),
        frame(b"x", first=0x8F),
        frame(b"", length=2**40),
        frame(b"", length=2**63 + 5),
        frame(b"\xff\xfe", first=0x81),
        frame(b"x" * 126, first=0x89),
        frame(b"\x00", first=0x88),
        frame(b"x", first=0x80),
        os.urandom(500),
    ]
    for raw in bad:
        with socket.create_connection(("127.0.0.1", program.port), 5, (source, 0)) as one:
            one.sendall(opening(program))
            assert one.recv(12) == b"HTTP/1.1 101"
            one.sendall(raw)
            one.settimeout(5)
            end_s = time.monotonic() + 15
            try:
                while one.recv(2**20):
                    assert time.monotonic() < end_s, "it stays open"
            except ConnectionError:
                pass
    return "closed"


ATTACKS = {
    **{name: functools.partial(refused, name=name) for name in REFUSED},
    "Bytes that are no ASCII in token, path, cookie": bytes_that_are_no_ascii,
    "Paths of 256 to 20,000 characters": long_path,
    "Paths that lead out of the page's folder": traversal,
    "Bytes that are no HTTP; 500 headers": no_http,
    "100 requests that never end": never_ending_request,
    "3,000 connections that say nothing": thousands_that_say_nothing,
    "Malformed WebSocket frames; one of 1 TB": malformed_frames,
    "100 compressed frames of 400 MB": inflating_frames,
    "Colours of all browsers, by a page of another port": look_of_others,
}
