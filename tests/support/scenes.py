"""Scenes drawn at random, for tests that must hold for any of them."""

from pathlib import Path

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.simulate import Lights, Pose, Scene, Sensor
from dockpose.simulate.files import load_scene, save_scene
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background

CAMERA = Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480)
DOCK = Dock(diameter=0.30, lights=10)


def random_scene(seed: int, *, camera: Camera = CAMERA, dock: Dock = DOCK, **pose: object) -> Scene:
    """A dock wholly in view at 0.7 to 1.8 m, tilted up to 40 degrees, in water that lets its lights through."""
    rng = np.random.default_rng(seed)
    z_m = rng.uniform(0.7, 1.8)
    drawn = {
        "position_m": (rng.uniform(-0.15, 0.15) * z_m, rng.uniform(-0.1, 0.1) * z_m, z_m),
        "theta_x_deg": rng.uniform(-40, 40),
        "theta_y_deg": rng.uniform(-40, 40),
        "roll_deg": rng.uniform(0, 36),
    }
    return Scene(
        camera=camera,
        dock=dock,
        pose=Pose(**(drawn | pose)),  # pyright: ignore[reportArgumentType]
        lights=Lights(level=rng.uniform(400, 1500)),
        water=water_of_turbidity(rng.uniform(0, 0.7)),
        background=Background(level=rng.uniform(0, 40)),
        sensor=Sensor(read_noise_levels=rng.uniform(0, 2)),
        seed=seed,
    )


QUIET = Sensor(read_noise_levels=0.0, electrons_per_level=1e12)
DARK = Background(level=0.0)
PLAIN = Scene(camera=CAMERA, dock=DOCK, pose=Pose(position_m=(0.0, 0.0, 1.0)), sensor=QUIET, background=DARK)


def changed(**parts: object) -> Scene:
    """The dock square on 1 m ahead without noise or background, but for the given parts."""
    return msgspec.structs.replace(PLAIN, **parts)


def near(image: np.ndarray, point: object, reach: int = 3) -> np.ndarray:
    """The pixels around a point of the picture."""
    x, y = np.rint(np.asarray(point)).astype(int)
    return image[y - reach : y + reach + 1, x - reach : x + reach + 1]


def render_folder(folder: str | Path) -> list[str]:
    """Render every scene file NAME.yaml of a folder again; return their names."""
    paths = sorted(Path(folder).glob("*.yaml"))
    for path in paths:
        save_scene(load_scene(path), folder, path.stem)
    return [path.stem for path in paths]
