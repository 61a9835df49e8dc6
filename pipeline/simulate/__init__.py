"""Simulated pictures and sequences of a dock, with the truth beside them."""

from dockpose.simulate.files import load_scene, load_sequence, render_folder, save_scene, save_sequence
from dockpose.simulate.motion import Approach, ClosedLoop, Hover, Sweep
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Lights, Pose, Sensor
from dockpose.simulate.render import Rendering, render, render_parts
from dockpose.simulate.scene import Scene
from dockpose.simulate.sequence import FilmPlan, RenderedFrame, film, scenes
from dockpose.simulate.truth import Truth, truth_dict, truth_of

__all__ = [
    "Approach",
    "ClosedLoop",
    "FilmPlan",
    "Hover",
    "Lights",
    "Pose",
    "RenderedFrame",
    "Rendering",
    "Scene",
    "Sensor",
    "Sweep",
    "Truth",
    "film",
    "load_scene",
    "load_sequence",
    "render",
    "render_folder",
    "render_parts",
    "save_scene",
    "save_sequence",
    "scenes",
    "truth_dict",
    "truth_of",
    "water_of_turbidity",
]
