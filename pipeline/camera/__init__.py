"""Cameras and the images they take: intrinsics, lenses, ports, files, calibration, image decoding."""

from dockpose.camera.board import Board
from dockpose.camera.calibrate import Calibration
from dockpose.camera.camera import Camera
from dockpose.camera.files import load_camera, save_camera
from dockpose.camera.port import FlatPort

__all__ = ["Board", "Calibration", "Camera", "FlatPort", "load_camera", "save_camera"]
