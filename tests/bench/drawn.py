"""The random scenes of the paper's comparison, for the benchmarks of thresholds and rings."""

from dockpose.paper.lights.scenes import DIAMETER_M, draw_scene

__all__ = ["DIAMETER_M", "draw_scene"]
