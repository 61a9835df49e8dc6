"""Every threshold method on one picture, and your own method among them."""

from pathlib import Path

import numpy as np
from dockpose import Settings, estimate, register_threshold
from dockpose.simulate import load_scene
from dockpose.thresholds import METHODS

samples = Path(__file__).parents[2] / "sample_images"


@register_threshold("bright_share", title="Brightest 0.2 %")
def bright_share(grey):
    return np.quantile(grey, 0.998)  # pixels at or above this level are kept


scene = load_scene(samples / "sunlit.yaml")
for method in METHODS:
    if method != "fixed":  # which needs a level
        found = estimate(samples / "sunlit.png", scene.camera, scene.dock, Settings(method=method))
        print(f"{method:12} {found.message}")
