"""Sources of frames with times: picture files, videos, bags, cameras, streams and simulated courses.

Public are ``open_frames``, ``Frame``, ``Frames`` and ``SourceError``; the other names serve the program.

May import `dockpose.estimate` and `dockpose.simulate`, since simulated courses can be steered by an estimator.
"""

from dockpose.sources.bags import Bag
from dockpose.sources.capture import NO_WISHES, Wishes
from dockpose.sources.exposure import ExposureWatch
from dockpose.sources.frames import Frame, Frames, SourceError, Tell, read_ahead
from dockpose.sources.live import Arrival, Live
from dockpose.sources.opening import BAG_ENDINGS, VIDEO_ENDINGS, Kind, Simulated, camera_number, kind_of, open_frames
from dockpose.sources.pictures import PICTURE_ENDINGS, Pictures, list_pictures, numeric
from dockpose.sources.video import Video

__all__ = [
    "BAG_ENDINGS",
    "NO_WISHES",
    "PICTURE_ENDINGS",
    "VIDEO_ENDINGS",
    "Arrival",
    "Bag",
    "ExposureWatch",
    "Frame",
    "Frames",
    "Kind",
    "Live",
    "Pictures",
    "Simulated",
    "SourceError",
    "Tell",
    "Video",
    "Wishes",
    "camera_number",
    "kind_of",
    "list_pictures",
    "numeric",
    "open_frames",
    "read_ahead",
]
