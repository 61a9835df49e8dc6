"""Which kind of source a text names, and what a camera is asked for; a path is never taken for an address."""

import enum
import glob
import re
from dataclasses import dataclass
from pathlib import Path

from dockpose.sources.bags.storage import BAG_METADATA, is_rosbag2_file
from dockpose.sources.pictures import has_pages

_ADDRESS = re.compile(r"(rtsps?|rtmps?|https?|udp|rtp|srt|tcp)://", re.IGNORECASE)
_CAMERA = re.compile(r"(?:/dev/video)?([0-9]{1,4})")
_SCENE_ENDINGS = (".yaml", ".yml")
_DESCRIPTION = ".sdp"  # of a stream
VIDEO_ENDINGS = (
    *(".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".m2ts", ".mts", ".wmv", ".flv"),
    *(".mjpeg", ".mjpg", ".h264", ".264", ".avc", ".h265", ".265", ".hevc"),  # frames one after another, without times
)
BAG_ENDINGS = (".mcap", ".bag", ".db3")  # of files; rosbag2 makes folders of the first and the last


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
    """Tell what kind of source a text names; what exists goes first, whatever its name, a camera before a stream."""
    path = Path(source)
    try:
        is_folder, is_file = path.is_dir(), path.exists()
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
    if path.suffix.lower() == _DESCRIPTION:
        return Kind.STREAM
    for endings, kind in ((_SCENE_ENDINGS, Kind.SIMULATED), (BAG_ENDINGS, Kind.BAG), (VIDEO_ENDINGS, Kind.VIDEO)):
        if path.suffix.lower() in endings:
            return kind
    return Kind.PAGES if is_file and has_pages(path) else Kind.PICTURE


def camera_number(source: str) -> int | None:
    """Number of the camera that a text names: "0", "/dev/video0", or a link to one, as in /dev/v4l/by-id; else None."""
    device = str(Path(source).resolve()) if source.startswith("/dev/") else source
    match = _CAMERA.fullmatch(device)
    return None if match is None else int(match[1])


def is_rtp(source: str) -> bool:
    """Whether a stream is one that is sent to a UDP port of ours."""
    return source.lower().startswith("rtp://") or (source.lower().endswith(_DESCRIPTION) and "://" not in source)


def _is_bag(folder: Path) -> bool:
    """Whether rosbag2 wrote a folder; where it was killed, the description is missing."""
    try:
        if (folder / BAG_METADATA).is_file():
            with (folder / BAG_METADATA).open("rb") as file:
                return b"rosbag2_bagfile_information" in file.read(4096)
        return any(map(is_rosbag2_file, folder.iterdir()))
    except OSError:
        return False


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
