"""What FFmpeg gives: files and streams that are open, what their packets tell, MP4 files that break off, and pixels."""

import contextlib
import os
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

import av
import cv2
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from av.stream import Disposition
from dockpose.sources.bags.storage import head_of
from dockpose.sources.frames import SourceError
from dockpose.sources.kinds import HEAD_BYTES, VIDEO_BEGINS
from dockpose.sources.rtp.relay import Relay

_TIMEOUT_S = 10.0  # of a server that nobody else limits
# What a text in a file says that is not UTF-8 matters to nobody; PyAV 19 keeps such texts of itself.
_LENIENT: dict[str, Any] = {"metadata_errors": "ignore"} if int(av.__version__.split(".")[0]) < 19 else {}


def opened(source: str | BinaryIO, **more: Any) -> InputContainer:
    """Open what is to be read, with arguments of ``av.open``, whatever bytes its texts are."""
    if isinstance(source, str) and source.lower().startswith("rtsp://"):
        # FFmpeg's RTSP loses frames over UDP without a word. What is sent within TLS is not looked into.
        source = Relay(source, more.setdefault("timeout", (_TIMEOUT_S, _TIMEOUT_S))[0]).address
    if isinstance(source, str) and source.lower().startswith("rtsp"):
        more["options"] = {**more.get("options", {}), "rtsp_transport": "tcp"}
    return av.open(source, "r", **more, **_LENIENT)


_MP4_BEGINS = (b"ftyp", b"moov", b"mdat", b"free", b"wide", b"skip", b"styp", b"moof")
_MP4_BOXES = (*_MP4_BEGINS, b"sidx", b"mfra", b"uuid", b"udta", b"meta", b"prft", b"emsg", b"pnot", b"pdin")
_RAW = {"h264", "hevc", "vvc", "mjpeg", "m4v", "mpegvideo", "obu"}  # FFmpeg counts 25 of their frames a second


def best_video(container: InputContainer) -> av.VideoStream:
    """The stream that is the film: no cover, no preview; where several are alike that which FFmpeg takes."""
    best, most = container.streams.best("video"), max(map(_length, container.streams.video), default=0)

    def rank(stream: av.VideoStream) -> tuple[bool, bool, int, bool]:
        codec, is_cover = stream.codec_context, bool(stream.disposition & Disposition.attached_pic)
        size = 0 if codec is None else codec.width * codec.height
        return not is_cover, 2 * _length(stream) > most or not most, size, stream is best

    return max(container.streams.video, key=rank)


def _length(stream: av.VideoStream) -> float:
    """How long a stream is, in frames or seconds as its container tells; 0 where it does not."""
    hours, _, rest = stream.metadata.get("DURATION", "").partition(":")  # of Matroska
    minutes, _, seconds = rest.partition(":")
    with contextlib.suppress(ValueError):
        return stream.frames or 3600 * int(hours) + 60 * int(minutes) + float(seconds)
    return 0


def others_sentence(container: InputContainer) -> str:
    """Sentence on the streams that were not taken, beside covers; empty where there are none."""
    streams = [each for each in container.streams.video if not each.disposition & Disposition.attached_pic]
    codecs = {each: each.codec_context for each in streams if each.codec_context}
    names = {each: f"{each.index} ({codec.width} x {codec.height})" for each, codec in codecs.items()}
    taken = best_video(container)
    others = ", ".join(name for each, name in names.items() if each is not taken)
    return f"has {len(names)} video streams; number {names[taken]} is taken, not {others}" if others else ""


def is_without_clock(container: InputContainer, source: str) -> bool:
    """Whether a file has frames without times, for which FFmpeg makes up a rate where none is given."""
    if container.format.name != "avi" or not Path(source).is_file():
        return container.format.name in _RAW
    # Of an AVI the stream's header (strh: scale and rate) or the file's (avih) tells the rate.
    with open(source, "rb") as file:
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
    streams = container.streams.video
    if not streams or best_video(container).codec_context is None:
        container.close()
        uncoded = "is a video whose coding cannot be decoded here; convert it to H.264"
        raise SourceError(f"{source}: {uncoded if streams else 'has no video in it'}")
    codec = best_video(container).codec_context
    if codec is not None and codec.name == "rawvideo" and str(codec.pix_fmt).startswith("rgb555"):
        container.close()
        unclear = "has pictures of 16 bits that are grey or in colours (RGB555), and does not say which"
        raise SourceError(f"{source}: {unclear}; convert it to FFV1 in MKV")
    return container, Path(source).is_file() and _breaks_off(Path(source), container.format.name.split(","))


def _breaks_off(path: Path, formats: list[str]) -> bool:
    """Whether a file is shorter than its container says; a header's count of frames is an estimate and no sign."""
    if "mp4" in formats:
        return whole_boxes(path)[1]
    length, at = path.stat().st_size, 0
    with path.open("rb") as file:
        head = file.read(256).ljust(300, b"\0")
        if "matroska" in formats:
            size, at = _vint(head, 4)  # of the file's head, which the segment follows
            at += size or 0
            if head[at : at + 4] != b"\x18\x53\x80\x67":
                return False
            size, at = _vint(head, at + 4)
            return size is not None and at + size > length
        if "mxf" in formats:  # whose head says where its last part begins (SMPTE 377, partition pack); 0 if unknown
            at = 41 + (head[16] & 127) * (head[16] > 127)
            return head[:4] == b"\x06\x0e\x2b\x34" and int.from_bytes(head[at : at + 8], "big") >= length
        while "avi" in formats and head[:4] == b"RIFF":
            size = int.from_bytes(head[4:8], "little")
            if size == 0 or at + size > length:  # one that was killed leaves 0, and some count the 8 bytes before
                return True
            at += 8 + size + size % 2
            file.seek(at)
            head = file.read(8)
    return False


