"""From one picture of a ring of lights to the two poses of the dock: pure functions on arrays."""

from pipeline.camera import Camera
from pipeline.dock import Dock
from pipeline.estimate import Estimate, Settings, estimate
from pipeline.tracker import Track, Tracked, Tracker

__all__ = ["Camera", "Dock", "Estimate", "Settings", "Track", "Tracked", "Tracker", "estimate"]
