"""Rendering: from a scene to its picture."""

import math
from dataclasses import replace

import cv2
import numpy as np
from dockpose.camera.tone import encoded
from dockpose.simulate.emitters import Emitters, emitters_of
from dockpose.simulate.optics.glow import light_on_sensor
from dockpose.simulate.optics.water import BANDS, Water
from dockpose.simulate.parts import Sensor
from dockpose.simulate.scene import Scene
from dockpose.simulate.surroundings import add_snow, background_picture, burn_in, hide
from dockpose.simulate.truth import Truth, random_stream, truth_of


def render(scene: Scene) -> tuple[np.ndarray, Truth]:
    """Render the picture of a scene.

    Parameters
    ----------
    scene : Scene
        What to render. A dock that faces away or lies outside the picture leaves it without lights, which is valid.

    Returns
    -------
    image : (H, W) or (H, W, 3) BGR array, uint8 or uint16
        The picture; uint16 for more than 8 bits. The same scene gives the same bytes.
    truth : Truth
        What it shows.

    Raises
    ------
    ValueError
        If a lamp is farther away than the water's point spread function is valid.

    Examples
    --------
    >>> from dockpose import Camera, Dock
    >>> from dockpose.simulate import Pose
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> scene = Scene(camera=camera, dock=Dock(0.30, lights=10), pose=Pose(position_m=(0.0, 0.0, 1.5)))
    >>> image, truth = render(scene)
    >>> image.shape, image.dtype
    ((480, 640), dtype('uint8'))
    >>> int(truth.visible.sum())
    10
    """
    truth = truth_of(scene)
    emitters = emitters_of(scene, truth)
    if scene.sensor.colour == "grey":
        return expose(_band(scene, emitters, scene.water), scene), truth
    levels = emitters.levels[:, None] * emitters.colours
    bands = [
        _band(scene, replace(emitters, levels=seen), scene.water.in_band(name), share)
        for name, seen, share in zip(BANDS, levels.T, scene.background.colour, strict=True)
    ]
    return expose(np.dstack(bands), scene), truth


def _band(scene: Scene, emitters: Emitters, water: Water, background: float = 1.0) -> np.ndarray:
    """Light (H, W) on the sensor in one spectral band."""
    direct, glow = light_on_sensor(scene, emitters, water)
    light = background_picture(scene, water, background) + direct + glow
    add_snow(light, scene)
    hide(light, scene.occluders)
    return light


# The upper left corner of the mosaic, which OpenCV calls BG: a row of B G, then one of G R.
_MOSAIC = {(0, 0): 0, (0, 1): 1, (1, 0): 1, (1, 1): 2}


def expose(light: np.ndarray, scene: Scene) -> np.ndarray:
    """Turn light on the sensor, (H, W) or (H, W, 3), into the stored picture."""
    sensor = scene.sensor
    levels = light * np.float32(sensor.exposure)
    if sensor.vignetting > 0:
        levels *= _vignette(levels.shape[:2], sensor.vignetting)[(..., *[None] * (light.ndim - 2))]
    if sensor.motion_blur_px > 0:
        levels = cv2.filter2D(levels, -1, _streak(sensor), borderType=cv2.BORDER_REPLICATE)
    if sensor.colour == "bayer":
        levels = _mosaic(levels)
    levels = _with_noise(levels, sensor, random_stream(scene, "noise"))
    largest = (1 << sensor.bits) - 1
    if scene.camera.tone != "linear":
        levels = 255 * encoded(levels / 255, scene.camera.tone)
    stored = np.clip(np.rint(levels * (largest / 255)), 0, largest).astype(np.uint8 if sensor.bits == 8 else np.uint16)
    if sensor.colour == "bayer":
        stored = cv2.cvtColor(stored, cv2.COLOR_BayerRGGB2RGB)
    burn_in(stored, scene.texts, largest)
    if sensor.jpeg_quality is not None:
        jpeg = cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, sensor.jpeg_quality])[1]
        stored = np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_UNCHANGED))
    return stored


def _with_noise(levels: np.ndarray, sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Shot and read noise together; for hundreds of electrons per grey level, Poisson noise is practically Gaussian."""
    variance = np.maximum(levels, 0) / np.float32(sensor.electrons_per_level)
    variance += np.float32(sensor.read_noise_levels**2)
    noise = rng.standard_normal(levels.shape, dtype=np.float32)
    noise *= np.sqrt(variance, out=variance)
    noise += levels
    noise *= np.float32(sensor.gain)
    return noise


def _vignette(shape: tuple[int, int], lost: float) -> np.ndarray:
    height, width = shape
    x = (np.arange(width, dtype=np.float32) - (width - 1) / 2) / (width / 2)
    y = ((np.arange(height, dtype=np.float32) - (height - 1) / 2) / (height / 2))[:, None]
    return 1 - np.float32(lost) * (x**2 + y**2) / 2


def _streak(sensor: Sensor) -> np.ndarray:
    """Kernel of a straight motion: a line of that length, each of its points distributed among four pixels."""
    half = math.ceil(sensor.motion_blur_px / 2) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    angle = math.radians(sensor.motion_angle_deg)
    for along in np.linspace(-sensor.motion_blur_px / 2, sensor.motion_blur_px / 2, 8 * half + 1):
        x, y = half + along * math.cos(angle), half + along * math.sin(angle)
        column, row = int(x), int(y)
        kernel[row : row + 2, column : column + 2] += np.outer(
            [1 - (y - row), y - row], [1 - (x - column), x - column]
        )[: kernel.shape[0] - row, : kernel.shape[1] - column]
    return kernel / kernel.sum()


def _mosaic(levels: np.ndarray) -> np.ndarray:
    """Keep only the band that each pixel's filter lets through."""
    single = np.empty(levels.shape[:2], levels.dtype)
    for (row, column), band in _MOSAIC.items():
        single[row::2, column::2] = levels[row::2, column::2, band]
    return single
