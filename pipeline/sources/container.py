"""Files and streams as FFmpeg opens them, what their packets tell of the frames, and MP4 files that break off."""

import itertools
import os
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from dockpose.sources.frames import SourceError

# What a text in a file says that is not UTF-8 matters to nobody; PyAV 19 keeps such texts of itself.
_LENIENT: dict[str, Any] = {"metadata_errors": "ignore"} if int(av.__version__.split(".")[0]) < 19 else {}


def opened(source: str | BinaryIO, **options: Any) -> InputContainer:
    """Open what is to be read, with options of ``av.open``, whatever bytes its texts are."""
    return av.open(source, "r", **options, **_LENIENT)


_NONE = -(2**63)  # a packet without a time stamp
_BOXES = (".mp4", ".m4v", ".mov")
_MOST_FORWARD = 2**32  # ticks of MPEG's clock of 33 bits; FFmpeg takes a clock that runs back for one that went round
_RAW = {"h264", "hevc", "vvc", "mjpeg", "m4v", "mpegvideo", "obu"}  # FFmpeg counts 25 of their frames a second
# How files of a known format begin, and where.
_BEGINNINGS = (
    *((b"\x1a\x45\xdf\xa3", 0), (b"RIFF", 0), (b"\0\0\x01\xba", 0), (b"\x30\x26\xb2\x75", 0)),
    *((kind, 4) for kind in (b"ftyp", b"moov", b"mdat", b"moof", b"free", b"wide")),
)


@dataclass(frozen=True)
class Order:
    """What the packets of a video tell of its N frames, without decoding them."""

    count: int
    stamps: np.ndarray | None  # (N,) int64 ticks that grow, of the frames as they are shown; None where there are none
    ranks: np.ndarray | None  # (N,): index of the frame of each packet of the file; None where only the decoder knows
    joins: tuple[int, ...] = ()  # packets at which the clock jumps
    is_sought: bool = False  # whether stamps identify the frames


def order_of(container: InputContainer, stream: av.VideoStream) -> Order:
    """Read all packets of a video, as far as they can be read."""
    shown, sent = array("q"), array("q")
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, FFmpegError):
            break
        if counts(packet):
            shown.append(_NONE if packet.pts is None else packet.pts)
            sent.append(_NONE if packet.dts is None else packet.dts)
    name, is_mixed = container.format.name, stream.codec_context.has_b_frames
    # An AVI has no times for showing, and FFmpeg makes wrong ones up for frames that are sent in another order.
    is_guessed = name == "avi" and is_mixed and stream.codec_context.name in ("h264", "hevc")
    return _order(np.array(shown), np.array(sent), is_mixed, is_guessed, name.startswith("mpeg"))


def counts(packet: av.Packet) -> bool:
    """Whether a packet is that of a frame."""
    return packet.size > 0 and not packet.is_discard


def _order(shown: np.ndarray, sent: np.ndarray, is_mixed: bool, is_guessed: bool, is_mpeg: bool) -> Order:
    count = len(shown)
    ranks = None if is_mixed else np.arange(count)
    if is_guessed or (shown == _NONE).any():
        if count == 0 or (sent == _NONE).any():
            return Order(count, None, ranks)
        return Order(count, _growing(np.sort(sent)), ranks)
    clock = shown if (sent == _NONE).all() and not is_mixed else sent
    known = np.flatnonzero(clock != _NONE)
    steps = np.diff(clock[known])
    joins = known[1:][(steps < 0) | (is_mpeg & (steps > _MOST_FORWARD))]
    parts = np.split(shown.copy(), joins)
    for before, part in itertools.pairwise(parts):
        step = int(np.median(np.diff(np.sort(before)))) if len(before) > 1 else 0
        part += before.max() + max(step, 1) - part.min()
    shown = np.concatenate(parts)
    order = np.argsort(shown, kind="stable")
    is_sought = len(joins) == 0 and 0 < count == len(np.unique(shown))
    return Order(count, _growing(shown[order]), np.argsort(order), tuple(joins.tolist()), is_sought)


def _growing(stamps: np.ndarray) -> np.ndarray:
    """Stamps in their order, where two are the same a tick apart."""
    places = np.arange(len(stamps))
    return np.maximum.accumulate(stamps - places) + places


