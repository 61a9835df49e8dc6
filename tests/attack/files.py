"""Files that are too large, never end, or are not what was said."""

import contextlib
import time

from viser import _messages as messages
from websockets.exceptions import ConnectionClosed

from tests.attack.messages import UPLOAD, opened

LIMIT_MB = 20


def begin(page, transfer, size, parts, name="a.png"):
    page.send(messages.FileTransferStartUpload(page.buttons[UPLOAD], transfer, name, "image/png", parts, size))


def part(page, transfer, index, content):
    page.send(messages.FileTransferPart(page.buttons[UPLOAD], transfer, index, content))


def told(page, words):
    assert page.until(lambda page: any(words in one["body"] for one in page.notices), 10), [
        one["body"] for one in page.notices
    ]


def oversized(program, source):
    with opened(program, source) as page:
        begin(page, "large", 10**12, 2_000_000)
        told(page, "at most")
        for index in range(60):
            part(page, "large", index, bytes(2**19))
    return "refused with a sentence; its parts are dropped"


def never_ending(program, source):
    """A file that says 10 bytes and goes on, and one of which nothing more comes."""
    with opened(program, source) as page:
        begin(page, "more", 10, 1)
        for index in range(60):
            part(page, "more", index, bytes(2**19))
        told(page, "more came")
        begin(page, "stuck", 15 * 2**20, 30)
        part(page, "stuck", 0, bytes(2**19))
        time.sleep(0.5)
        with opened(program, source) as other:  # who must wait for room
            begin(other, "waits", 15 * 2**20, 30)
            told(other, "at most")
    return "given up at the 11th byte; one that stands still after 60 s, or with its browser"


def of_no_bytes(program, source):
    """20,000 begun, each with a part that never comes."""
    with opened(program, source) as page:
        with contextlib.suppress(ConnectionClosed):
            for number in range(20_000):
                begin(page, f"{number}", 0, 1)
        began_s = time.monotonic()
        with opened(program, "127.0.0.1"):
            took_s = time.monotonic() - began_s
        assert took_s < 5, f"a new page took {took_s:.1f} s"
    return f"cut off after 1,000; meanwhile a new page opened in {took_s:.1f} s"


def many_at_once(program, source):
    with opened(program, source) as page:
        for number in range(500):
            begin(page, f"{number}", 30_000, 1)
            part(page, f"{number}-", 0, b"x")
        told(page, "are still under way")
    return "16 of one browser, no more"


ATTACKS = {
    "A file of 1 TB": oversized,
    "Files that never end": never_ending,
    "20,000 files of no bytes": of_no_bytes,
    "500 files at once": many_at_once,
}
