import pytest
from dockpose.sources import SourceError
from dockpose.sources.rtp.description import Described, described
from dockpose.sources.rtp.pictures import H264, H265

SDP = """v=0
o=- 0 0 IN IP4 127.0.0.1
s=tank
c=IN IP4 239.1.2.3/32
t=0 0
m=audio 5004 RTP/AVP 97
a=rtpmap:97 opus/48000
m=video 5600 RTP/AVP 96
a=rtpmap:96 H264/90000
a=fmtp:96 packetization-mode=1; sprop-parameter-sets=Z0LAFA==,aM48gA==; profile-level-id=42C014
"""


@pytest.mark.parametrize(
    ("address", "found"),
    [
        ("rtp://:5600", Described("", 5600)),
        ("RTP://127.0.0.1:5600", Described("127.0.0.1", 5600)),
        ("rtp://239.1.2.3:5004", Described("239.1.2.3", 5004)),
    ],
)
def test_an_address_names_a_port(address, found):
    assert described(address) == found


@pytest.mark.parametrize("address", ["rtp://", "rtp://tank", "rtp://:99999", "rtp://:x"])
def test_an_address_without_a_port_is_told(address):
    with pytest.raises(SourceError, match="names no UDP port"):
        described(address)


def test_a_description_tells_port_coding_group_and_parameter_sets(tmp_path):
    (tmp_path / "tank.sdp").write_text(SDP)
    found = described(str(tmp_path / "tank.sdp"))
    assert found == Described("239.1.2.3", 5600, H264, (b"\x67\x42\xc0\x14", b"\x68\xce\x3c\x80"))


def test_the_address_of_one_computer_is_none_to_join(tmp_path):
    (tmp_path / "tank.sdp").write_text(
        "v=0\r\nc=IN IP4 127.0.0.1\r\nm=video 5000/2 RTP/AVP 97\r\na=rtpmap:97 h265/90000\r\n"
    )
    assert described(str(tmp_path / "tank.sdp")) == Described("", 5000, H265)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "describes no video over RTP"),
        ("m=audio 5004 RTP/AVP 97", "describes no video over RTP"),
        ("m=video 0 RTP/AVP 96", "describes no video over RTP"),
        ("m=video 5600 RTP/AVP 96\na=rtpmap:96 VP8/90000", "describes VP8; H264 and H265"),
        ("m=video 5600 RTP/AVP 26", "describes payload 26;"),
    ],
)
def test_a_description_of_something_else_is_told(tmp_path, text, why):
    (tmp_path / "tank.sdp").write_text(text)
    with pytest.raises(SourceError, match=why):
        described(str(tmp_path / "tank.sdp"))


def test_a_description_that_is_not_there_is_told(tmp_path):
    with pytest.raises(SourceError, match=r"none\.sdp: cannot be read"):
        described(str(tmp_path / "none.sdp"))
