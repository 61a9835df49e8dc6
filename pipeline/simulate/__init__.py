"""Simulated pictures and sequences of a dock, with the truth beside them."""

from dockpose.simulate.files import load_scene, load_sequence, save_scene, save_sequence
from dockpose.simulate.motion import Approach, ClosedLoop, Hover, Sweep
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Lights, Pose, Sensor
from dockpose.simulate.render import render
from dockpose.simulate.scene import Scene
from dockpose.simulate.sequence import FilmPlan, RenderedFrame, film
from dockpose.simulate.truth import Truth, truth_of

__all__ = [
    "Approach",
    "ClosedLoop",
    "FilmPlan",
    "Hover",
    "Lights",
    "Pose",
    "RenderedFrame",
    "Scene",
    "Sensor",
    "Sweep",
    "Truth",
    "film",
    "load_scene",
    "load_sequence",
    "render",
    "save_scene",
    "save_sequence",
    "truth_of",
    "water_of_turbidity",
]
