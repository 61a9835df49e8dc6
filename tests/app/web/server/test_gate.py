import asyncio
import contextlib
import logging
import os
import socket
import urllib.request
import zlib
from types import SimpleNamespace

import pytest
from dockpose.app.web.server import gate, journal
from dockpose.app.web.server.gate import MOST_OPEN, MOST_WAITING
from dockpose.app.web.server.journal import Journal
from viser import _messages as messages
from viser.infra._async_message_buffer import AsyncMessageBuffer

from tests.attack.requests import frame, opening
from tests.support.clock import until
from tests.support.visitors import Visitor, asked

LABEL = "Min. area (px)"


@pytest.fixture(scope="module")
def visitors(app):
    with Visitor(app.address) as one, Visitor(app.address) as other:
        for visitor in (one, other):
            assert visitor.until(lambda page: "Upload pictures" in page.buttons and page.is_replayed.is_set())
        yield one, other


def follow(one, other):
    """Set a number in one browser, which comes after all that it sent before, and return it once the other has it."""
    new = 20 + 5 * (one.values[one.ids[LABEL]] == 20)
    one.set(LABEL, new)
    assert other.until(lambda page: page.values[page.ids[LABEL]] == new)
    return new


def test_two_browsers_that_come_at_once_both_get_their_buttons(visitors):
    one, other = visitors
    assert one.until(lambda page: len(page.buttons) == 6)
    assert other.until(lambda page: set(page.buttons) == set(one.buttons))
    assert set(one.buttons.values()) & set(other.buttons.values()) == set()


@pytest.mark.parametrize("label", ["Number of lights", "Level (0-255)", LABEL, "Page"])
@pytest.mark.parametrize("value", [1e20, "9" * 23, float("inf")])
def test_a_number_that_cannot_be_sent_locks_nobody_out(app, visitors, label, value):
    one, other = visitors
    before = other.values[other.ids[label]]
    one.set(label, value)
    new = follow(one, other)
    assert one.is_open
    assert other.values[other.ids[label]] == before or label == LABEL
    with Visitor(app.address) as third:
        assert third.is_replayed.wait(60)
        assert third.values[third.ids[LABEL]] == new


def test_a_value_that_is_not_taken_is_replaced_by_the_one_in_force(visitors, monkeypatch):
    one, other = visitors
    number = one.ids["Number of lights"]
    one.values[number] = -7
    monkeypatch.setattr(gate, "_SEND_BACK_S", 1e6)  # somebody may still be typing
    one.set("Number of lights", -7)
    follow(one, other)
    assert one.values[number] == -7
    monkeypatch.setattr(gate, "_SEND_BACK_S", 0.0)
    one.set("Number of lights", -7)
    assert one.until(lambda page: page.values[number] == 10)
    assert one.until(lambda page: "Number of lights: -7 is outside 0 to 60." in [one["body"] for one in page.notices])


def test_a_control_that_one_browser_alone_is_shown_takes_its_values(app, visitors):
    one, other = visitors
    client = app.server.get_clients()[min(app.server.get_clients())]
    box = client.gui.add_checkbox("Only here", False)
    mine = one if one.until(lambda page: "Only here" in page.ids, 1) else other
    mine.set("Only here", True)
    assert mine.until(lambda page: box.value is True)


def test_malformed_messages_close_nothing_and_make_few_lines(app, visitors, caplog, monkeypatch):
    def lines():
        return [record for record in caplog.records if "refused" in record.getMessage()]

    one, other = visitors
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)
    with caplog.at_level(logging.WARNING):
        one.send_raw(b"")
        assert one.until(lambda _: lines())
        monkeypatch.setattr(journal, "_EVERY_S", 1e9)
        for raw in [b"", b"\xc1", "text", b"\x91" * 70_000, b"\x80"] * 17:
            one.send_raw(raw)
        one.set(LABEL, 41)
        assert other.until(lambda page: page.values[page.ids[LABEL]] == 41)
    assert len(lines()) == 1
    assert all(record.exc_info is None and "\n" not in record.getMessage() for record in caplog.records)
    assert app._guard.token not in caplog.text


