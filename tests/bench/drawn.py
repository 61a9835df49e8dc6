"""Scenes drawn at random for the benchmarks of thresholds and rings: a plain and a hard half."""

from __future__ import annotations

import msgspec
import numpy as np
from dockpose import Dock
from dockpose.simulate import Lights, Pose, Scene, Sensor, render_parts
from dockpose.simulate.optics.water import PRESETS
from dockpose.simulate.parts import Background, Mirror, Snow, Text

from tests.support.scenes import CAMERA

LIGHTS = 10
DOCK = Dock(diameter=0.30, lights=LIGHTS)


def draw_scene(seed: int, *, hard: bool) -> Scene:
    """A dock wholly in view, 0.6 to 3 m away, tilted up to 40 degrees, in one of the four waters.

    The camera exposes as a camera does: so that the brightest light comes out between 100 and 1000 grey levels, of
    which 255 can be stored. Ambient light reaches 50 levels, with a gradient; the lights are uneven.
    """
    rng = np.random.default_rng([seed, int(hard)])
    scene = _plain(rng, seed)
    if hard:
        scene = _with_trouble(scene, rng)
    rendering = render_parts(msgspec.structs.replace(scene, snow=None, texts=()))
    brightest = float((rendering.direct + rendering.glow).max())
    wanted = float(np.exp(rng.uniform(np.log(100), np.log(1000))))
    lights = msgspec.structs.replace(scene.lights, level=scene.lights.level * wanted / brightest)
    return msgspec.structs.replace(scene, lights=lights)


def _plain(rng: np.random.Generator, seed: int) -> Scene:
    z_m = float(rng.uniform(0.6, 3.0))
    tilt, around = np.radians(rng.uniform(0, 40)), rng.uniform(0, 2 * np.pi)
    normal = np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), -np.cos(tilt)])
    theta_x = float(np.degrees(np.arcsin(normal[1])))
    theta_y = float(np.degrees(np.arctan2(-normal[0], -normal[2])))
    reach_x, reach_y = 0.45 * z_m - 0.17, 0.34 * z_m - 0.17
    name = list(PRESETS)[rng.integers(len(PRESETS))]
    return Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(
            position_m=(float(rng.uniform(-reach_x, reach_x)), float(rng.uniform(-reach_y, reach_y)), z_m),
            theta_x_deg=theta_x,
            theta_y_deg=theta_y,
            roll_deg=float(rng.uniform(0, 36)),
        ),
        lights=Lights(
            radius_m=float(rng.uniform(0.002, 0.006)),
            beam_exponent=float(rng.uniform(0, 2)),
            brightness=tuple(rng.uniform(0.35, 1.0, LIGHTS).tolist()),
        ),
        water=PRESETS[name],
        background=Background(
            level=float(rng.uniform(0, 50)),
            gradient_x=float(rng.uniform(-30, 30)),
            gradient_y=float(rng.uniform(-30, 30)),
        ),
        sensor=Sensor(read_noise_levels=float(rng.uniform(0.5, 2.5)), blur_px=float(rng.uniform(0.6, 1.2))),
        seed=seed,
    )


def _with_trouble(scene: Scene, rng: np.random.Generator) -> Scene:
    missing = rng.choice(LIGHTS, rng.integers(0, 4), replace=False)
    texts = (
        Text(text="2026-11-20 15:24:59", x_px=float(rng.uniform(330, 400)), y_px=float(rng.uniform(8, 30))),
        Text(text="IPC 07", x_px=float(rng.uniform(8, 40)), y_px=float(rng.uniform(440, 460))),
    )
    height_m = float(rng.uniform(0.25, 0.6))
    return msgspec.structs.replace(
        scene,
        lights=msgspec.structs.replace(scene.lights, missing=tuple(int(number) for number in missing)),
        texts=texts[: rng.integers(0, 3)],
        mirror=Mirror(height_m=height_m, ripple_deg=float(rng.uniform(0, 1.5))) if rng.random() < 0.5 else None,
        snow=Snow(count=int(rng.integers(5, 60)), level=float(rng.uniform(20, 120))) if rng.random() < 0.6 else None,
        sensor=msgspec.structs.replace(
            scene.sensor, jpeg_quality=int(rng.integers(50, 96)) if rng.random() < 0.5 else None
        ),
    )
