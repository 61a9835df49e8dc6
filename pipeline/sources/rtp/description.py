"""What an address or a description (SDP, RFC 4566) says of an RTP stream."""

import base64
import contextlib
import re
from typing import NamedTuple
from urllib.parse import urlsplit

from dockpose.files import FileError, read_small
from dockpose.sources.frames import SourceError
from dockpose.sources.rtp.packets import is_multicast
from dockpose.sources.rtp.pictures import CODINGS, Coding

_LARGEST_BYTES = 2**16  # of a description


class Described(NamedTuple):
    """Where a stream arrives, and what it carries."""

    host: str
    port: int
    coding: Coding | None = None  # None where the packets tell
    sets: tuple[bytes, ...] = ()  # parameter sets


def described(address: str) -> Described:
    """Read an address, as rtp://:5600, or the file of a description; SourceError for neither."""
    if not address.lower().startswith("rtp://"):
        return _in_file(address)
    try:
        parts = urlsplit(address)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port = "", None
    if not port:
        raise SourceError(f"{address}: names no UDP port; write it as rtp://:5600")
    return Described(host, port)


def _in_file(path: str) -> Described:
    try:
        text = read_small(path, _LARGEST_BYTES, is_cut=True).decode("utf-8", "replace")
    except FileError as error:
        raise SourceError(str(error)) from error
    video = re.search(r"^m=video[ \t]+(\d{1,5})\S*[ \t]+RTP/AVPF?[ \t]+(\d{1,3})\b(.*?)(?=^m=|\Z)", text, re.M | re.S)
    if video is None or not 0 < int(video[1]) < 2**16:
        raise SourceError(f"{path}: describes no video over RTP; a line m=video PORT RTP/AVP TYPE is missing")
    kind, about = int(video[2]), video[3]
    named = re.search(rf"^a=rtpmap:{kind}[ \t]+([^/\s]+)", about, re.M)
    coding = CODINGS.get(named[1].upper()) if named else None
    if coding is None:
        text = f"{path}: describes {named[1] if named else f'payload {kind}'}; H264 and H265 over RTP are read"
        raise SourceError(text)
    options = re.search(rf"^a=fmtp:{kind}[ \t]+(.*)$", about, re.M)
    written = re.findall(r"sprop-(?:parameter-sets|vps|sps|pps)=([^;\s]+)", options[1] if options else "")
    sets: tuple[bytes, ...] = ()
    with contextlib.suppress(ValueError):  # of what is not base 64
        sets = tuple(base64.b64decode(part, validate=True) for part in ",".join(written).split(",") if part)
    where = re.search(r"^c=IN IP4 ([\d.]+)", about + text[: video.start()], re.M)
    return Described(where[1] if where and is_multicast(where[1]) else "", int(video[1]), coding, sets)
