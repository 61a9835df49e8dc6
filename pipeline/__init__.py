"""Position and attitude of a circular underwater dock from one image of its ring of lights.

The data flows one way: image, threshold, markers, ring, ellipse, poses, choice. Each folder holds one step.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from dockpose.camera.camera import Camera
    from dockpose.camera.files import load_camera
    from dockpose.dock import Dock, Entrance
    from dockpose.estimate import Estimate, Settings, estimate
    from dockpose.guidance import Guidance, guide
    from dockpose.sidecar import load_dock
    from dockpose.simulate.files import load_scene
    from dockpose.sources.boards import calibrate
    from dockpose.sources.opening import open_frames
    from dockpose.thresholds import register_threshold
    from dockpose.tracking.tracker import Track, Tracked, Tracker
    from dockpose.vehicle import BodyPose, Mount, Vehicle, load_vehicle

__version__ = "0.3.0"

__all__ = [
    "BodyPose",
    "Camera",
    "Dock",
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
    "calibrate",
    "estimate",
    "guide",
    "load_camera",
    "load_dock",
    "load_scene",
    "load_vehicle",
    "open_frames",
    "register_threshold",
]

# All at once take most of a second to import.
_HOMES = {
    "camera.camera": ("Camera",),
    "camera.files": ("load_camera",),
    "dock": ("Dock", "Entrance"),
    "estimate": ("Estimate", "estimate"),
    "guidance": ("Guidance", "guide"),
    "settings": ("Settings",),
    "sidecar": ("load_dock",),
    "simulate.files": ("load_scene",),
    "sources.boards": ("calibrate",),
    "sources.opening": ("open_frames",),
    "thresholds": ("register_threshold",),
    "tracking.tracker": ("Track", "Tracked", "Tracker"),
    "vehicle": ("BodyPose", "Mount", "Vehicle", "load_vehicle"),
}
__getattr__, __dir__, _ = lazy_loader.attach(__name__, submod_attrs=_HOMES)
