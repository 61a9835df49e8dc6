"""Simulated pictures and sequences of a dock, with the truth beside them."""

from dockpose.simulate.files import load_scene
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Lights, Pose, Sensor
from dockpose.simulate.render import render
from dockpose.simulate.scene import Scene, Truth, truth_of
from dockpose.simulate.sequence import Approach, ClosedLoop, FilmPlan, Hover, RenderedFrame, Sweep, film

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
    "render",
    "truth_of",
    "water_of_turbidity",
]
