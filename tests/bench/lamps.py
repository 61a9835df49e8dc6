"""Pictures of rings of lamps, drawn without the project's simulator: discs in linear light, halos, gamma, JPEG."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose import Camera, Dock

DIAMETER_M = 0.5
GAMMA = 2.2
# Share of a lamp's light in each halo, and the halo's standard deviation in lamp radii.
HALOS = ((0.05, 1.5), (0.02, 4.0), (0.01, 10.0))


@dataclass(frozen=True)
class Drawn:
    """A picture and what it shows."""

    image: np.ndarray  # (H, W) uint8
    camera: Camera
    dock: Dock
    lamps_px: np.ndarray  # (N, 2): centres of the lamps
    position_m: np.ndarray  # (3,): of the dock
    normal: np.ndarray

    @property
    def lit_share(self) -> float:
        """Share of the picture that is brighter than half way from its median to white."""
        return float((self.image > (np.median(self.image) + 255) / 2).mean())


def unit_normal(tilt_rad: float, around_rad: float) -> np.ndarray:
    """Normal of a dock's face that is turned by ``tilt_rad`` from facing the camera, towards ``around_rad``."""
    side = np.sin(tilt_rad)
    return np.array([side * np.cos(around_rad), side * np.sin(around_rad), -np.cos(tilt_rad)])


def ring_px(
    camera: Camera, lights: int, position_m: np.ndarray, normal: np.ndarray, phase_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Centres (N, 2) of the lamps in the picture, and their distances (N,)."""
    across = np.cross(normal, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    down = np.cross(normal, across)
    angles = phase_rad + 2 * np.pi * np.arange(lights) / lights
    points = position_m + DIAMETER_M / 2 * (np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * down)
    return np.array([camera.fx, camera.fy]) * points[:, :2] / points[:, 2:] + [camera.cx, camera.cy], points[:, 2]


def dock_px(camera: Camera, dock: Dock, position_m: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centres (N, 2) of a dock's lamps in the picture, and their distances (N,)."""
    angles = 2 * np.pi * np.arange(dock.lights or 0) / (dock.lights or 1)
    flat = dock.radius * np.array([np.cos(angles), np.sin(angles), 0 * angles])
    points = position_m + flat.T @ turn.T
    return np.array([camera.fx, camera.fy]) * points[:, :2] / points[:, 2:] + [camera.cx, camera.cy], points[:, 2]


def draw_lamps(
    size: tuple[int, int],
    lamps_px: np.ndarray,
    radii_px: np.ndarray,
    brightness: np.ndarray,
    rng: np.random.Generator,
    *,
    ambient: float | np.ndarray = 0.01,  # light of the water, linear, one number or (H, W)
    halos: tuple[tuple[float, float], ...] = HALOS,
    noise_levels: float = 1.5,
    jpeg_quality: int | None = 80,
    exposed: Callable[[np.ndarray], np.ndarray] | None = None,  # what the shutter makes of the light (H, W)
    over: np.ndarray | None = None,  # (H, W): grey levels written over the picture where they are above 0
) -> np.ndarray:
    """Draw lamps (N, 2), (N,), (N,) as a camera stores them, (H, W) uint8; of brightness 1 they are just white."""
    width, height = size
    light = np.zeros((height, width), np.float32)
    for (x, y), radius, value in zip(lamps_px, radii_px, brightness, strict=True):
        left, right = max(0, int(x - radius - 2)), min(width, int(x + radius + 3))
        top, bottom = max(0, int(y - radius - 2)), min(height, int(y + radius + 3))
        if left >= right or top >= bottom:
            continue
        rows, columns = np.mgrid[top:bottom, left:right]
        cover = np.clip(radius + 0.5 - np.hypot(columns - x, rows - y), 0, 1)
        light[top:bottom, left:right] = np.maximum(light[top:bottom, left:right], value * cover)
    shown = light.copy()
    for share, deviation in halos:
        shown += share * _blurred(light, deviation * float(np.mean(radii_px)))
    shown = cv2.GaussianBlur(shown, (0, 0), 0.7) + np.asarray(ambient, np.float32)
    shown = exposed(shown) if exposed else shown
    grey = 255 * np.clip(shown, 0, 1) ** (1 / GAMMA) + rng.normal(0, noise_levels, shown.shape)
    image = np.clip(np.rint(grey if over is None else np.where(over > 0, over, grey)), 0, 255).astype(np.uint8)
    if jpeg_quality is None:
        return image
    return as_jpeg(image, jpeg_quality)


def as_jpeg(image: np.ndarray, quality: int) -> np.ndarray:
    """A grey picture that was stored as JPEG."""
    decoded = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE)
    assert decoded is not None
    return decoded


def _blurred(light: np.ndarray, deviation: float) -> np.ndarray:
    """Light blurred by a Gaussian, by way of a smaller picture where that is wide; its peak keeps its place."""
    shrink = max(1, int(deviation / 4))
    height, width = light.shape
    small = cv2.resize(light, (max(1, width // shrink), max(1, height // shrink)), interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), deviation / shrink, borderType=cv2.BORDER_CONSTANT)
    return cv2.resize(small, (width, height))
