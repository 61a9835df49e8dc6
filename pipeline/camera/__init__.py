"""Cameras and the images they take: intrinsics, lenses, ports, files, calibration, image decoding.

The lowest folder of the library: may import `dockpose.checks` only.
"""

from dockpose.camera.camera import Camera
from dockpose.camera.files import load_camera, save_camera
from dockpose.camera.port import FlatPort

__all__ = ["Camera", "FlatPort", "load_camera", "save_camera"]
