"""Scenes like those of the paper's photographs: a ring of ten lights in a tank, by the kind of its light and water."""

from __future__ import annotations

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.simulate import Lights, Pose, Scene, Sensor
from dockpose.simulate.optics.water import PRESETS
from dockpose.simulate.parts import Background, Glare, Mirror

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(0.30, 10)
FAINTEST = 0.25  # of the lights of the uneven ring, as a share of the brightest


def tank_scenes(seed: int) -> dict[str, Scene]:
    """Return five scenes by name, from an easy one to reflections; the seed is that of their noise."""
    plain = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(position_m=(0.06, -0.04, 1.1), theta_x_deg=6.0, theta_y_deg=-12.0, roll_deg=9.0),
        lights=Lights(level=300.0),
        seed=seed,
    )
    replace = msgspec.structs.replace
    return {
        "plain tank": plain,
        "uneven lighting": replace(
            plain,
            water=PRESETS["coastal"],
            lights=Lights(level=400.0, brightness=uneven(seed, 10)),
            background=Background(
                level=40, gradient_x=45, gradient_y=-20, glares=(Glare(x_px=540, y_px=90, size_px=100, level=90),)
            ),
        ),
        "glow in turbid water": replace(
            plain,
            pose=Pose(position_m=(0.03, 0.05, 1.3), theta_x_deg=-10.0, theta_y_deg=16.0, roll_deg=20.0),
            water=PRESETS["harbour"],
            lights=Lights(level=6000.0),
            background=Background(level=30, backscatter_level=20),
            sensor=Sensor(read_noise_levels=2.0),
        ),
        "strong ambient light": replace(
            plain,
            lights=Lights(level=300.0),
            background=Background(
                level=110, gradient_x=-40, gradient_y=-60, glares=(Glare(x_px=130, y_px=60, size_px=90, level=70),)
            ),
            sensor=Sensor(vignetting=0.3),
        ),
        "reflections": replace(
            plain,
            pose=Pose(position_m=(0.04, 0.14, 1.4), theta_x_deg=6.0, theta_y_deg=-12.0, roll_deg=9.0),
            lights=Lights(level=2500.0, beam_exponent=0.5),
            background=Background(level=16, gradient_y=-18),
            mirror=Mirror(height_m=0.1, ripple_deg=0.35),
        ),
    }


def near_ring(seed: int, missing: tuple[int, ...] = ()) -> Scene:
    """A ring of twelve uneven lights near by in a harbour's water, tilted by 31 degrees, some of them dead."""
    return Scene(
        camera=CAMERA,
        dock=Dock(0.30, 12),
        pose=Pose(position_m=(0.05, 0.02, 0.9), theta_x_deg=20.0, theta_y_deg=-25.0, roll_deg=5.0),
        lights=Lights(level=2500.0, brightness=uneven(seed, 12), missing=missing),
        water=PRESETS["harbour"],
        seed=seed,
    )


def uneven(seed: int, lights: int) -> tuple[float, ...]:
    """Brightness of each light: evenly from ``FAINTEST`` to 1, in random order."""
    order = np.random.default_rng([seed, *b"uneven"]).permutation(lights)
    return tuple(np.linspace(FAINTEST, 1.0, lights)[order].tolist())
