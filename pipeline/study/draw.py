"""Scenes of the study, each drawn at random in all its factors at once, with a camera that exposes as cameras do."""

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.circle import angles_of
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background, Lamp, Lights, Mirror, Pose, Sensor, Snow, Text
from dockpose.simulate.render import add_snow, background_picture, expose
from dockpose.simulate.scene import Scene, Truth, truth_of

# Sizes of pictures, and how often each is drawn; large ones are few for their cost.
SIZES = {(320, 240): 0.2, (640, 480): 0.42, (800, 600): 0.15, (1280, 720): 0.17, (1920, 1080): 0.06}
FEWEST_LIGHTS, MOST_LIGHTS = 4, 24
LEAST_RADIUS_PX, LARGEST_RADIUS = 10.0, 0.45  # of the ring square on; the largest in heights of the picture
LEAST_SPACING_PX = 5.0  # of neighbouring lights square on; closer ones no camera would tell apart
FARTHEST_M, MOST_LENGTHS = 15.0, 8.0  # range, and range in attenuation lengths, beyond which lamps are not seen
MOST_TILT_DEG, AWAY_DEG = 60.0, 120.0  # between the dock's normal and the line of sight; away: from there to 180
MOST_STRAYS = 10
NO_DOCK = 0.2  # share of the scenes
STREWN = 2 / 3  # share of those without a dock that have as many more lamps as the dock has lights
LIT_LEVELS = 25.0  # a pixel to which the lamps add a tenth of the scale is lit
_TEXTS = ("2026-11-20 15:24:59", "IPC 07", "DEPTH 3.2 m")


@dataclass(frozen=True)
class Drawn:
    """A scene that was drawn, of the study or of the report on the paper."""

    scene: Scene  # with its lamps as bright as the camera exposes them only after :func:`picture_of`
    brightest: float  # grey levels, before clipping, that the camera's exposure gives to the brightest light
    has_dock: bool = True  # whether a dock faces the camera
    turbidity: float = 0.0  # 0 for clear water to 1 for harbour water
    strays: int = 0  # lamps that are not lights of the dock


@dataclass(frozen=True)
class Picture:
    """A rendered scene."""

    image: np.ndarray  # (H, W)
    scene: Scene  # what it shows, with its lamps as bright as they are
    truth: Truth
    lit_share: float  # of the pixels, to which lamps add at least ``LIT_LEVELS``
    saturated_share: float  # of the pixels, by lamps and water


def draw(seed: int, index: int) -> Drawn:
    """Draw scene ``index`` of the study with a seed, as the page of a study says; it depends on nothing else."""
    rng = np.random.default_rng([seed, index])
    turbidity = rng.uniform()
    water = water_of_turbidity(turbidity)
    camera, dock, radius_px = _camera_and_dock(rng, min(FARTHEST_M, MOST_LENGTHS / water.attenuation_per_m))
    z_m = camera.fx * dock.radius / radius_px
    has_dock = bool(rng.random() >= NO_DOCK)
    tilt_deg = rng.uniform(0, MOST_TILT_DEG) if has_dock else rng.uniform(AWAY_DEG, 180)
    reach = [max(0.0, side / 2 - 0.8 * radius_px) * z_m / camera.fx for side in (camera.width, camera.height)]
    position = np.array([*(rng.uniform(-each, each) for each in reach), z_m])
    around = rng.uniform(0, 2 * math.pi)
    pose = tilted_pose(position, math.radians(tilt_deg), around, rng.uniform(0, 360))
    lights = _lights(rng, dock)
    strays = _count(rng, 1, MOST_STRAYS) if has_dock else int(rng.integers(1, MOST_STRAYS + 1))
    if not has_dock and rng.random() < STREWN:
        strays += dock.lights or 0
    scene = Scene(
        camera=camera,
        dock=dock,
        pose=pose,
        lights=lights,
        water=water,
        background=background(rng, 120, 60),
        snow=Snow(count=int(rng.integers(5, 61)), level=rng.uniform(20, 120)) if rng.random() < 0.4 else None,
        mirror=Mirror(height_m=z_m * rng.uniform(0.15, 0.5), ripple_deg=rng.uniform(0, 1.5))
        if rng.random() < 0.2
        else None,
        lamps=tuple(_stray(rng, camera, z_m, lights) for _ in range(strays)),
        texts=_texts(rng, camera) if rng.random() < 0.2 else (),
        sensor=_sensor(rng),
        seed=int(rng.integers(2**31)),
    )
    return Drawn(scene, log_uniform(rng, 100, 2000), has_dock, turbidity, strays)


def picture_of(drawn: Drawn) -> Picture:
    """Render a drawn scene once; the lamps' light is scaled to the exposure afterwards."""
    # The picture is that of :func:`dockpose.simulate.render` for the returned scene, but for rounding of its last bit.
    scene = drawn.scene
    light = np.add(*light_of(scene))
    brightest = float(light.max())
    factor = drawn.brightest / brightest if brightest > 0 else 1.0
    light *= np.float32(factor)
    scene = msgspec.structs.replace(
        scene,
        lights=msgspec.structs.replace(scene.lights, level=scene.lights.level * factor),
        lamps=tuple(msgspec.structs.replace(lamp, level=lamp.level * factor) for lamp in scene.lamps),
    )
    lit = float((light >= LIT_LEVELS).mean())
    light += background_picture(scene, scene.water)
    saturated = float((light >= 255).mean())
    add_snow(light, scene)
    return Picture(expose(light, scene), scene, truth_of(scene), lit, saturated)


