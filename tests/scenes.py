"""Scenes drawn at random, for tests that must hold for any of them."""

from __future__ import annotations

import numpy as np

from pipeline import Camera, Dock
from pipeline.simulate import Scene

CAMERA = Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480)
DOCK = Dock(diameter=0.30, lights=10)


def random_scene(seed: int, **given: object) -> Scene:
    """A dock wholly in view at 0.7 to 1.8 m, tilted up to 40 degrees, in water that lets its lights through."""
    rng = np.random.default_rng(seed)
    z_m = rng.uniform(0.7, 1.8)
    attenuation = rng.uniform(0.1, 0.8)
    drawn = {
        "camera": CAMERA,
        "dock": DOCK,
        "position_m": (rng.uniform(-0.15, 0.15) * z_m, rng.uniform(-0.1, 0.1) * z_m, z_m),
        "theta_x_deg": rng.uniform(-40, 40),
        "theta_y_deg": rng.uniform(-40, 40),
        "roll_deg": rng.uniform(0, 36),
        "attenuation_per_m": attenuation,
        "scattered_per_m": 0.7 * attenuation,
        "light_level": rng.uniform(300, 1200),
        "background_level": rng.uniform(0, 40),
        "noise_levels": rng.uniform(0, 2.5),
        "seed": seed,
    }
    return Scene(**(drawn | given))  # pyright: ignore[reportArgumentType]
