"""Rendering: from a scene to its picture, with all that it shows besides lamps: water, panel, snow, bars, text."""

import math
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from dockpose.camera.tone import encoded
from dockpose.simulate.emitters import Emitters, emitters_of
from dockpose.simulate.optics.glow import light_on_sensor
from dockpose.simulate.optics.water import BANDS, Water
from dockpose.simulate.parts import Background, Occluder, Panel, Sensor, Text
from dockpose.simulate.scene import Scene, Truth, dock_rotation, random_stream, truth_of
from PIL import Image, ImageDraw, ImageFont


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


def expose(light: np.ndarray, scene: Scene) -> np.ndarray:
    """Turn light on the sensor, (H, W) or (H, W, 3), into the stored picture."""
    sensor = scene.sensor
    levels = light * np.float32(sensor.exposure)
    if sensor.vignetting > 0:
        levels *= _vignette(levels.shape[:2], sensor.vignetting)[(..., *[None] * (light.ndim - 2))]
    if sensor.mean_level is not None:
        levels *= np.float32(_automatic(levels * np.float32(sensor.gain), sensor.mean_level))
    if sensor.motion_blur_px > 0:
        levels = cv2.filter2D(levels, -1, _streak(sensor), borderType=cv2.BORDER_REPLICATE)
    if sensor.colour == "bayer":
        # Each pixel's filter lets one band through; the upper left corner, which OpenCV calls BG, is B G above G R.
        single = np.empty(levels.shape[:2], levels.dtype)
        for (row, column), band in {(0, 0): 0, (0, 1): 1, (1, 0): 1, (1, 1): 2}.items():
            single[row::2, column::2] = levels[row::2, column::2, band]
        levels = single
    levels = _with_noise(levels, sensor, random_stream(scene, "noise"))
    largest = (1 << sensor.bits) - 1
    if scene.camera.tone != "linear":
        levels = 255 * encoded(levels / 255, scene.camera.tone)
    if sensor.sharpening > 0:
        levels = np.clip(levels, 0, 255)  # a camera sharpens what it has stored
        levels += sensor.sharpening * (levels - cv2.GaussianBlur(levels, (0, 0), sensor.sharpening_px))
    stored = np.clip(np.rint(levels * (largest / 255)), 0, largest).astype(np.uint8 if sensor.bits == 8 else np.uint16)
    if sensor.colour == "bayer":
        stored = cv2.cvtColor(stored, cv2.COLOR_BayerRGGB2RGB)
    burn_in(stored, scene.texts, largest)
    if sensor.jpeg_quality is not None:
        jpeg = cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, sensor.jpeg_quality])[1]
        stored = np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_UNCHANGED))
    return stored


def _automatic(levels: np.ndarray, mean_level: float) -> float:
    """Factor on the exposure that brings the mean of the picture, white where it is brighter, to a level."""
    low, high = -_STOPS, _STOPS
    for _ in range(_HALVED):
        middle = (low + high) / 2
        if np.minimum(levels * np.float32(2**middle), 255).mean() < mean_level:
            low = middle
        else:
            high = middle
    return 2 ** ((low + high) / 2)


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


_STOPS, _HALVED = 6.0, 14  # factors of two that automatic exposure has to either side; halvings of their range
_EDGE_POINTS = 16  # to a side, since a lens bends it
_VEIL_SIZE = 0.45  # of the picture's width: standard deviation of the vehicle's own light


def background_picture(scene: Scene, water: Water, share: float = 1.0) -> np.ndarray:
    """Water and panel, (H, W) float32 grey levels before exposure; ``share`` is the band's response to the water."""
    picture = np.float32(share) * _water(scene.background, scene, water)
    if scene.panel is not None:
        outline = _panel_outline(scene, scene.panel)
        if outline is not None:
            _cover(picture, outline, scene.panel.level)
    return np.maximum(picture, 0)


def _water(background: Background, scene: Scene, water: Water) -> np.ndarray:
    height, width = scene.camera.height, scene.camera.width
    x, y = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)[:, None]
    across, down = (x + 0.5) / width - 0.5, (y + 0.5) / height - 0.5
    picture = background.level + background.gradient_x * across + background.gradient_y * down
    if background.backscatter_level > 0:
        # Single scattering of a lamp beside the camera, integrated along the line of sight as far as the dock.
        depth = 1 - math.exp(-2 * water.attenuation_per_m * scene.pose.position_m[2])
        reach = (across**2 + (down * height / width) ** 2) / (2 * _VEIL_SIZE**2)
        picture = picture + background.backscatter_level * depth * np.exp(-reach)
    for glare in background.glares:
        size = max(glare.size_px, 0.5)
        picture = picture + glare.level * np.exp(-((x - glare.x_px) ** 2 + (y - glare.y_px) ** 2) / (2 * size**2))
    return picture.astype(np.float32)


