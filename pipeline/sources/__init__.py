"""Where pictures come from: files, videos, cameras, streams and simulated courses, all as frames with times."""

from pipeline.sources.ahead import read_ahead
from pipeline.sources.frames import Frame, Frames, SourceError, Tell
from pipeline.sources.live import Live
from pipeline.sources.names import VIDEO_ENDINGS, Kind, kind_of
from pipeline.sources.opening import open_frames
from pipeline.sources.pictures import PICTURE_ENDINGS, Pictures, list_pictures, numeric
from pipeline.sources.simulated import Simulated
from pipeline.sources.video import Video

__all__ = [
    "PICTURE_ENDINGS",
    "VIDEO_ENDINGS",
    "Frame",
    "Frames",
    "Kind",
    "Live",
    "Pictures",
    "Simulated",
    "SourceError",
    "Tell",
    "Video",
    "kind_of",
    "list_pictures",
    "numeric",
    "open_frames",
    "read_ahead",
]
