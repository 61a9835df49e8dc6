import asyncio
import contextlib
import logging
import os
import socket
import urllib.request
import zlib
from types import SimpleNamespace

import msgspec
import pytest
from dockpose.app.web.server import connections, journal
from dockpose.app.web.server.connections import MOST_OPEN, MOST_WAITING
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


@pytest.fixture(autouse=True)
def told_at_once(monkeypatch):
    """Each line of the log is written, also where another one was in the same second."""
    monkeypatch.setattr(journal, "_EVERY_S", 0.0)


def follow(one, other):
    """Set a number in one browser, which comes after all that it sent before, and return it once the other has it."""
    new = 20 + 5 * (one.values[one.ids[LABEL]] == 20)
    one.set(LABEL, new)
    assert other.until(lambda page: page.values[page.ids[LABEL]] == new)
    return new


def test_two_browsers_that_come_at_once_both_get_their_buttons(visitors):
    one, other = visitors
    assert one.until(lambda page: len(page.buttons) == 7)
    assert other.until(lambda page: set(page.buttons) == set(one.buttons))
    assert set(one.buttons.values()) & set(other.buttons.values()) == set()


@pytest.mark.parametrize("label", ["Number of lights", "Level (0-255)", LABEL])
@pytest.mark.parametrize("value", [1e20, "9" * 23, float("inf")])
def test_a_number_that_cannot_be_sent_locks_nobody_out(app, visitors, label, value):
    one, other = visitors
    one.set(label, value)
    new = follow(one, other)
    assert one.is_open
    assert other.values[other.ids[label]] <= 255  # the level follows the area, a moment later
    with Visitor(app.address) as third:
        assert third.is_replayed.wait(60)
        assert third.values[third.ids[LABEL]] == new


def test_a_value_that_is_not_taken_is_replaced_by_the_one_in_force(visitors):
    one, _ = visitors
    number = one.ids["Number of lights"]
    one.values[number] = -7
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


