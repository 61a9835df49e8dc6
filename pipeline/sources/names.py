"""The kind of source that a text names; a path is never taken for an address, nor an address for a path."""

import enum
import glob
import re
from pathlib import Path

from dockpose.sources.frames import SourceError
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
BAG_METADATA = "metadata.yaml"  # beside the files of rosbag2


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
    ending = path.suffix.lower()
    if ending == _DESCRIPTION:
        return Kind.STREAM
    if ending in _SCENE_ENDINGS:
        return Kind.SIMULATED
    if ending in BAG_ENDINGS:
        return Kind.BAG
    if ending in VIDEO_ENDINGS:
        return Kind.VIDEO
    return Kind.PAGES if is_file and has_pages(path) else Kind.PICTURE


def camera_number(source: str) -> int | None:
    """Number of the camera that a text names: "0", "/dev/video0", or a link to one, as in /dev/v4l/by-id; else None."""
    device = str(Path(source).resolve()) if source.startswith("/dev/") else source
    match = _CAMERA.fullmatch(device)
    return None if match is None else int(match[1])


def is_rtp(source: str) -> bool:
    """Whether a stream is one that is sent to a UDP port of ours."""
    return source.lower().startswith("rtp://") or (source.lower().endswith(_DESCRIPTION) and "://" not in source)


def check_regular(source: str | Path) -> None:
    """Raise SourceError for a pipe or a device in place of a file, from which reading might never end."""
    path = Path(source)
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise SourceError(f"{source}: is not a regular file, but a pipe or a device; only files are read")


def is_rosbag2_file(path: Path) -> bool:
    """Whether a file's name is that of one of the files in a folder that rosbag2 writes."""
    return path.name.lower().removesuffix(".zstd").endswith((".mcap", ".db3"))


def _is_bag(folder: Path) -> bool:
    """Whether rosbag2 wrote a folder; where it was killed, the description is missing."""
    try:
        if (folder / BAG_METADATA).is_file():
            with (folder / BAG_METADATA).open("rb") as file:
                return b"rosbag2_bagfile_information" in file.read(4096)
        return any(map(is_rosbag2_file, folder.iterdir()))
    except OSError:
        return False
