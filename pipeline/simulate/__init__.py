"""Simulated pictures of a dock, with the truth beside them."""

from pipeline.simulate.files import load_scene, render_folder, save_scene
from pipeline.simulate.render import render
from pipeline.simulate.scene import Scene, Truth, truth_dict, truth_of

__all__ = ["Scene", "Truth", "load_scene", "render", "render_folder", "save_scene", "truth_dict", "truth_of"]