@pytest.mark.parametrize(
    "updates", [{"min": -1e9}, {"content": "<b>"}, {"value": 3, "visible": False}, {}, ["value"], None]
)
def test_nothing_of_a_control_but_its_value_is_set(app, visitors, updates):
    one, other = visitors
    handle = app.server.gui._gui_input_handle_from_uuid[one.ids[LABEL]]
    before = dict(vars(handle._impl.props))
    one.send_raw(msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": one.ids[LABEL], "updates": updates}))
    follow(one, other)
    assert vars(handle._impl.props) == before
    assert handle.visible


def test_a_mark_for_a_form_that_is_none_is_not_kept_for_those_who_come(app, visitors):
    one, other = visitors
    one.send(messages.GuiFormDirtyMessage("x" * 1000))
    follow(one, other)
    kept = app.server._websock_server.get_message_buffer().message_from_id.values()
    assert not [message for message in kept if isinstance(message, messages.GuiFormDirtyMessage)]


@pytest.mark.parametrize("raw", [b"", b"\xc1", "text", b"\x91" * 70_000, b"\x80", b"\x81\xa4type\xa1x"])
def test_what_is_no_message_closes_its_sender_alone_with_a_line(app, visitors, caplog, raw):
    one, other = visitors
    with Visitor(app.address) as sender, caplog.at_level(logging.WARNING):
        assert sender.is_replayed.wait(60)
        sender.send_raw(raw)
        sender.until(lambda page: False)
        assert not sender.is_open
        assert other.until(lambda page: "127.0.0.1: connection handler failed" in caplog.text)
    follow(one, other)
    assert all(record.exc_info is None and "\n" not in record.getMessage() for record in caplog.records)
    assert app._guard.token not in caplog.text


@pytest.mark.parametrize("uuid", [["a"], {"a": 1}, 3, None])
def test_what_fails_in_a_callback_is_one_line_a_second(visitors, caplog, monkeypatch, uuid):
    one, other = visitors
    with caplog.at_level(logging.WARNING):
        one.send_raw(msgspec.msgpack.encode({"type": "CommandTriggerMessage", "uuid": uuid}))
        follow(one, other)
        monkeypatch.setattr(journal, "_EVERY_S", 1e9)
        told = len(caplog.messages)
        for _ in range(20):
            one.send_raw(msgspec.msgpack.encode({"type": "CommandTriggerMessage", "uuid": uuid}))
        follow(one, other)
    assert len(caplog.messages) <= told + 1


def test_what_cannot_be_sent_is_told_to_whoever_queues_it(app, visitors):
    """As a value that the program itself worked out wrongly."""
    one, other = visitors
    handle = app.server.gui._gui_input_handle_from_uuid[one.ids[LABEL]]
    with pytest.raises(ValueError, match="GuiUpdateMessage cannot be sent"):
        app.server.gui._websock_interface.queue_message(messages.GuiUpdateMessage(handle._impl.uuid, {"value": 10**20}))
    follow(one, other)


@pytest.mark.parametrize("raw", [b"\x89\x80\0\0\0\0", b"\0\x80\0\0\0\0"])
def test_who_sends_frames_without_an_end_is_cut_off_and_the_others_are_not(app, visitors, caplog, raw):
    """Pings, to which answers pile up where nobody reads them; fragments of nothing, which make no message."""
    with contextlib.ExitStack() as stack:
        one = opened(app, stack)
        one.sendall(b"\x02\x80\0\0\0\0")
        stack.enter_context(contextlib.suppress(ConnectionError))
        for _ in range(1_000):
            one.sendall(raw * 1000)
        pytest.fail("it is never cut off")
    follow(*visitors)
    until(lambda: [text for text in caplog.messages if "cut off: it sends more than 400 frames a second" in text])


def test_a_journal_counts_what_it_leaves_out(caplog, monkeypatch):
    monkeypatch.setattr(journal, "_EVERY_S", 1.0)
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
def test_a_frame_that_is_none_closes_its_sender_with_a_line(app, visitors, caplog, raw, words):
    def lines():
        return [line for line in caplog.messages if line.startswith("127.0.0.1: cut off: ")]

    with Visitor(app.address) as visitor, caplog.at_level(logging.WARNING):
        assert visitor.is_replayed.wait(60)
        visitor.socket.socket.sendall(raw)
        visitor.until(lambda page: False)
        assert not visitor.is_open
        assert visitors[1].until(lambda page: len(lines()) == 1)  # the server ends a connection after its browser has
    assert words in lines()[0]


@pytest.mark.parametrize("has_own_loop", [False, True])
def test_a_message_may_be_queued_while_browsers_come_and_go(app, has_own_loop):
    """A thread that queues a message does not walk through those who wait, whom the loop takes out meanwhile."""

    async def queue_beside():
        buffer = AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=True)
        buffer.message_event._get_loop()  # pyright: ignore[reportAttributeAccessIssue]  # as whoever waits does

        async def push(message):
            buffer.push(message)

        def push_from_a_thread(message):
            if has_own_loop:
                asyncio.run(push(message))
            else:
                buffer.push(message)

        class Leaving(asyncio.Future):
            """Who waits, and is taken out as soon as somebody walks by."""

            def done(self):
                buffer.message_event._waiters.popleft()
                return True  # who was woken already

        waiting = buffer.message_event._waiters
        waiting.extend((Leaving(), Leaving()))
        await asyncio.to_thread(push_from_a_thread, messages.GuiUpdateMessage("a", {"value": 1}))
        assert buffer.message_event.is_set()
        waiting.clear()
        buffer.message_event.clear()
        waiter = asyncio.create_task(buffer.message_event.wait())
        await asyncio.sleep(0)
        await asyncio.to_thread(push_from_a_thread, messages.GuiUpdateMessage("b", {"value": 1}))
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


