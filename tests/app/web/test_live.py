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
    page = LivePage(SimpleNamespace(gui=gui, flush=lambda: None))  # type: ignore[arg-type]
    page.begin()
    return page


def sent(gui):
    data = re.fullmatch(r"<dockpose-data[^>]*>(.*)</dockpose-data>", gui.handles[0].content)
    return None if data is None else json.loads(unescape(data[1]))


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
