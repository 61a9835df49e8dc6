"""Simulated pictures of a dock, with the truth beside them."""

from pipeline.simulate.render import render
from pipeline.simulate.scene import Scene, Truth, truth_of

__all__ = ["Scene", "Truth", "render", "truth_of"]