def _panel_outline(scene: Scene, panel: Panel) -> np.ndarray | None:
    """Outline of the panel in the picture, its edges subdivided because a lens bends them; None behind the camera."""
    half = panel.size_m / 2
    side = np.linspace(-half, half, _EDGE_POINTS, endpoint=False)
    end = np.full_like(side, half)
    corners = np.vstack([np.column_stack(pair) for pair in ((side, -end), (end, side), (-side, end), (-end, -side))])
    in_dock = np.column_stack([corners, np.zeros(len(corners))])
    outline = scene.camera.project(np.array(scene.pose.position_m) + in_dock @ dock_rotation(scene).T)
    return outline if np.isfinite(outline).all() else None


def add_snow(picture: np.ndarray, scene: Scene) -> None:
    """Add marine snow: most particles small and dim, a few large, near and out of focus."""
    if scene.snow is None or scene.snow.count == 0:
        return
    rng = random_stream(scene, "snow")
    height, width = picture.shape
    for _ in range(scene.snow.count):
        x, y = rng.uniform(-0.5, width - 0.5), rng.uniform(-0.5, height - 0.5)
        size = scene.snow.size_px * rng.uniform(0.6, 1.4) * (4 if rng.random() < 0.05 else 1)
        peak = scene.snow.level * rng.exponential(0.4) / (8 if size > 2 * scene.snow.size_px else 1)
        _add_spot(picture, x, y, size, min(peak, 2 * scene.snow.level))


def hide(picture: np.ndarray, occluders: Sequence[Occluder]) -> None:
    """Draw the bars that hide whatever is behind them."""
    for bar in occluders:
        box = ((bar.x_px, bar.y_px), (bar.width_px, bar.height_px), bar.angle_deg)
        _cover(picture, cv2.boxPoints(box), bar.level)


def burn_in(picture: np.ndarray, texts: Sequence[Text], largest: int) -> None:
    """Write text in Pillow's bitmap font over the finished (H, W) or (H, W, 3) picture; 255 maps to ``largest``."""
    for text in texts:
        if not text.text:
            continue
        mask = _letters(text)
        top, left = round(text.y_px), round(text.x_px)
        rows = slice(max(0, top), min(picture.shape[0], top + mask.shape[0]))
        columns = slice(max(0, left), min(picture.shape[1], left + mask.shape[1]))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            continue
        cover = mask[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        cover = cover if picture.ndim == 2 else cover[:, :, None]
        level = min(text.level, 255.0) / 255 * largest
        picture[rows, columns] = np.rint(picture[rows, columns] * (1 - cover) + level * cover).astype(picture.dtype)


def _letters(text: Text) -> np.ndarray:
    """Coverage, 0 to 1, of the letters at the requested height."""
    font = ImageFont.load_default_imagefont()
    left, top, right, bottom = (math.floor(value) for value in font.getbbox(text.text))
    canvas = Image.new("L", (max(1, right - left), max(1, bottom - top)), 0)
    ImageDraw.Draw(canvas).text((-left, -top), text.text, fill=255, font=font)
    scale = max(text.height_px, 1.0) / canvas.height
    size = (max(1, round(canvas.width * scale)), max(1, round(canvas.height * scale)))
    return np.asarray(canvas.resize(size, Image.Resampling.BILINEAR), dtype=float) / 255


def _cover(picture: np.ndarray, outline_px: np.ndarray, level: float) -> None:
    """Fill an outline, which need not be convex, with a level; its edge is softened over a pixel."""
    mask = np.zeros(picture.shape, np.uint8)
    fixed = np.rint(np.clip(outline_px, -1e5, 1e5) * 16).astype(np.int32)
    cv2.fillPoly(mask, [fixed], 255, cv2.LINE_AA, shift=4)
    share = mask.astype(np.float32) / 255
    picture *= 1 - share
    picture += level * share


def _add_spot(picture: np.ndarray, x: float, y: float, size: float, peak: float) -> None:
    reach = math.ceil(4 * size)
    column, row = round(x), round(y)
    rows = np.arange(max(0, row - reach), min(picture.shape[0], row + reach + 1))
    columns = np.arange(max(0, column - reach), min(picture.shape[1], column + reach + 1))
    down, across = np.exp(-((rows - y) ** 2) / (2 * size**2)), np.exp(-((columns - x) ** 2) / (2 * size**2))
    picture[np.ix_(rows, columns)] += peak * np.outer(down, across)
