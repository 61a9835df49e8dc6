"""Sources of frames with times: picture files, videos, bags, cameras, streams and simulated courses.

A name's file is imported when it is first asked for: FFmpeg is not needed for a picture.

Public are ``open_frames``, ``Frame``, ``Frames`` and ``SourceError``; the other names serve the program.

May import `dockpose.estimate` and `dockpose.simulate`, since simulated courses can be steered by an estimator.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from dockpose.sources.bags.bag import Bag
    from dockpose.sources.exposure import ExposureWatch
    from dockpose.sources.frames import Callback, Frame, Frames, SourceError, read_ahead
    from dockpose.sources.kinds import (
        BAG_ENDINGS,
        DEFAULT_CAPTURE,
        VIDEO_ENDINGS,
        CaptureSettings,
        Kind,
        camera_number,
        kind_of,
    )
    from dockpose.sources.live import Arrival, Live
    from dockpose.sources.opening import Simulated, open_frames
    from dockpose.sources.pictures import PICTURE_ENDINGS, Pictures, list_pictures, numeric
    from dockpose.sources.video import Video

__all__ = ["BAG_ENDINGS", "DEFAULT_CAPTURE", "PICTURE_ENDINGS", "VIDEO_ENDINGS", "Arrival", "Bag", "Callback"]
__all__ += ["CaptureSettings", "ExposureWatch", "Frame", "Frames", "Kind", "Live", "Pictures", "Simulated"]
__all__ += ["SourceError", "Video", "camera_number", "kind_of", "list_pictures", "numeric", "open_frames"]
__all__ += ["read_ahead"]

_HOMES = {
    "bags.bag": ("Bag",),
    "exposure": ("ExposureWatch",),
    "frames": ("Frame", "Frames", "SourceError", "Callback", "read_ahead"),
    "kinds": ("BAG_ENDINGS", "DEFAULT_CAPTURE", "VIDEO_ENDINGS", "Kind", "CaptureSettings", "camera_number", "kind_of"),
    "live": ("Arrival", "Live"),
    "opening": ("Simulated", "open_frames"),
    "pictures": ("PICTURE_ENDINGS", "Pictures", "list_pictures", "numeric"),
    "video": ("Video",),
}
__getattr__, __dir__, _ = lazy_loader.attach(__name__, submod_attrs=_HOMES)