def test_frames_that_inflate_are_refused_told_and_let_go_of_where_nobody_reads(page, caplog):
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
        until(lambda: sum("reserved bits" in text for text in caplog.messages) == 3)
        until(lambda: open_sockets() <= before + 3)  # ours, whose other ends are gone
    told = [text for text in caplog.messages if "reserved bits" in text]
    assert all(text.startswith("127.0.0.1: cut off: ") for text in told)


def opened(page, stack, source="127.0.0.1"):
    """A socket on which the page was opened."""
    one = stack.enter_context(socket.create_connection(("127.0.0.1", page.port), 60, (source, 0)))
    one.sendall(opening(page))
    assert one.recv(12) == b"HTTP/1.1 101"
    return one


def is_open(one):
    """Whether the server still answers a ping."""
    with contextlib.suppress(ConnectionError):
        one.sendall(b"\x89\x84\0\0\0\0ping")
        while answer := one.recv(2**16):
            if b"\x8a\x04ping" in answer:
                return True
    return False


def test_one_more_page_takes_the_place_of_that_which_says_least_of_who_has_most(page, monkeypatch, caplog):
    monkeypatch.setattr(connections, "MOST_OPEN", 4)
    with contextlib.ExitStack() as stack:
        alone = opened(page, stack)
        theirs = [opened(page, stack, "127.0.2.1") for _ in range(3)]
        assert is_open(theirs[0])
        newest = opened(page, stack, "127.0.2.2")
        assert not is_open(theirs[1])
        assert all(is_open(one) for one in (alone, theirs[0], theirs[2], newest))
        until(lambda: [text for text in caplog.messages if "127.0.2.1: cut off: of 4 pages it is the one" in text])


def test_who_opens_too_many_at_once_is_refused_and_others_are_not(page, monkeypatch, caplog):
    monkeypatch.setattr(connections, "_LONGEST_WAIT_S", 0.0)
    monkeypatch.setattr(connections, "_OPENED_HZ", 1e-3)
    with contextlib.ExitStack() as stack:
        for _ in range(5):
            opened(page, stack, "127.0.2.3")
        assert asked(page.port, opening(page), source="127.0.2.3") == "HTTP/1.1 503 Service Unavailable"
        opened(page, stack, "127.0.2.4")
        with urllib.request.urlopen(page.address, timeout=60) as answer:
            assert answer.status == 200
        until(lambda: "127.0.2.3: refused a page: it opens too many at once" in caplog.messages)


def test_of_messages_that_do_not_end_the_fullest_are_cut_off(page, monkeypatch, caplog):
    monkeypatch.setattr(connections, "_MOST_BYTES", 5 * 2**20)
    head = b"\x82\xff" + (16 * 2**20).to_bytes(8, "big") + bytes(4)
    with contextlib.ExitStack() as stack:
        small, large = (opened(page, stack, f"127.0.2.{number}") for number in (5, 6))
        small.sendall(head + bytes(2**21))
        with contextlib.suppress(ConnectionError):
            large.sendall(head + bytes(2**22))
        until(lambda: [text for text in caplog.messages if "127.0.2.6: cut off: " in text and "MB are on" in text])
        assert not [text for text in caplog.messages if "127.0.2.5" in text]


def test_who_never_reads_is_cut_off_once_too_much_waits_for_it(served, page, monkeypatch, caplog):
    monkeypatch.setattr(connections, "_MOST_BYTES", 2**16)
    live = served[0]._websock_server._live_connections
    large = served[0].gui.add_html(os.urandom(8 * 2**20).hex())
    with contextlib.ExitStack() as stack:
        opened(page, stack, "127.0.2.7")
        until(lambda: [one for one in list(live.values()) if one.bytes_on_their_way > 2**16])
        large.remove()
        newest = opened(page, stack, "127.0.2.8")
        assert is_open(newest)
        until(lambda: [text for text in caplog.messages if text.startswith("127.0.2.7: cut off: ")])
