"""What kind of source a text names: a path is never taken for an address, nor an address for a path."""

from __future__ import annotations

import enum
import glob
import re
from pathlib import Path

_ADDRESS = re.compile(r"(rtsps?|rtmps?|https?|udp|rtp|srt|tcp)://", re.IGNORECASE)
_SCENE_ENDINGS = (".yaml", ".yml")
VIDEO_ENDINGS = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".wmv", ".mjpeg", ".mjpg")


class Kind(enum.Enum):
    """What a source is."""

    PICTURE = "picture"
    FOLDER = "folder"
    GLOB = "glob"
    VIDEO = "video"
    CAMERA = "camera"
    STREAM = "stream"
    SIMULATED = "simulated"


def kind_of(source: str) -> Kind:
    """Tell what kind of source a text names.

    What is there as a file or folder is that, whatever its name. Else digits alone are a camera's number, and what
    begins as an address does (``rtsp://``, ``http://``) is a stream. A file is a video by its ending, and a YAML file
    a scene to simulate; what is neither is a picture.
    """
    path = Path(source)
    try:
        is_folder, is_file = path.is_dir(), path.exists()
    except OSError:  # too long for a file's name
        is_folder = is_file = False
    if is_folder:
        return Kind.FOLDER
    if not is_file:
        if _ADDRESS.match(source):
            return Kind.STREAM
        if source.isascii() and source.isdigit():
            return Kind.CAMERA
        if glob.has_magic(source):
            return Kind.GLOB
    ending = path.suffix.lower()
    if ending in _SCENE_ENDINGS:
        return Kind.SIMULATED
    return Kind.VIDEO if ending in VIDEO_ENDINGS else Kind.PICTURE
