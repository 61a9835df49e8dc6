import contextlib
import tracemalloc

import msgspec
import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server import uploads
from dockpose.app.web.server.options import Options
from dockpose.app.web.server.uploads import MOST_AT_ONCE, clean_name
from dockpose.sidecar import sample_path
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed

from tests.support.clock import until
from tests.support.visitors import Visitor

BUTTON = "Upload pictures"
LIMIT = 3 * 2**20


@pytest.mark.parametrize(
    ("name", "clean"),
    [
        ("tank.png", "tank.png"),
        ("../../etc/passwd", "passwd"),
        ("C:\\pictures\\a.png", "a.png"),
        ("a\x00b\nc\x1b[31m.png", "abc[31m.png"),
        ("", "the file"),
        ("x" * 500, "x" * 80),
    ],
)
def test_names_of_uploads_are_made_harmless(name, clean):
    assert clean_name(name) == clean


@pytest.fixture(scope="module")
def app():
    with App(port=0, options=Options(upload_limit_bytes=LIMIT)) as running:
        yield running


@pytest.fixture
def page(app):
    with Visitor(app.address) as visitor:
        assert visitor.until(lambda page: BUTTON in page.buttons)
        assert until(lambda: any(visitor.buttons[BUTTON] in one._receivers for one in app._uploads._clients.values()))
        yield visitor


def start(page, name, size, parts, transfer):
    button = page.buttons[BUTTON]
    page.send(messages.FileTransferStartUpload(button, transfer, name, "image/png", parts, size))


def part(page, content, transfer, index=0):
    page.send(messages.FileTransferPart(page.buttons[BUTTON], transfer, index, content))


def held(app):
    return sum(one.held_bytes for one in app._uploads._clients.values())


def told(page, words):
    return page.until(lambda page: any(words in notice["body"] for notice in page.notices))


def test_a_picture_arrives_and_is_forgotten_here(app, page):
    content = sample_path("plain").read_bytes()
    half = len(content) // 2
    start(page, "../mine.png", len(content), 2, "t")
    part(page, content[half:], "t", 1)
    part(page, content[:half], "t", 0)
    until(lambda: app.kept.names() == ["mine.png"])
    assert app.kept.get("mine.png") == content
    until(lambda: held(app) == 0)


def test_an_empty_file_is_said_to_be_no_picture(app, page):
    start(page, "empty.png", 0, 0, "e")
    assert told(page, "empty.png")
    until(lambda: held(app) == 0)


@pytest.mark.parametrize(
    ("size", "parts", "words"),
    [
        (LIMIT + 1, 7, "at most 3 MB"),
        (0, 1, "do not come in 1 parts"),
        (5, 0, "do not come in 0 parts"),
        (100_000, 100_000, "do not come in 100000 parts"),
    ],
)
def test_a_file_that_is_too_large_or_lies_is_not_begun(app, page, size, parts, words):
    start(page, "lie.png", size, parts, "l")
    assert told(page, words)
    assert held(app) == 0


def test_more_or_less_than_was_said_is_given_up(app, page, monkeypatch):
    monkeypatch.setattr(uploads, "_BETWEEN_NOTICES_S", 0.0)
    start(page, "more.png", 10, 1, "m")
    part(page, b"x" * 11, "m")
    assert told(page, "more came than")
    start(page, "less.png", 10, 1, "s")
    part(page, b"x" * 9, "s")
    assert told(page, "less came than")
    assert held(app) == 0


def test_twenty_thousand_files_of_no_bytes_that_never_come(app, page):
    """They were kept for ever and summed on the event loop: half a minute later a new page had no controls."""
    with contextlib.suppress(ConnectionClosed):  # for so many messages at once
        for number in range(2_000):
            start(page, "n" * 900, 0, 1, f"{number}")
    with Visitor(app.address) as other:
        assert other.is_replayed.wait(60)
        assert other.until(lambda page: BUTTON in page.buttons)
    assert held(app) == 0
    assert all(len(one.underway) == 0 for one in app._uploads._clients.values())


def test_a_browser_has_few_files_under_way(app, page):
    for number in range(MOST_AT_ONCE + 5):
        start(page, "slow.png", 10, 1, f"slow{number}")
    assert told(page, f"{MOST_AT_ONCE} files")
    assert held(app) == 10 * MOST_AT_ONCE


def test_the_memory_of_a_browser_that_leaves_is_free_again(app):
    tracemalloc.start()
    with Visitor(app.address) as visitor:
        assert visitor.until(lambda page: BUTTON in page.buttons)
        before = tracemalloc.get_traced_memory()[0]
        start(visitor, "large.png", 2 * 2**20 + 2**19, 5, "g")
        for index in range(4):
            part(visitor, bytes(2**19), "g", index)
        until(lambda: tracemalloc.get_traced_memory()[0] - before > 2 * 2**20)
        visitor.send_raw(b"\xc1")
    until(lambda: held(app) == 0)
    until(lambda: tracemalloc.get_traced_memory()[0] - before < 2**20)
    tracemalloc.stop()


def test_a_file_of_which_nothing_more_comes_is_given_up(app, page, monkeypatch):
    monkeypatch.setattr(uploads, "PATIENCE_S", 0.5)
    start(page, "stuck.png", 2**20, 2, "u")
    part(page, bytes(2**19), "u")
    until(lambda: held(app) == 2**20)
    assert told(page, "nothing more of it came")
    assert held(app) == 0


def send_raw(page, kind, **fields):
    """A message as viser's own classes would not let it be."""
    button = page.buttons[BUTTON]
    page.send_raw(msgspec.msgpack.encode({"type": kind, "source_component_uuid": button, **fields}))


@pytest.mark.parametrize(
    "odd",
    [
        {"size_bytes": -10, "part_count": -5},
        *({"filename": name} for name in ("n" * 1001, 7, None)),
        {"mime_type": "n" * 1001},
    ],
)
def test_a_file_whose_name_or_counts_are_none_is_not_begun(app, page, odd):
    """Less than nothing would make room for others."""
    fields = {"transfer_uuid": "odd", "filename": "a.png", "mime_type": "", "part_count": 1, "size_bytes": 9}
    send_raw(page, "FileTransferStartUpload", **(fields | odd))
    start(page, "right.png", 10, 1, "right")
    until(lambda: held(app) == 10)


@pytest.mark.parametrize(("index", "content"), [(-1, b"x"), (0, ["x" * 1000]), (0, "x")])
def test_a_part_that_is_no_bytes_or_has_no_number_is_left_out(app, page, index, content):
    start(page, "right.png", 10, 1, "right")
    send_raw(page, "FileTransferPart", transfer_uuid="right", part_index=index, content=content)
    start(page, "other.png", 5, 1, "other")
    until(lambda: held(app) == 15)
    assert [one.underway["right"]["transferred_bytes"] for one in app._uploads._clients.values() if one.underway] == [0]
