"""Who has the token and takes all that a connection can: places, frames, memory."""

import contextlib
import socket
import time

from dockpose.app.web.server.connections import MOST_OPEN

from tests.attack.program import PAGE
from tests.attack.requests import frame, opening
from tests.support.visitors import Visitor

MOST_MEMORY_BYTES = 250 * PAGE  # more than before, while it is attacked


def page(program, source, stack):
    """A socket on which the page was opened, closed with ``stack``; None where it was refused."""
    one = stack.enter_context(socket.create_connection(("127.0.0.1", program.port), 15, (source, 0)))
    with contextlib.suppress(ConnectionError):
        one.sendall(opening(program))
        if one.recv(12) == b"HTTP/1.1 101":
            return one
    return None


def cut_off(program, source, raw):
    """Sent without an end, and nothing read: it is cut off, and memory does not grow meanwhile."""
    before, sent = program.memory_bytes, 0
    with contextlib.ExitStack() as stack:
        one = page(program, source, stack)
        assert one is not None
        with contextlib.suppress(ConnectionError):
            while sent < 500 * 2**20:
                one.sendall(raw)
                sent += len(raw)
        grown = program.memory_bytes - before
    assert sent < 500 * 2**20, "it was never cut off"
    assert grown < MOST_MEMORY_BYTES, f"{grown / 2**20:.0f} MB were taken"
    return f"cut off after {sent / 2**20:.1f} MB"


def pings(program, source):
    return cut_off(program, source, frame(b"x" * 125, first=0x89, short=True) * 1000)


def empty_fragments(program, source):
    first = frame(b"", first=0x02, short=True)
    return cut_off(program, source, first + frame(b"", first=0x00, short=True) * 5000)


def large_messages_without_an_end(program, source):
    """Of each connection all but the last bytes of the largest message that is taken."""
    before, most = program.memory_bytes, 0
    head, part = frame(b"", length=16 * 2**20)[:14], bytes(2**20)
    with contextlib.ExitStack() as stack:
        for _ in range(20):
            one = page(program, source, stack)
            assert one is not None
            with contextlib.suppress(ConnectionError):
                one.sendall(head)
                for _ in range(15):
                    one.sendall(part)
            most = max(most, program.memory_bytes - before)
    assert most < MOST_MEMORY_BYTES, f"{most / 2**20:.0f} MB were taken"
    return "the fullest are cut off"


def pages_that_never_read(program, source):
    before, most, count = program.memory_bytes, 0, 0
    with contextlib.ExitStack() as stack:
        for _ in range(200):
            count += page(program, source, stack) is not None
            most = max(most, program.memory_bytes - before)
        time.sleep(3)
        most = max(most, program.memory_bytes - before)
    assert count > MOST_OPEN, f"only {count} were opened"
    assert most < MOST_MEMORY_BYTES, f"{most / 2**20:.0f} MB were taken"
    return f"{MOST_OPEN} stay; at the most {most / 2**20:+.0f} MB"


def many_pages_in_a_row(program, source):
    """As fast as they are taken, without waiting for an answer; then a page of the same machine opens."""
    with contextlib.ExitStack() as stack:
        for _ in range(1250):
            with contextlib.suppress(ConnectionError):
                one = socket.create_connection(("127.0.0.1", program.port), 15, (source, 0))
                stack.enter_context(one)
                one.sendall(opening(program))
            time.sleep(0.008)
        with Visitor(program.address) as other:
            assert other.is_replayed.wait(5), "another machine's page does not open"
        took_s = opened_after_s(program, source)
    return f"refused but for five a second; a page of that machine opens after {took_s:.1f} s"


def pages_that_stay(program, source):
    """Pages that read and answer, of one machine, as many as it takes."""
    with contextlib.ExitStack() as stack:
        for _ in range(MOST_OPEN + 10):
            stack.enter_context(contextlib.closing(Visitor(program.address, source=source)))
        took_s = opened_after_s(program, source)
    return f"{MOST_OPEN}, and then one for another; a page of that machine opens after {took_s:.1f} s"


def opened_after_s(program, source):
    began_s = time.monotonic()
    while time.monotonic() < began_s + 15:
        with contextlib.suppress(Exception), Visitor(program.address, source=source) as visitor:
            if visitor.is_replayed.wait(5):
                return time.monotonic() - began_s
        time.sleep(0.1)
    raise AssertionError("a new page does not open")


ATTACKS = {
    "Pings without an end": pings,
    "Empty fragments without an end": empty_fragments,
    "20 messages of 16 MB that never end": large_messages_without_an_end,
    "200 pages that never read": pages_that_never_read,
    "1,250 pages in a row": many_pages_in_a_row,
    "More pages than there is room for": pages_that_stay,
}
