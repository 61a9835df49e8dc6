"""What a browser with the token could send, were it not the page's own script."""

import contextlib
import dataclasses
import socket
import time

import msgspec
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed

from tests.support.visitors import Visitor, packed

HTML = "<img src=x onerror=alert(1)>"
NUMBERS = ("Number of lights", "Level (0-255)", "Min. area (px)", "Side (mm)", "fx (px)", "Dock z (cm)")
UPLOAD = "Upload pictures"


def opened(program, source):
    visitor = Visitor(program.address, source=source)
    assert visitor.is_replayed.wait(15), "the page did not open"
    assert visitor.until(lambda page: UPLOAD in page.buttons, 15), "the page has no upload button"
    return visitor


def update(visitor, label, updates):
    return {"type": "GuiUpdateMessage", "uuid": visitor.ids.get(label, label), "updates": updates}


def nothing_changes(program, source, build, wait_s=0.5):
    """All that ``build`` makes of a visitor is sent; no value changes, and nobody is closed but perhaps the sender.

    A sender that was closed, as for what is no message or for too many, comes again.
    """
    with opened(program, source) as witness:
        before, count, closed = dict(witness.values), 0, 0
        visitor = opened(program, source)
        for one in build(visitor):
            raw = one if isinstance(one, bytes | str) else msgspec.msgpack.encode(one)
            try:
                visitor.send_raw(raw)
            except ConnectionClosed:
                closed += 1
                visitor = opened(program, source)
            count += 1
        time.sleep(wait_s)
        visitor.close()
        assert witness.is_open, "another browser was closed"
        watched = {witness.ids[label] for label in (*NUMBERS, "Threshold by", "Burnt-in text", "Squares")}
        changed = [uuid for uuid in watched if witness.values[uuid] != before[uuid]]
        assert not changed, f"{len(changed)} values were changed"
    with opened(program, source):
        pass
    return f"{count} refused" + f", the sender closed {closed} times" * (closed > 0) + "; a new page opens"


def each_kind_of_message(program, source):
    """All of viser's, the fields filled in with something of their kind."""

    def build(page):
        for kind in messages.Message.get_subclasses():
            names = (
                [field.name for field in dataclasses.fields(kind) if field.init]
                if dataclasses.is_dataclass(kind)
                else []
            )
            for fill in ("x", 1, 1e30, None, page.ids["Notes"], [1.0] * 4, {"a": 1}, b"x"):
                yield {"type": kind.__name__} | dict.fromkeys(names, fill)
                yield {"type": kind.__name__, HTML: fill}

    return nothing_changes(program, source, build, wait_s=6)


def malformed_messages(program, source):
    large = {"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": "x" * 70_000}}
    raw = [b"", b"\xc1", b"\xc0", "text", b"\x91" * 60_000, b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff"]
    raw += [b"\x81" * 500, b"\x82\xa4type\x01", b"\xdb\xff\xff\xff\xff", bytes(100), msgspec.msgpack.encode(large)]
    return nothing_changes(program, source, lambda page: raw * 8)


def large_messages(program, source):
    """Names of 10 MB, which stayed in memory; and texts above what may be sent at all, which close their sender."""

    def build(page):
        start = messages.FileTransferStartUpload(page.buttons[UPLOAD], "t", "n" * 10_000_000, "", 1, 10)
        yield packed(start)
        yield packed(messages.FileTransferPart(page.buttons[UPLOAD], "t", 0, bytes(15_000_000)))
        yield update(page, "Burnt-in text", {"value": "x" * 10_000_000})
        yield update(page, "x" * 10_000_000, {"value": 1})
        yield b"\xdc\xff\xff" + b"\xc0" * 65_535

    answer = nothing_changes(program, source, build, wait_s=2)
    visitor = opened(program, source)
    with contextlib.suppress(ConnectionClosed):
        visitor.send_raw(msgspec.msgpack.encode(update(visitor, "Burnt-in text", {"value": "x" * 20_000_000})))
        visitor.until(lambda page: False, 5)
    assert not visitor.is_open, "a text of 20 MB was taken"
    return answer + "; 20 MB closes its sender"


def ten_thousand_a_second(program, source):
    """For five seconds, as fast as they are taken."""
    visitor = opened(program, source)
    raw = msgspec.msgpack.encode(update(visitor, "Min. area (px)", {"value": 1e20}))
    with contextlib.suppress(ConnectionClosed):
        for _ in range(500):
            for _ in range(100):
                visitor.send_raw(raw)
            time.sleep(0.008)
    visitor.until(lambda page: False, 5)
    assert not visitor.is_open, "it is not cut off"
    return "cut off after 1,000 at once"


def html_in_every_name(program, source):
    """Each text box and the name of a file; none comes back as HTML that a browser would run."""
    heard = []
    with opened(program, source) as visitor:
        visitor.hears = heard.append
        boxes = [label for label, uuid in visitor.ids.items() if isinstance(visitor.values.get(uuid), str)]
        for label in boxes:
            visitor.set(label, HTML)
            time.sleep(0.06)
        for label, button in visitor.buttons.items():
            visitor.send(messages.FileTransferStartUpload(button, label, f"{HTML}.png", HTML, 1, 3))
            visitor.send(messages.FileTransferPart(button, label, 0, b"xyz"))
            time.sleep(0.3)
        time.sleep(1)
        for label in boxes:
            visitor.set(label, "")
    run = [message for message in heard if any(HTML in str(text) for text in _html_of(message))]
    assert not run, f"{len(run)} messages bring it back, as {str(run[0])[:200]}"
    assert heard, "nothing was heard"
    return f"{len(boxes)} boxes, {len(visitor.buttons)} files: shown as text"


def _html_of(message):
    """What viser's page would run as HTML or Markdown."""
    if message["type"] in ("GuiHtmlMessage", "GuiMarkdownMessage"):
        return [message["props"]]
    updates = message.get("updates") or {}
    return [text for name, text in updates.items() if name in ("content", "_markdown", "_content", "html")]


def many_visits(program, source):
    """Browsers that come and go at once, without a word."""
    for _ in range(200):
        Visitor(program.address, reads=False, source=source).socket.socket.shutdown(socket.SHUT_RDWR)
    time.sleep(2)
    return "all let go of"


ATTACKS = {
    "Each kind of message that viser knows, with wrong fields": each_kind_of_message,
    "Malformed messages": malformed_messages,
    "Texts of 20 MB, names of 10 MB": large_messages,
    "Ten thousand messages a second": ten_thousand_a_second,
    "HTML in every name": html_in_every_name,
    "200 browsers that come and go": many_visits,
}
