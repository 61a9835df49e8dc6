"""One pose in one water, seen by one camera: as a ring of lights, and as printed plates of the same area."""

import math
from dataclasses import dataclass
from functools import cache

import cv2
import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.simulate import Pose, Scene
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.psf import FREQUENCIES, Psf, point_spread
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Background, Lights, Sensor
from dockpose.simulate.render import expose
from dockpose.simulate.scene import dock_rotation, truth_of
from dockpose.study import draw
from dockpose.study.draw import log_uniform

from tests.bench import lamps

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(diameter=0.30, lights=10)
SIDE_M = 0.30 * math.sqrt(math.pi) / 2  # of a square plate of the ring's area
RANGES = (2.0, 4.0, 8.0, 14.0, 20.0)  # in diameters
TURBIDITIES = (0.0, 0.6, 0.76, 0.86)
POSES = 7  # of each range in each water
LAMP_LEVELS, WHITE_LEVELS, BLACK_SHARE = 400.0, 220.0, 0.05  # to which each target is exposed; of black in white
FIXED, FIXED_FAR, AUTOMATIC = RULES = ("set at 2 diameters", "set at 8 diameters", "automatic")
NEAR, FAR = 2.0, 8.0  # diameters at which a fixed exposure is set, square on in the clearest water
LONGEST, MOST, MOST_WATER_LEVELS = 4.0, 16.0, 128.0  # automatic: shutter, with gain; of the water's own light
FINE = 3  # pixels of the drawing to one of the picture, each way
CELL_PX, TAG_ID = 40, 7  # of a print
INNER = 0.45  # of the printed ring's outer diameter, which is nine tenths of the plate's side
RING = "ring"


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


@cache
def prints() -> dict[str, np.ndarray]:
    """What is printed on each plate, 0 black and 1 white, with a white margin of one cell around a tag."""
    return {
        "aruco": _tag(cv2.aruco.DICT_4X4_50, 6),
        "apriltag": _tag(cv2.aruco.DICT_APRILTAG_36H11, 8),
        "whycon": _printed_ring(),
    }


def _tag(name: int, cells: int) -> np.ndarray:
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(name), TAG_ID, cells * CELL_PX)
    return np.pad(tag, CELL_PX, constant_values=255) / 255


def _printed_ring() -> np.ndarray:
    size = 10 * CELL_PX
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size - 0.5] * 2)
    away = np.hypot(x, y) / 0.45
    return ((away > 1) | (away < INNER)).astype(float)


def waters() -> list[str]:
    """The waters by how much light they take away on a metre."""
    return [_name(turbidity) for turbidity in TURBIDITIES]


def _name(turbidity: float) -> str:
    return f"c = {water_of_turbidity(turbidity).attenuation_per_m:.2f}"


def seen(seed: int, turbidity: float, range_diameters: float, number: int, plates: bool = True) -> dict[str, Seen]:
    """A pose in a water, for each rule of exposure: the same light on the same sensor."""
    rng = np.random.default_rng([seed, round(1000 * turbidity), round(range_diameters), number])
    z_m = range_diameters * DOCK.diameter
    # So that the plates' corners are within the picture too.
    reach = [max(0.0, side / 2 * z_m / CAMERA.fx - 0.75 * SIDE_M) for side in (640, 480)]
    position = np.array([*(rng.uniform(-each, each) for each in reach), z_m])
    tilt_rad, around_rad = math.radians(rng.uniform(0, 60)), rng.uniform(0, 2 * math.pi)
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=draw.tilted_pose(position, tilt_rad, around_rad, rng.uniform(0, 360)),
        lights=Lights(level=1.0, radius_m=0.006, brightness=tuple(rng.uniform(0.6, 1.0, 10).tolist())),
        water=water_of_turbidity(turbidity),
        background=Background(level=float(rng.uniform(5, 60))),
        sensor=_sensor(rng),
        seed=int(rng.integers(2**31)),
    )
    truth = truth_of(scene)
    images: dict[str, dict[str, np.ndarray]] = {rule: {} for rule in RULES}
    for target in (RING, *prints()) if plates else (RING,):
        light, factors = _light_and_factors(scene, target)
        for rule, factor in factors.items():
            images[rule][target] = _exposed(light, scene, factor, LONGEST if rule == AUTOMATIC else math.inf)
    about = _name(turbidity), range_diameters, truth.position_m, truth.normal, truth.lights_px
    return {rule: Seen(*about, images[rule]) for rule in RULES}