def camera_of_size(rng: np.random.Generator, sizes: dict[tuple[int, int], float]) -> Camera:
    """A camera with one of some sizes of pictures, as often as each is wanted, and half to three widths of focus."""
    width, height = list(sizes)[rng.choice(len(sizes), p=list(sizes.values()))]
    focal_px = width * log_uniform(rng, 0.5, 3)
    return Camera(focal_px, focal_px, (width - 1) / 2, (height - 1) / 2, width, height)


def background(rng: np.random.Generator, most: float, gradient: float) -> Background:
    """Ambient light of up to so many levels with gradients of up to so many."""
    level, gradients = rng.uniform(0, most), rng.uniform(-gradient, gradient, 2).tolist()
    return Background(level=level, gradient_x=gradients[0], gradient_y=gradients[1])


def _camera_and_dock(rng: np.random.Generator, farthest_m: float) -> tuple[Camera, Dock, float]:
    """Camera, dock, and the radius of its ring in the picture; drawn again where the dock would be too far away."""
    while True:
        camera = camera_of_size(rng, SIZES)
        dock = Dock(log_uniform(rng, 0.2, 0.8), int(rng.integers(FEWEST_LIGHTS, MOST_LIGHTS + 1)))
        spaced_px = LEAST_SPACING_PX * (dock.lights or 0) / (2 * math.pi)
        radius_px = log_uniform(rng, max(LEAST_RADIUS_PX, spaced_px), LARGEST_RADIUS * camera.height)
        if camera.fx * dock.radius / radius_px <= farthest_m:
            return camera, dock, radius_px


def tilted_pose(position_m: np.ndarray, tilt_rad: float, around_rad: float, roll_deg: float) -> Pose:
    """A pose at (3,) whose normal is tilted off the line of sight, which is what a camera sees of it, to some side."""
    theta_x, theta_y = map(math.degrees, angles_of(tilted_normal(unit(position_m), tilt_rad, around_rad)))
    x, y, z = position_m.tolist()
    return Pose(position_m=(x, y, z), theta_x_deg=theta_x, theta_y_deg=theta_y, roll_deg=roll_deg)


def tilted_normal(sight: np.ndarray, tilt_rad: float, around_rad: float) -> np.ndarray:
    """The normal (3,) of a dock that is seen along a unit vector (3,)."""
    right = unit(np.cross([0.0, 1.0, 0.0], sight))
    side = math.cos(around_rad) * right + math.sin(around_rad) * np.cross(sight, right)
    return math.sin(tilt_rad) * side - math.cos(tilt_rad) * sight


def unit(vector: np.ndarray) -> np.ndarray:
    """The vector with a length of 1."""
    return vector / np.linalg.norm(vector)


def _lights(rng: np.random.Generator, dock: Dock) -> Lights:
    number = dock.lights or 0
    spacing_m = 2 * math.pi * dock.radius / number
    dead = rng.choice(number, _count(rng, 0, number // 3), replace=False)
    return Lights(
        radius_m=min(log_uniform(rng, 0.03, 0.4) * spacing_m, 0.25 * dock.radius),
        beam_exponent=rng.uniform(0, 2),
        brightness=tuple(rng.uniform(0.35, 1.0, number).tolist()),
        missing=tuple(sorted(dead.tolist())),
    )


def _stray(rng: np.random.Generator, camera: Camera, z_m: float, lights: Lights) -> Lamp:
    depth_m = z_m * rng.uniform(0.5, 1.5)
    x = (rng.uniform(0, camera.width - 1) - camera.cx) / camera.fx * depth_m
    y = (rng.uniform(0, camera.height - 1) - camera.cy) / camera.fy * depth_m
    return Lamp(position_m=(x, y, depth_m), level=lights.level * rng.uniform(0.2, 1.5), radius_m=lights.radius_m)


def _texts(rng: np.random.Generator, camera: Camera) -> tuple[Text, ...]:
    x, y = rng.uniform(0, 0.6) * camera.width, rng.uniform(0, 1) * (camera.height - 20)
    return (Text(text=_TEXTS[rng.integers(len(_TEXTS))], x_px=x, y_px=y),)


def _sensor(rng: np.random.Generator) -> Sensor:
    return Sensor(
        electrons_per_level=log_uniform(rng, 10, 100),
        read_noise_levels=log_uniform(rng, 0.5, 6),
        vignetting=rng.uniform(0, 0.4),
        blur_px=rng.uniform(0.5, 1.5),
        motion_blur_px=rng.uniform(1, 5) if rng.random() < 0.15 else 0.0,
        motion_angle_deg=rng.uniform(0, 180),
        jpeg_quality=int(rng.integers(40, 96)) if rng.random() < 0.35 else None,
    )


def _count(rng: np.random.Generator, least: int, most: int) -> int:
    """0 in half of the scenes, otherwise anything within the limits."""
    return int(rng.integers(least, most + 1)) if rng.random() < 0.5 else 0


def log_uniform(rng: np.random.Generator, least: float, most: float) -> float:
    """A number drawn uniformly in its logarithm."""
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))