def test_what_cannot_be_sent_is_told_to_whoever_queues_it(app, visitors):
    """As a value that the program itself worked out wrongly."""
    one, other = visitors
    handle = app.server.gui._gui_input_handle_from_uuid[one.ids[LABEL]]
    with pytest.raises(ValueError, match="GuiUpdateMessage cannot be sent"):
        app.server.gui._websock_interface.queue_message(messages.GuiUpdateMessage(handle._impl.uuid, {"value": 10**20}))
    follow(one, other)


@pytest.mark.slow
def test_who_sends_too_fast_waits_and_the_others_do_not(app, visitors, monkeypatch):
    one, other = visitors
    for number in range(1000):  # more than may come at once
        one.set(LABEL, number % 50 + 1)
    one.set(LABEL, 99)
    assert other.until(lambda page: page.values[page.ids[LABEL]] == 99)
    with monkeypatch.context() as patched:
        patched.setattr(gate, "_RATE_HZ", 1.0)
        hasty = Visitor(app.address)
    with hasty:
        assert hasty.until(lambda page: page.is_replayed.is_set() and LABEL in page.ids)
        for number in range(1000):  # the last is let through after minutes
            hasty.set(LABEL, number % 50 + 1)
        hasty.set(LABEL, 98)
        other.set("Number of lights", 12)
        assert hasty.until(lambda page: page.values[page.ids["Number of lights"]] == 12)
        assert other.values[other.ids[LABEL]] != 98
    other.set("Number of lights", 10)
    assert one.until(lambda page: page.values[page.ids["Number of lights"]] == 10)


def test_a_journal_counts_what_it_leaves_out(caplog):
    told = Journal()
    with caplog.at_level(logging.INFO):
        for number in range(5):
            told.note("10.0.0.1", f"refused {number}\nand \x1b[31m more")
        told.note("10.0.0.2", "refused")
        told._told = {client: (at_s - 2, count) for client, (at_s, count) in told._told.items()}
        told.note("10.0.0.1", "refused again")
    assert [text for text in caplog.messages if text.startswith("10.0.0.")] == [
        r"10.0.0.1: refused 0\nand \x1b[31m more",
        "10.0.0.2: refused",
        "10.0.0.1: refused again (and 4 more before)",
    ]


@pytest.mark.parametrize(
    ("raw", "words"), [(b"\xf2\x80\0\0\0\0", "reserved"), (b"\x82\xff\0\0\1\0\0\0\0\0", "exceeds limit")]
)
def test_a_frame_that_is_none_closes_its_sender_with_a_line(app, visitors, caplog, monkeypatch, raw, words):
    def lines():
        return [line for line in caplog.messages if line.startswith("127.0.0.1: closed its connection: ")]

    monkeypatch.setattr(journal, "_EVERY_S", 0.0)
    with Visitor(app.address) as visitor, caplog.at_level(logging.WARNING):
        assert visitor.is_replayed.wait(60)
        visitor.socket.socket.sendall(raw)
        assert not visitor.until(lambda page: False)
        assert not visitor.is_open
        assert visitors[1].until(lambda page: len(lines()) == 1)  # the server ends a connection after its browser has
    assert words in lines()[0]


def test_a_message_may_be_queued_while_browsers_come_and_go(app):
    """A thread that queues a message does not walk through those who wait, whom the loop takes out meanwhile."""

    async def queue_beside():
        buffer = AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=True)

        class Leaving(asyncio.Future):
            """Who waits, and is taken out as soon as somebody walks by."""

            def done(self):
                buffer.message_event._waiters.popleft()
                return True  # who was woken already

        waiting = buffer.message_event._waiters
        waiting.extend((Leaving(), Leaving()))
        await asyncio.to_thread(buffer.push, messages.GuiUpdateMessage("a", {"value": 1}))
        assert buffer.message_event.is_set()
        waiting.clear()
        buffer.message_event.clear()
        waiter = asyncio.create_task(buffer.message_event.wait())
        await asyncio.sleep(0)
        await asyncio.to_thread(buffer.push, messages.GuiUpdateMessage("b", {"value": 1}))
        assert await asyncio.wait_for(waiter, 5)

    asyncio.run(queue_beside())


