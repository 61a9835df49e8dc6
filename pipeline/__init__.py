"""Position and attitude of a circular underwater dock from one image of its ring of lights.

The data flows one way: image, threshold, markers, ring, ellipse, poses, choice. Each folder holds one step.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dockpose.camera.camera import Camera
    from dockpose.dock import Dock
    from dockpose.estimate import Estimate, Settings, estimate
    from dockpose.sources.opening import open_frames
    from dockpose.thresholds import register_threshold
    from dockpose.tracking.tracker import Track, Tracked, Tracker

__version__ = "0.2.0"

__all__ = [
    "Camera",
    "Dock",
    "Estimate",
    "Settings",
    "Track",
    "Tracked",
    "Tracker",
    "__version__",
    "estimate",
    "open_frames",
    "register_threshold",
]

_HOMES = {
    "Camera": "camera.camera",
    "Dock": "dock",
    "Estimate": "estimate",
    "Settings": "settings",
    "Track": "tracking.tracker",
    "Tracked": "tracking.tracker",
    "Tracker": "tracking.tracker",
    "estimate": "estimate",
    "open_frames": "sources.opening",
    "register_threshold": "thresholds",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: all of them at once take most of a second."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """Keeps ``estimate`` the function, though importing the folder of that name would put it there."""

    def __setattr__(self, name: str, value: object) -> None:
        is_folder = name == "estimate" and isinstance(value, ModuleType)
        super().__setattr__(name, getattr(value, name) if is_folder else value)


sys.modules[__name__].__class__ = _Package
