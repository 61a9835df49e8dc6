"""What a picture shows besides lamps: water, panel, snow, things in front, burnt-in text."""

import math
from collections.abc import Sequence

import cv2
import numpy as np
from dockpose.simulate.optics.water import Water
from dockpose.simulate.parts import Background, Occluder, Panel, Text
from dockpose.simulate.scene import Scene
from dockpose.simulate.truth import dock_rotation, random_stream
from PIL import Image, ImageDraw, ImageFont

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