resource = pytest.importorskip("resource")


@pytest.fixture(scope="module")
def page(served):
    server, guard = served
    port = server.get_port()
    return SimpleNamespace(port=port, address=f"http://127.0.0.1:{port}/?token={guard.token}")


def open_sockets():
    """How many descriptors this process has; the server is in it."""
    return len(os.listdir("/proc/self/fd"))


@pytest.mark.slow
@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\nHost: "])
def test_hundreds_that_ask_nothing_leave_room_for_others(page, said):
    before = open_sockets()
    ours = []
    with contextlib.ExitStack() as all_sockets:
        for _ in range(400):
            one = all_sockets.enter_context(socket.create_connection(("127.0.0.1", page.port), timeout=60))
            with contextlib.suppress(OSError):  # who is cut off is so at once
                one.sendall(said)
            ours.append(one)
        with urllib.request.urlopen(page.address, timeout=60) as answer:
            assert answer.status == 200
        assert open_sockets() - before - len(ours) <= MOST_WAITING + 5
        assert MOST_WAITING + MOST_OPEN < 1024 / 2  # of what a process may have open by default
        ours[0].settimeout(60)
        with contextlib.suppress(ConnectionError):
            assert ours[0].recv(1) == b""  # the oldest were cut off
        ours[-1].settimeout(0.05)
        with pytest.raises(TimeoutError):  # the newest may still ask
            ours[-1].recv(1)
    until(lambda: open_sockets() <= before + 5)


def test_frames_that_inflate_are_refused_told_and_let_go_of_where_nobody_reads(page, monkeypatch, caplog):
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)  # the tests before have had their lines in this second
    before = open_sockets()
    asks = opening(page, "Sec-WebSocket-Extensions: permessage-deflate")
    with contextlib.ExitStack() as open_ones:
        for _ in range(3):
            one = open_ones.enter_context(socket.create_connection(("127.0.0.1", page.port), timeout=60))
            one.sendall(asks)
            answer = one.recv(4096)
            assert answer.startswith(b"HTTP/1.1 101")
            assert b"deflate" not in answer
            bomb = zlib.compress(bytes(16 * 2**20), wbits=-15)
            one.sendall(frame(bomb, first=0xC2))
        until(lambda: open_sockets() <= before + 3)  # ours, whose other ends are gone
    told = [text for text in caplog.messages if "reserved bits" in text]
    assert len(told) == 3
    assert all(text.startswith("127.0.0.1: closed its connection: ") for text in told)


def test_where_too_many_pages_are_open_one_more_is_refused_until_one_is_closed(page, monkeypatch, caplog):
    monkeypatch.setattr(gate, "MOST_OPEN", 3)
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)
    asks = opening(page)
    with contextlib.ExitStack() as open_ones:
        ours = []
        for _ in range(3):
            one = open_ones.enter_context(socket.create_connection(("127.0.0.1", page.port), timeout=60))
            one.sendall(asks)
            assert one.recv(12) == b"HTTP/1.1 101"
            ours.append(one)
        assert asked(page.port, asks) == "HTTP/1.1 503 Service Unavailable"
        assert [one.startswith("127.0.0.1: refused a page: too many are open") for one in caplog.messages] == [True]
        with urllib.request.urlopen(page.address, timeout=60) as answer:
            assert answer.status == 200  # what is no page is still answered
        ours[0].close()
        until(lambda: asked(page.port, asks) == "HTTP/1.1 101 Switching Protocols")
