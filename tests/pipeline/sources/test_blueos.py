"""A camera manager that answers as BlueOS's does: which of its streams is taken, and what is said where none is."""

import json
import socket
from urllib.parse import urlsplit

import pytest
from dockpose.sources import SourceError
from dockpose.sources.blueos import stream_of

from tests.support.answering import answering


@pytest.fixture
def manager():
    """A camera manager, and what it says at /streams; bytes are said as they are, a number is a status."""
    says: list = [[]]

    def answer(path):
        said = says[0]
        body = said if isinstance(said, bytes) else json.dumps(said).encode()
        return said if isinstance(said, int) else 200 if path == "/streams" else 404, {}, body

    with answering(answer) as address:
        yield urlsplit(address).port, says


def stream(name, *endpoints, running=True):
    about = {"endpoints": endpoints, "configuration": {"type": "video", "encode": "H264"}}
    return {"id": "0", "running": running, "video_and_stream": {"name": name, "stream_information": about}}


FRONT, PORT = stream("Front", "udp://192.0.2.1:5600"), "udp://127.0.0.1:5601"


@pytest.mark.parametrize(
    ("streams", "name", "wanted"),
    [
        ([stream("Front", PORT)], "", "rtp://:5601"),
        ([stream("Front", "udp://0.0.0.0:5602")], "", "rtp://:5602"),
        ([stream("Front", "rtsp://0.0.0.0:8554/front cam")], "", "rtsp://127.0.0.1:8554/front cam"),
        ([stream("Front", "rtsp://192.0.2.7/live?a=1")], "", "rtsp://192.0.2.7/live?a=1"),
        ([FRONT, stream("Down", PORT)], "", "rtp://:5601"),
        ([stream("Front", "udp://192.0.2.1:5600", PORT)], "", "rtp://:5601"),
        ([stream("Front", PORT), stream("Down", "udp://127.0.0.1:5609")], "/Down", "rtp://:5609"),
        ([stream("Front", PORT), stream("Down cam", "udp://127.0.0.1:5609")], "/Down%20cam", "rtp://:5609"),
        ([stream("Front", PORT, running=False), stream("Down", "udp://127.0.0.1:5609")], "", "rtp://:5609"),
    ],
)
def test_the_first_stream_that_comes_here_is_taken(manager, streams, name, wanted):
    port, says = manager
    says[0] = streams
    assert stream_of(f"blueos://127.0.0.1:{port}{name}", 5.0) == wanted


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ([], "no stream is running"),
        ([FRONT], "udp://192.0.2.1:5600 does not come here"),
        ([stream("Front", "webrtc://127.0.0.1:6021")], "webrtc://127.0.0.1:6021 does not come here"),
        ([stream("Front", "udp://127.0.0.1:99999")], "does not come here"),
        ([stream("Front", "udp://127.0.0.1")], "does not come here"),
        ([stream("Front", "rtsp://pilot:secret@[bad/1")], "does not come here"),
        ({"streams": 1}, "not with a camera manager's streams"),
        ([{"name": "Front"}], "not with a camera manager's streams"),
        (b"<html>", "not with a camera manager's streams"),
        (b"[" * 5000, "not with a camera manager's streams"),
        (404, "says 404"),
    ],
)
def test_what_cannot_be_had_is_said(manager, answer, words):
    port, says = manager
    says[0] = answer
    with pytest.raises(SourceError, match=words) as raised:
        stream_of(f"blueos://127.0.0.1:{port}", 5.0)
    assert "secret" not in str(raised.value)


def test_another_name_is_told_which_there_are(manager):
    port, says = manager
    says[0] = [stream("Front", PORT)]
    with pytest.raises(SourceError, match="there is 'Front'"):
        stream_of(f"blueos://127.0.0.1:{port}/Down", 5.0)


def test_no_manager_and_no_address_are_said():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(SourceError, match=f"the camera manager at port {port} does not answer"):
        stream_of(f"blueos://127.0.0.1:{port}", 5.0)
    with pytest.raises(SourceError, match="write it as blueos://"):
        stream_of("blueos://127.0.0.1:port", 5.0)
