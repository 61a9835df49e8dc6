"""Which kind of source a text names, and what a camera is asked for; a path is never taken for an address."""

import enum
import glob
import re
from dataclasses import dataclass
from pathlib import Path

from dockpose.sources.bags.storage import BAG_METADATA, ZSTD_BEGINS, ending_of, head_of, is_rosbag2_file
from dockpose.sources.pictures import PICTURE_ENDINGS, has_pages

_ADDRESS = re.compile(r"(rtsps?|rtmps?|https?|udp|rtp|srt|tcp|blueos)://", re.IGNORECASE)
_CAMERA = re.compile(r"(?:/dev/video)?([0-9]{1,4})")
_SCENE_ENDINGS = (".yaml", ".yml")
_DESCRIPTION = ".sdp"  # of a stream
_MOTION_JPEG = (".mjpeg", ".mjpg")
VIDEO_ENDINGS = (
    *(".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".m2ts", ".mts", ".wmv", ".flv"),
    *(".lrv", ".insv", ".360", ".3gp", ".3g2", ".qt", ".f4v", ".asf", ".ogv", ".vob", ".m2v", ".mxf", ".ivf", ".dav"),
    *(*_MOTION_JPEG, ".h264", ".264", ".avc", ".h265", ".265", ".hevc"),  # frames one after another, without times
)
BAG_ENDINGS = (".mcap", ".bag", ".db3")  # of files; rosbag2 makes folders of the first and the last
HEAD_BYTES = 8192
_METADATA_BEGINS = b"rosbag2_bagfile_information"  # of the file that describes a bag's folder
# How files begin, whatever their names: MP4 and QuickTime by their boxes, MPEG's streams by their packets.
_PICTURE_BEGINS = re.compile(
    rb"""(?xs) \xff\xd8\xff | \x89PNG\r\n | GIF8[79]a | II[*+U]\0 | MM\0[*+] | II(RO|RS) | MMOR | RIFF.{4}WEBP
    | .{4}(jP\ \ |JXL\ |ftyp(hei|hev|mi[af]|msf1|avi|crx\ )) | \xff\x0a | \xff\x4f\xff\x51 | P[1-7]\s
    | BM.{4}\0{4}.{5}\0{3} | FUJIFILM | 8BPS | \x76\x2f\x31\x01"""
)
VIDEO_BEGINS = re.compile(
    rb"""(?xs) .{4}(ftyp | moov | mdat | moof | styp | sidx) | \0.{3}(free | skip | wide | pnot) | \x1a\x45\xdf\xa3
    | RIFF.{4}(AVI\ |CDXA) | \0\0\x01[\xba\xb3] | \0?\0\0\x01[\x67\x40\x46] | \x30\x26\xb2\x75\x8e\x66\xcf\x11
    | nut/multimedia | \.RMF | \xb7\xd8\x00\x20\x37\x49\xda\x11
    | FLV\x01 | OggS | DKIF\0 | YUV4MPEG2\  | \x06\x0e\x2b\x34\x02\x05\x01\x01 | IMKH | DHAV
    | .{0,203}?( (\x47.{187}){8} | (\x47.{191}){8} | (\x47.{203}){8} )"""
)


class Kind(enum.Enum):
    """The kind of a source."""

    PICTURE = "picture"
    PAGES = "pages"  # several pictures in one file
    FOLDER = "folder"
    GLOB = "glob"
    VIDEO = "video"
    BAG = "bag"
    CAMERA = "camera"
    STREAM = "stream"
    SIMULATED = "simulated"


def kind_of(source: str) -> Kind:
    """Tell what kind of source a text names, of a file by its first bytes; what exists comes first, then cameras."""
    path = Path(source)
    try:
        is_folder, is_file = source != "" and path.is_dir(), source != "" and path.exists()
    except OSError:  # too long for a file name
        is_folder = is_file = False
    if is_folder:
        return Kind.BAG if _is_bag(path) else Kind.FOLDER
    if camera_number(source) is not None and not (is_file and path.is_file()):
        return Kind.CAMERA
    if not is_file:
        if _ADDRESS.match(source):
            return Kind.STREAM
        if glob.has_magic(source):
            return Kind.GLOB
    if is_file and (kind := _by_content(path)):
        return kind
    if path.suffix.lower() == _DESCRIPTION:
        return Kind.STREAM
    for endings, kind in ((_SCENE_ENDINGS, Kind.SIMULATED), (BAG_ENDINGS, Kind.BAG), (VIDEO_ENDINGS, Kind.VIDEO)):
        if path.suffix.lower() in endings:
            return kind
    return Kind.PICTURE


def _by_content(path: Path) -> Kind | None:
    """The kind of a file by its first bytes; None where they do not tell, or cannot be read."""
    try:
        head = head_of(path, HEAD_BYTES) if path.is_file() else b""
    except OSError:
        return None
    if ending_of(head) or head.startswith((ZSTD_BEGINS, _METADATA_BEGINS)):
        return Kind.BAG
    if _PICTURE_BEGINS.match(head):
        if head.startswith(b"\xff\xd8") and path.suffix.lower() in _MOTION_JPEG:  # which begins as its first picture
            return Kind.VIDEO
        return Kind.PAGES if has_pages(path) else Kind.PICTURE
    return Kind.VIDEO if VIDEO_BEGINS.match(head) else None


def camera_number(source: str) -> int | None:
    """Number of the camera that a text names: "0", "/dev/video0", or a link to one, as in /dev/v4l/by-id; else None."""
    device = str(Path(source).resolve()) if source.startswith("/dev/") else source
    match = _CAMERA.fullmatch(device)
    return None if match is None else int(match[1])


def is_rtp(source: str) -> bool:
    """Whether a stream is one that is sent to a UDP port of ours."""
    return source.lower().startswith("rtp://") or (source.lower().endswith(_DESCRIPTION) and "://" not in source)


def _is_bag(folder: Path) -> bool:
    """Whether rosbag2 wrote a folder; where it was killed, the description is missing, and no picture is beside it."""
    try:
        if (folder / BAG_METADATA).is_file() and b"rosbag2_bagfile_information" in head_of(folder / BAG_METADATA, 4096):
            return True
        files = list(folder.iterdir())
    except OSError:
        return False
    others = (*PICTURE_ENDINGS, *VIDEO_ENDINGS)
    return any(map(is_rosbag2_file, files)) and not any(file.suffix.lower() in others for file in files)


@dataclass(frozen=True)
class CaptureSettings:
    """What a camera is asked for; None leaves it as it is."""

    width: int | None = None
    height: int | None = None
    exposure: float | None = None  # in its own unit: 0.1 ms with Video4Linux, powers of two of a second on Windows
    gain: float | None = None  # in its own unit
    rate_hz: float | None = None
    format: str | None = None  # of the pixels, by its four letters (FOURCC), as MJPG, YUYV, GREY or Y16


DEFAULT_CAPTURE = CaptureSettings()
