"""What the packets of a video tell of its frames, without decoding them."""

import itertools
from array import array
from dataclasses import dataclass, replace
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError

_NONE = -(2**63)  # a packet without a time stamp
_MOST_FORWARD = 2**32  # ticks of MPEG's clock of 33 bits; FFmpeg takes a clock that runs back for one that went round


@dataclass(frozen=True)
class Order:
    """What the packets of a video tell of its N frames, without decoding them."""

    count: int
    stamps: np.ndarray | None  # (N,) int64 ticks that grow, of the frames as they are shown; None where there are none
    ranks: np.ndarray | None  # (N,): index of the frame of each packet of the file; None where only the decoder knows
    joins: tuple[int, ...] = ()  # packets at which the clock jumps
    is_sought: bool = False  # whether stamps identify the frames
    is_torn: bool = False  # whether the last packet is damaged, or reading ended by an error
    damaged: frozenset[int] = frozenset()  # stamps of damaged packets where frames are sought, else their numbers


def order_of(container: InputContainer, stream: av.VideoStream) -> Order:
    """Read all packets of a video, as far as they can be read."""
    shown, sent, name = array("q"), array("q"), container.format.name
    packets, is_torn, marked, second = container.demux(stream), False, list[int](), 0
    end = 2**63
    while True:
        try:
            packet = next(packets)
        except StopIteration:
            break
        except FFmpegError:
            is_torn = True
            break
        if counts(packet):
            is_torn = packet.is_corrupt
            if is_torn:
                marked.append(len(shown))
            end = (packet.pos or 0) + packet.size
            if len(shown) == 1:
                second = packet.pos or 0
            shown.append(_NONE if packet.pts is None else packet.pts)
            sent.append(_NONE if packet.dts is None else packet.dts)
    is_mixed = stream.codec_context.has_b_frames
    if name == "yuv4mpegpipe" and Path(container.name).is_file():  # of which FFmpeg drops a frame that is not whole
        is_torn |= end < Path(container.name).stat().st_size
    # An AVI has no times for showing, and FFmpeg makes wrong ones up for frames that are sent in another order.
    is_guessed = name == "avi" and is_mixed and stream.codec_context.name in ("h264", "hevc")
    is_mpeg = name.startswith("mpeg")  # whose recordings begin and end anywhere
    order = _order(np.array(shown), np.array(sent), is_mixed, is_guessed, is_mpeg)
    if name == "mpegts":  # FFmpeg marks the packet before the damaged one, so that none tells of the first
        marked = [number + 1 for number in marked if number + 2 not in order.joins]
        marked += [0] * _has_gap(container.name, stream.id, second)
    keys = shown if order.is_sought else range(len(shown))
    damaged = frozenset(keys[number] for number in marked if number < len(shown))
    return replace(order, is_torn=is_torn and not is_mpeg, damaged=damaged)


def counts(packet: av.Packet) -> bool:
    """Whether a packet is that of a frame."""
    return packet.size > 0 and not packet.is_discard


def _has_gap(source: str, pid: int, end: int) -> bool:
    """Whether a packet of a stream is missing before a place in a file of MPEG-TS, by the numbers that they have."""
    if not Path(source).is_file():
        return False
    with open(source, "rb") as file:
        data = file.read(end + 204)
    size = next((size for size in (188, 192, 204) if data[size::size][:8].count(data[0]) == 8), 188)
    begin = 4 * (size == 192)
    rows = np.frombuffer(data[: len(data) // size * size], np.uint8).reshape(-1, size)
    packets = rows[:, begin : begin + 4].astype(int)
    mine = packets[((packets[:, 1] & 31) << 8 | packets[:, 2] == pid) & (packets[:, 3] & 16 > 0), 3] & 15
    return bool((np.diff(mine) % 16 > 1).any())


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
