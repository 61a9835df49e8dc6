"""Position and attitude of a circular underwater dock from one image of its ring of lights.

The data flows one way: image, threshold, markers, ring, ellipse, poses, choice. Each folder holds one step.
"""

from dockpose.camera.camera import Camera
from dockpose.dock import Dock, DockRing, Entrance
from dockpose.estimate import Estimate, Settings, estimate
from dockpose.guidance import Guidance, guide
from dockpose.sources.opening import open_frames
from dockpose.thresholds import register_threshold
from dockpose.tracking.tracker import Track, Tracked, Tracker
from dockpose.vehicle import BodyPose, Mount, Vehicle, load_vehicle

__version__ = "0.2.0"

__all__ = [
    "BodyPose",
    "Camera",
    "Dock",
    "DockRing",
    "Entrance",
    "Estimate",
    "Guidance",
    "Mount",
    "Settings",
    "Track",
    "Tracked",
    "Tracker",
    "Vehicle",
    "__version__",
    "estimate",
    "guide",
    "load_vehicle",
    "open_frames",
    "register_threshold",
]