def _light_and_factors(scene: Scene, target: str) -> tuple[np.ndarray, dict[str, float]]:
    """Light (H, W) of water and target, in levels of the exposure set near by, and what each rule multiplies it by."""
    ambient, wanted = scene.background.level, LAMP_LEVELS if target == RING else WHITE_LEVELS
    near, far = (_reference(target, diameters, scene.sensor.blur_px) for diameters in (NEAR, FAR))
    excess = (wanted - ambient) / near  # of lamps or white over the water's own light
    light = ambient + (excess * _lamps(scene) if target == RING else _plate(scene, prints()[target], excess))
    automatic = min(wanted / float(light.max()), MOST, MOST_WATER_LEVELS / ambient)
    factors = {FIXED: 1.0, FIXED_FAR: wanted / (ambient + excess * far), AUTOMATIC: automatic}
    return light.astype(np.float32), factors


def _exposed(light: np.ndarray, scene: Scene, factor: float, longest: float) -> np.ndarray:
    """The picture by a longer shutter, which also blurs motion more, and beyond the longest by gain, noise and all."""
    shutter = min(factor, longest)
    blur_px = shutter * scene.sensor.motion_blur_px
    sensor = msgspec.structs.replace(scene.sensor, exposure=shutter, gain=factor / shutter, motion_blur_px=blur_px)
    return expose(light, msgspec.structs.replace(scene, sensor=sensor))


@cache
def _reference(target: str, diameters: float, blur_px: float) -> float:
    """The brightest that a target of unit power shows, square on in the clearest water and all of it lit."""
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(position_m=(0.0, 0.0, diameters * DOCK.diameter)),
        lights=Lights(level=1.0, radius_m=0.006),
        water=water_of_turbidity(TURBIDITIES[0]),
        background=Background(level=0.0),
        sensor=Sensor(blur_px=blur_px),
    )
    return float((_lamps(scene) if target == RING else _plate(scene, prints()[target], 1.0)).max())


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


def _lamps(scene: Scene) -> np.ndarray:
    """Light (H, W) of the ring's lamps: by the inverse square, spread by lens and water."""
    direct, glow = light_of(scene)
    return direct + glow


def _plate(scene: Scene, print_: np.ndarray, excess: float) -> np.ndarray:
    """What an evenly lit plate adds to the water's light: contrast, which comes directly and as glow (Duntley 1963)."""
    ambient = scene.background.level
    contrast = (BLACK_SHARE + (1 - BLACK_SHARE) * print_.astype(np.float32)) * (ambient + excess) - ambient
    size = len(print_)
    on_plate = np.array([[0, 0], [size, 0], [size, size], [0, size]], np.float32) - 0.5
    corners_m = SIDE_M * np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    corners_px = CAMERA.project(corners_m @ dock_rotation(scene).T + np.array(scene.pose.position_m))
    fine_px = ((corners_px + 0.5) * FINE - 0.5).astype(np.float32)
    to_picture = cv2.getPerspectiveTransform(on_plate, fine_px)
    fine = cv2.warpPerspective(contrast, to_picture, (640 * FINE, 480 * FINE), flags=cv2.INTER_AREA)
    light = cv2.resize(fine, (640, 480), interpolation=cv2.INTER_AREA)
    return _through(scene, light, float(np.linalg.norm(scene.pose.position_m)))


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
