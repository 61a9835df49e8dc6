"""Simulated pictures and sequences of a dock, with the truth beside them."""

from dockpose.simulate.files import load_scene
from dockpose.simulate.files import load_sequence as load_sequence
from dockpose.simulate.files import save_scene as save_scene
from dockpose.simulate.files import save_sequence as save_sequence
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Lights, Pose, Sensor
from dockpose.simulate.render import render
from dockpose.simulate.scene import Scene, Truth, truth_of
from dockpose.simulate.sequence import Approach, FilmPlan, film
from dockpose.simulate.sequence import ClosedLoop as ClosedLoop
from dockpose.simulate.sequence import Hover as Hover
from dockpose.simulate.sequence import RenderedFrame as RenderedFrame
from dockpose.simulate.sequence import Sweep as Sweep

__all__ = [
    "Approach",
    "FilmPlan",
    "Lights",
    "Pose",
    "Scene",
    "Sensor",
    "Truth",
    "film",
    "load_scene",
    "render",
    "truth_of",
    "water_of_turbidity",
]