def is_without_clock(container: InputContainer, source: str) -> bool:
    """Whether a file has frames without times, for which FFmpeg makes up a rate where none is given."""
    return container.format.name in _RAW or (container.format.name == "avi" and _is_avi_without_rate(Path(source)))


def _is_avi_without_rate(path: Path) -> bool:
    """Whether neither the stream's header (strh: scale and rate) nor the file's (avih) tells a rate."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(4096)
    frame, stream = head.find(b"avih") + 8, head.find(b"vids")
    if frame < 8 or stream < 0 or any(head[frame : frame + 4]):
        return False
    return not any(head[stream + 20 : stream + 24]) or not any(head[stream + 24 : stream + 28])


def video_in(source: str) -> tuple[InputContainer, bool]:
    """A file, and whether it breaks off; raises SourceError if it cannot be opened or has no video."""
    try:
        container = opened(source)
    except (FFmpegError, OSError, ValueError) as error:
        container = _opened_cut_short(source)
        if container is None:
            raise SourceError(why_not(source)) from error
    if not container.streams.video:
        container.close()
        raise SourceError(f"{source}: has no video in it")
    if container.streams.video[0].codec_context is None:
        container.close()
        raise SourceError(f"{source}: is a video whose coding cannot be decoded here; convert it to H.264")
    is_mp4 = "mp4" in container.format.name.split(",")
    return container, is_mp4 and Path(source).is_file() and whole_boxes(Path(source))[1]


def _opened_cut_short(source: str) -> InputContainer | None:
    """Open an MP4 without the box that it breaks off in, unless that holds frames; None where that does not help."""
    path = Path(source)
    if not (source.lower().endswith(_BOXES) and path.is_file()):
        return None
    try:
        return opened(f"subfile,,start,0,end,{whole_boxes(path)[0]},,:{path.resolve()}")
    except (FFmpegError, OSError, ValueError):
        return None


def why_not(source: str) -> str:
    """Say why a video could not be opened."""
    if "://" in source:
        return f"{source}: is not a video that can be read"
    try:
        with Path(source).open("rb") as file:
            head = file.read(1024)
            kinds = {kind for kind, _, _ in _each_box(file)} if head[4:8] == b"ftyp" else set()
    except OSError as error:
        return f"{source}: cannot be read ({error.strerror or error})"
    if not head:
        return f"{source}: the file is empty (0 bytes)"
    if kinds and not kinds & {b"moov", b"moof"}:
        return f"{source}: is an MP4 that is cut short before its index, without which no frame is found"
    is_stream = head[0] == 0x47 and head[188:189] == b"\x47"
    if is_stream or any(head.startswith(begins, at) for begins, at in _BEGINNINGS):
        return f"{source}: begins as a video, but is damaged or cut short"
    return f"{source}: is not a video, or one of a format that is not read; convert it to MP4 or MKV"


def whole_boxes(path: Path) -> tuple[int, bool]:
    """Where the last whole box of an MP4 ends, or the file where that is within frames; and whether it breaks off.

    An MP4 is a row of boxes, each of which begins with its size and its kind (ISO 14496-12, section 4.2). Frames lie in
    boxes of the kind "mdat", of which FFmpeg reads what is there.
    """
    length, end, last = path.stat().st_size, 0, b""
    with path.open("rb") as file:
        for kind, start, size in _each_box(file):
            if size == 0:  # as far as the file goes
                return length, False
            if start + size > length:
                return (length if kind == b"mdat" else start), True
            end, last = start + size, kind
    return end, end < length or last == b"moof"  # the head of a fragment, whose frames would follow


def _each_box(file: BinaryIO) -> Iterator[tuple[bytes, int, int]]:
    """Kind, place and size of each box whose head is there; the last may be longer than the file, or 0 for its rest."""
    length = file.seek(0, os.SEEK_END)
    start = 0
    while start < length:
        file.seek(start)
        head = file.read(16)
        size = int.from_bytes(head[:4], "big")
        if len(head) < (16 if size == 1 else 8):
            return
        if size == 1:  # the size follows in 64 bits
            size = int.from_bytes(head[8:16], "big")
        if 0 < size < 8:
            return
        yield head[4:8], start, size
        if size == 0:
            return
        start += size
