"""What is sent with every frame: nothing before there is a result, and never half of one."""

import json
import re
import threading
from html import unescape
from types import SimpleNamespace

import pytest
from dockpose.app.web.live import LivePage


class Gui:
    """Keeps what is put on the page."""

    def __init__(self):
        self.handles = []

    def add_html(self, content, order=None):
        self.handles.append(SimpleNamespace(content=content))
        return self.handles[-1]


@pytest.fixture
def gui():
    return Gui()


@pytest.fixture
def live(gui):
    return LivePage(gui, lambda: None, lambda: False)  # type: ignore[arg-type]


def sent(gui):
    data = re.fullmatch(r"<dockpose-data[^>]*>(.*)</dockpose-data>", gui.handles[0].content)
    return None if data is None else json.loads(unescape(data[1]))


def html(gui):
    data = sent(gui)
    return None if data is None else data["html"]


def test_nothing_is_sent_before_there_is_a_picture(gui, live):
    live.put(timeline={"name": None})
    live.send()
    assert sent(gui) is None
    live.put(picture=1)
    live.send()
    assert sent(gui) == {"serial": 1, "timeline": {"name": None}, "picture": 1, "html": {}}


def test_nobody_sends_half_of_a_result(gui, live):
    live.put(picture=1, overlay=1)
    live.put_html("strip", "one")

    with live.held:
        live.put(picture=2, overlay=2)
        other = threading.Thread(target=live.send)
        other.start()
        other.join(0.2)
        assert sent(gui) is None
        live.put_html("strip", "two")
    other.join(60)
    assert sent(gui) == {"serial": 1, "picture": 2, "overlay": 2, "html": {"strip": "two"}}


def test_what_is_folded_away_is_made_once_a_browser_has_it_in_view(gui, live):
    one, other = SimpleNamespace(client_id=1), SimpleNamespace(client_id=2)
    live.put(picture=1)
    for words in ("first", "second"):
        live.put_folded("pose", lambda words=words: words)
        live.send()
        assert html(gui) == {}
    live.look({"strip", "pose"}, one)
    assert html(gui) == {"pose": "second"}
    live.look({"strip"}, other)  # another browser that does not look changes nothing
    live.put_folded("pose", lambda: "third")
    live.send()
    assert html(gui) == {"pose": "third"}
    live.look({"pose"}, other)
    live.forget(one)
    live.send()
    assert html(gui) == {"pose": "third"}
    live.look(set(), other)
    live.send()
    assert html(gui) == {}


def test_all_is_made_for_a_viewer_who_cannot_say_what_is_in_view(gui):
    viewers = []
    live = LivePage(gui, lambda: None, lambda: bool(viewers))  # type: ignore[arg-type]
    live.put(picture=1)
    live.put_folded("pose", lambda: "now")
    live.send()
    assert html(gui) == {}
    viewers.append("somebody")
    live.add_upload(SimpleNamespace(client_id=1), None)  # type: ignore[arg-type]
    assert html(gui) == {"pose": "now"}
