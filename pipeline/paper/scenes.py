"""Scenes to compare methods on: drawn at random, a plain and a hard half, or like those of the paper's photographs."""

import tomllib
from pathlib import Path

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.simulate import Lights, Pose, Scene, Sensor
from dockpose.simulate.optics.water import PRESETS
from dockpose.simulate.parts import Mirror, Snow, Text
from dockpose.study.draw import Drawn, background, camera_of_size, log_uniform, tilted_pose

DIAMETER_M = 0.30
# Sizes of pictures, and how often they are drawn.
SIZES = {(640, 480): 0.65, (320, 240): 0.15, (1280, 720): 0.15, (1920, 1080): 0.04, (3840, 2160): 0.01}
FEWEST_LIGHTS, MOST_LIGHTS = 4, 24
LEAST_SPACING_PX = 8.0  # of lights around a ring that is seen square on


def draw_scenes(seed: int, a_half: int) -> list[Drawn]:
    """Draw ``a_half`` plain scenes, and then as many hard ones."""
    seeds = np.random.default_rng([seed, *b"random scenes"]).integers(2**31, size=(2, a_half))
    return [draw_scene(one, hard=hard) for hard in (False, True) for one in seeds[int(hard)].tolist()]


def draw_scene(seed: int, *, hard: bool) -> Drawn:
    """A dock wholly in view, as ``figure_15`` in static/parts.toml says."""
    rng = np.random.default_rng([seed, int(hard)])
    scene = _plain(rng, seed)
    if hard:
        scene = _with_trouble(scene, rng)
    return Drawn(scene, log_uniform(rng, 100, 1000))


def _plain(rng: np.random.Generator, seed: int) -> Scene:
    camera = camera_of_size(rng, SIZES)
    largest_px = min(0.27 * camera.width, 0.4 * camera.height)
    least_px = min(max(0.055 * camera.width, camera.fx * DIAMETER_M / 2 / 3), largest_px)
    radius_px = rng.uniform(least_px, largest_px)
    most = min(MOST_LIGHTS, int(2 * np.pi * radius_px / LEAST_SPACING_PX))
    lights = int(rng.integers(FEWEST_LIGHTS, most + 1))
    z_m = camera.fx * DIAMETER_M / 2 / radius_px
    tilt, around = np.radians(rng.uniform(0, 40)), rng.uniform(0, 2 * np.pi)
    reach = [max(0.0, 0.49 * side * z_m / camera.fx - 0.17) for side in (camera.width, camera.height)]
    water = PRESETS[list(PRESETS)[rng.integers(len(PRESETS))]]
    # Tilted off the line of sight to the picture's middle, and then moved aside.
    pose = tilted_pose(np.array([0.0, 0.0, z_m]), tilt, around, 0.0)
    x, y = (rng.uniform(-each, each) for each in reach)
    return Scene(
        camera=camera,
        dock=Dock(DIAMETER_M, lights),
        pose=msgspec.structs.replace(pose, position_m=(x, y, z_m), roll_deg=rng.uniform(0, 36)),
        lights=Lights(
            radius_m=rng.uniform(0.002, 0.006),
            beam_exponent=rng.uniform(0, 2),
            brightness=tuple(rng.uniform(0.35, 1.0, lights).tolist()),
        ),
        water=water,
        background=background(rng, 50, 30),
        sensor=Sensor(read_noise_levels=rng.uniform(0.5, 2.5), blur_px=rng.uniform(0.6, 1.2)),
        seed=seed,
    )


def _with_trouble(scene: Scene, rng: np.random.Generator) -> Scene:
    lights = scene.dock.lights or MOST_LIGHTS
    width, height = scene.camera.width, scene.camera.height
    missing = rng.choice(lights, rng.integers(0, min(4, (lights - FEWEST_LIGHTS) // 2 + 1)), replace=False)
    texts = (
        Text(text="2026-11-20 15:24:59", x_px=rng.uniform(0.52, 0.62) * width, y_px=rng.uniform(8, 30)),
        Text(text="IPC 07", x_px=rng.uniform(8, 40), y_px=height - rng.uniform(20, 40)),
    )
    height_m = rng.uniform(0.25, 0.6)
    return msgspec.structs.replace(
        scene,
        lights=msgspec.structs.replace(scene.lights, missing=tuple(missing.tolist())),
        texts=texts[: rng.integers(0, 3)],
        mirror=Mirror(height_m=height_m, ripple_deg=rng.uniform(0, 1.5)) if rng.random() < 0.5 else None,
        snow=Snow(count=int(rng.integers(5, 60)), level=rng.uniform(20, 120)) if rng.random() < 0.6 else None,
        sensor=msgspec.structs.replace(
            scene.sensor, jpeg_quality=int(rng.integers(50, 96)) if rng.random() < 0.5 else None
        ),
    )


CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
REPORT_SEED = 2016  # of the report on the paper, unless another is asked for
FAINTEST = 0.25  # of the lights of an uneven ring, as a share of the brightest


def tank_scenes(seed: int = REPORT_SEED) -> dict[str, Scene]:
    """Return five scenes by name, from an easy one to reflections; the seed is that of their noise."""
    described = tomllib.loads(Path(__file__).with_name("scenes.toml").read_text(encoding="utf-8"))
    plain, scenes = described["plain tank"], {}
    for name, own in described.items():
        parts = {"water": "tank", "seed": seed, "camera": CAMERA, "dock": Dock(DIAMETER_M, 10)} | plain | own
        if parts["lights"].get("brightness") == "uneven":
            parts["lights"]["brightness"] = uneven(seed, 10)
        scenes[name] = msgspec.convert(parts | {"water": PRESETS[parts["water"]]}, Scene)
    return scenes


def near_ring(seed: int, missing: tuple[int, ...] = ()) -> Scene:
    """A ring of twelve uneven lights near by in a harbour's water, tilted by 31 degrees, some of them dead."""
    return Scene(
        camera=CAMERA,
        dock=Dock(DIAMETER_M, 12),
        pose=Pose(position_m=(0.05, 0.02, 0.9), theta_x_deg=20.0, theta_y_deg=-25.0, roll_deg=5.0),
        lights=Lights(level=2500.0, brightness=uneven(seed, 12), missing=missing),
        water=PRESETS["harbour"],
        seed=seed,
    )


def uneven(seed: int, lights: int) -> tuple[float, ...]:
    """Brightness of each light: evenly from ``FAINTEST`` to 1, in random order."""
    order = np.random.default_rng([seed, *b"uneven"]).permutation(lights)
    return tuple(np.linspace(FAINTEST, 1.0, lights)[order].tolist())
