"""One pose in one water, seen by one camera: as a ring of lights, and as printed plates of the same area."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose import Camera, Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate import Pose, Scene
from dockpose.simulate.optics.psf import FREQUENCIES, Psf, point_spread
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background, Lights, Sensor
from dockpose.simulate.render import expose
from dockpose.study import draw
from dockpose.study.draw import log_uniform

from tests.bench import lamps

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(diameter=0.30, lights=10)
SIDE_M = 0.30 * math.sqrt(math.pi) / 2  # of a square plate of the ring's area
RANGES = (2.0, 4.0, 8.0, 14.0, 20.0)  # in diameters
TURBIDITIES = (0.0, 0.6, 0.76, 0.86)
POSES = 7  # of each range in each water
LIGHT_LEVELS, WHITE_LEVELS, BLACK_LEVELS = 400.0, 220.0, 12.0  # of a light at its peak, and of the plate from near by
FINE = 3  # pixels of the drawing to one of the picture, each way


@dataclass(frozen=True)
class Seen:
    """A pose, and what a camera in that water sees of each target."""

    water: str
    range_diameters: float
    position_m: np.ndarray  # (3,)
    normal: np.ndarray  # (3,)
    lights_px: np.ndarray  # (N, 2): where the ring's lights are
    images: dict[str, np.ndarray]  # by target
    camera: Camera = CAMERA
    dock: Dock = DOCK


def waters() -> list[str]:
    """The waters by how much light they take away on a metre."""
    return [_name(turbidity) for turbidity in TURBIDITIES]


def _name(turbidity: float) -> str:
    return f"c = {water_of_turbidity(turbidity).attenuation_per_m:.2f}"


def seen(seed: int, turbidity: float, range_diameters: float, number: int, prints: dict[str, np.ndarray]) -> Seen:
    """A pose in a water; ``prints`` are squares (n, n), 0 black and 1 white, of whole plates."""
    rng = np.random.default_rng([seed, round(1000 * turbidity), round(range_diameters), number])
    z_m = range_diameters * DOCK.diameter
    # So that the plates' corners are within the picture too.
    reach = [max(0.0, side / 2 * z_m / CAMERA.fx - 0.75 * SIDE_M) for side in (640, 480)]
    position = np.array([*(rng.uniform(-each, each) for each in reach), z_m])
    tilt_rad, around_rad = math.radians(rng.uniform(0, 60)), rng.uniform(0, 2 * math.pi)
    pose = draw.tilted_pose(position, tilt_rad, around_rad, rng.uniform(0, 360))
    brighter = log_uniform(rng, 0.5, 2.0)
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=pose,
        lights=Lights(radius_m=0.006, brightness=tuple(rng.uniform(0.6, 1.0, 10).tolist())),
        water=water_of_turbidity(turbidity),
        background=Background(level=float(rng.uniform(5, 60)) * brighter),
        sensor=_sensor(rng),
        seed=int(rng.integers(2**31)),
    )
    picture = draw.picture_of(draw.Drawn(scene, True, turbidity, LIGHT_LEVELS * brighter, 0))
    images = {"ring": picture.image}
    images |= {name: _plate(scene, pose, print_, brighter) for name, print_ in prints.items()}
    truth = picture.truth
    return Seen(_name(turbidity), range_diameters, truth.position_m, truth.normal, truth.lights_px, images)


def _sensor(rng: np.random.Generator) -> Sensor:
    """A sensor as the study draws them; one of five pictures is blurred by motion."""
    return Sensor(
        electrons_per_level=log_uniform(rng, 10, 100),
        read_noise_levels=log_uniform(rng, 0.5, 4.0),
        vignetting=float(rng.uniform(0, 0.4)),
        blur_px=float(rng.uniform(0.5, 1.2)),
        motion_blur_px=float(rng.uniform(1, 5)) if rng.random() < 0.2 else 0.0,
        motion_angle_deg=float(rng.uniform(0, 180)),
        jpeg_quality=int(rng.integers(50, 96)) if rng.random() < 0.35 else None,
    )


def _plate(scene: Scene, pose: Pose, print_: np.ndarray, brighter: float) -> np.ndarray:
    """A plate that is lit evenly: what of its contrast with the water arrives directly, and as glow (Duntley 1963)."""
    ambient = scene.background.level
    contrast = (BLACK_LEVELS + (WHITE_LEVELS - BLACK_LEVELS) * print_.astype(np.float32)) * brighter - ambient
    R = rotation_from_angles(
        math.radians(pose.theta_x_deg), math.radians(pose.theta_y_deg), math.radians(pose.roll_deg)
    )
    size = len(print_)
    on_plate = np.array([[0, 0], [size, 0], [size, size], [0, size]], np.float32) - 0.5
    corners_m = SIDE_M * np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    corners_px = CAMERA.project(corners_m @ R.T + np.array(pose.position_m))
    fine_px = ((corners_px + 0.5) * FINE - 0.5).astype(np.float32)
    to_picture = cv2.getPerspectiveTransform(on_plate, fine_px)
    fine = cv2.warpPerspective(contrast, to_picture, (640 * FINE, 480 * FINE), flags=cv2.INTER_AREA)
    light = cv2.resize(fine, (640, 480), interpolation=cv2.INTER_AREA)
    light = ambient + _through(scene, light, float(np.linalg.norm(pose.position_m)))
    return expose(light.astype(np.float32), scene)


def _through(scene: Scene, light: np.ndarray, distance_m: float) -> np.ndarray:
    """Light (H, W) of a plate as lens and water leave it of what would come through neither."""
    spread = point_spread(Psf(), scene.water, distance_m)
    height, width = 2 * light.shape[0], 2 * light.shape[1]  # so that nothing comes back from the other side
    across = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width))
    share = np.interp(across * scene.camera.fx, FREQUENCIES, spread.direct_share + spread.glow_transfer)
    share *= np.exp(-2 * (math.pi * scene.sensor.blur_px * across) ** 2)
    whole = np.fft.irfft2(np.fft.rfft2(light, (height, width)) * share, (height, width))
    return whole[: light.shape[0], : light.shape[1]]


def drawn_by_lamps(seed: int, range_diameters: float, number: int) -> Seen:
    """A ring of lights by the drawer that is not the simulator, in air."""
    rng = np.random.default_rng([seed, 7, round(range_diameters), number])
    dock = Dock(lamps.DIAMETER_M, 10)
    z_m = range_diameters * dock.diameter
    reach = [max(0.0, side / 2 - 0.8 * CAMERA.fx * dock.radius / z_m) * z_m / CAMERA.fx for side in (640, 480)]
    position = np.array([*(rng.uniform(-each, each) for each in reach), z_m])
    normal = draw.tilted_normal(draw.unit(position), math.radians(rng.uniform(0, 60)), rng.uniform(0, 2 * math.pi))
    lights_px, distances = lamps.ring_px(CAMERA, 10, position, normal, rng.uniform(0, 2 * math.pi))
    radii = np.maximum(0.01 * CAMERA.fx / distances, 0.8)
    noise = float(rng.uniform(0.5, 3))
    image = lamps.draw_lamps((640, 480), lights_px, radii, rng.uniform(0.5, 1.5, 10), rng, noise_levels=noise)
    # Its lamps are counted the other way around.
    return Seen("lamps.py", range_diameters, position, normal, lights_px[::-1], {"ring": image}, dock=dock)
