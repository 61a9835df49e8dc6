"""The gate in a running page: whatever one browser sends, the others stay, and the program is calm."""

import asyncio
import logging

import pytest
from dockpose.app.web.server import gate, journal
from dockpose.app.web.server.journal import Journal
from viser import _messages as messages
from viser.infra._async_message_buffer import AsyncMessageBuffer

from tests.support.visitors import Visitor

LABEL = "Min. area (px)"


@pytest.fixture(scope="module")
def visitors(app):
    with Visitor(app.address) as one, Visitor(app.address) as other:
        assert one.until(lambda page: "Upload pictures" in page.buttons and page.is_replayed.is_set())
        assert other.until(lambda page: "Upload pictures" in page.buttons and page.is_replayed.is_set())
        yield one, other


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
    new = 20 + 5 * (one.values[one.ids[LABEL]] == 20)
    one.set(LABEL, new)  # comes after it
    assert other.until(lambda page: page.values[page.ids[LABEL]] == new)
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
    new = 20 + 5 * (one.values[one.ids[LABEL]] == 20)
    one.set(LABEL, new)  # comes after it
    assert other.until(lambda page: page.values[page.ids[LABEL]] == new)
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
    one.set(LABEL, 42)
    assert other.until(lambda page: page.values[page.ids[LABEL]] == 42)


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