def _vint(head: bytes, at: int) -> tuple[int | None, int]:
    """A size of Matroska, None where unknown, and where it ends; leading zeros tell its length."""
    length = 9 - head[at].bit_length()
    size, most = int.from_bytes(head[at : at + length], "big"), (1 << 7 * length) - 1
    return (None if size & most == most else size & most), at + length


def _opened_cut_short(source: str) -> InputContainer | None:
    """Open an MP4 without the box that it breaks off in, unless that holds frames; None where that does not help."""
    path = Path(source)
    if not path.is_file() or not head_of(path).startswith(_MP4_BEGINS, 4):
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
            head = file.read(HEAD_BYTES)
            kinds = {kind for kind, _, _ in _each_box(file)} if head[4:8] == b"ftyp" else set()
    except OSError as error:
        return f"{source}: cannot be read ({error.strerror or error})"
    if not head:
        return f"{source}: the file is empty (0 bytes)"
    if kinds and not kinds & {b"moov", b"moof"}:
        return f"{source}: is an MP4 that is cut short before its index, without which no frame is found"
    if VIDEO_BEGINS.match(head):
        return f"{source}: begins as a video, but is damaged or cut short"
    return f"{source}: is not a video, or one of a format that is not read; convert it to MP4 or MKV"


def whole_boxes(path: Path) -> tuple[int, bool]:
    """Where the last whole box of an MP4 ends, or the file where that is within frames; and whether it breaks off."""
    # An MP4 is a row of boxes, each of which begins with its size and its kind (ISO 14496-12, section 4.2). Frames lie
    # in boxes of the kind "mdat", of which FFmpeg reads what is there.
    length, end, last = path.stat().st_size, 0, b""
    with path.open("rb") as file:
        for kind, start, size in _each_box(file):
            if size == 0:  # as far as the file goes
                return length, False
            if start + size > length and end and kind not in _MP4_BOXES and last != b"moof":
                return start, False  # cameras, as Insta360's, put data of their own behind the boxes
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


# Formats whose first plane is the brightness, with as many bits as the first component has, from the lowest bit on.
_LUMA_FIRST = ("yuv4", "yuvj4", "yuva4", "gray", "nv12", "nv16", "nv21", "nv24")
# EXIF's numbers, by where a display matrix takes the picture's x axis and its y axis (ISO 14496-12, section 8.3.2).
_UPRIGHT, _ASIDE = ((1, 1), (-1, 1), (-1, -1), (1, -1)), ((1, 1), (1, -1), (-1, -1), (-1, 1))
_ORIENTATIONS = {(a, 0, 0, d): number for number, (a, d) in enumerate(_UPRIGHT, 1)}
_ORIENTATIONS |= {(0, b, c, 0): number for number, (b, c) in enumerate(_ASIDE, 5)}
_FULL_RANGE, _LIMITED_RANGE = 2, 1  # FFmpeg's AVCOL_RANGE_JPEG and AVCOL_RANGE_MPEG


def picture_of(frame: av.VideoFrame, *, grey: bool = False) -> np.ndarray:
    """Return the picture (H, W) or (H, W, 3) that a frame shows, as the sensor has it; see :func:`orientation_of`."""
    name = frame.format.name
    if name.startswith(_LUMA_FIRST) and (grey or name.startswith("gray")):
        return _luma(frame)
    is_deep = max(component.bits for component in frame.format.components) > 8 and not name.startswith("pal")
    if grey and not frame.format.is_rgb:
        return frame.to_ndarray(format="gray16le" if is_deep else "gray")
    return frame.to_ndarray(format="bgr48le" if is_deep else "bgr24")


def orientation_of(frame: av.VideoFrame) -> int:
    """How a frame is to be shown, by EXIF's numbers: 1 as it is, 2 to 8 turned or mirrored, 0 askew; not applied."""
    side_data: Any = frame.side_data  # its types say that names alone are taken
    for place in range(len(side_data)):
        side = side_data[place]
        if side.type.name == "DISPLAYMATRIX":
            a, b, _, c, d = np.frombuffer(bytes(side), np.int32)[:5] / 65536
            return _ORIENTATIONS.get((round(a), round(b), round(c), round(d)), 0)
    return 1


def _luma(frame: av.VideoFrame) -> np.ndarray:
    bits = frame.format.components[0].bits
    order = ">u2" if frame.format.name.endswith("be") else "<u2"
    plane = frame.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8 if bits == 8 else order).reshape(frame.height, -1)
    levels = rows[:, : frame.width]
    is_grey = frame.format.name.startswith("gray")
    is_full = frame.color_range == _FULL_RANGE or frame.format.name.startswith("yuvj")
    if is_full or (is_grey and frame.color_range != _LIMITED_RANGE):
        return levels.astype(np.uint8 if bits == 8 else np.uint16)
    stretch = _stretched(bits)
    return np.asarray(cv2.LUT(levels, stretch)) if bits == 8 else stretch[levels]


@lru_cache(maxsize=8)
def _stretched(bits: int) -> np.ndarray:
    """Full-scale level of each level of video range, of so many bits."""
    step = 1 << (bits - 8)
    levels = (np.arange(1 << bits) - 16 * step) / (219 * step)
    top = (1 << bits) - 1
    return np.clip(np.rint(levels * top), 0, top).astype(np.uint8 if bits == 8 else np.uint16)
