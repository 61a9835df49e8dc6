"""Simulated pictures of a dock, with the truth beside them."""

from pipeline.simulate.files import load_scene, render_folder, save_scene
from pipeline.simulate.render import Rendering, render, render_parts
from pipeline.simulate.scene import Lights, Pose, Scene, Sensor
from pipeline.simulate.truth import Truth, truth_dict, truth_of

__all__ = [
    "Lights",
    "Pose",
    "Rendering",
    "Scene",
    "Sensor",
    "Truth",
    "load_scene",
    "render",
    "render_folder",
    "render_parts",
    "save_scene",
    "truth_dict",
    "truth_of",
]
