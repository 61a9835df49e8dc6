"""Docks and other lamps as they are met in tanks and at sea, a drawing a kind, each from its own random numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from dockpose import Camera, Dock

from tests.bench.lamps import DIAMETER_M, GAMMA, HALOS, draw_lamps, unit_normal

RADIUS_M = DIAMETER_M / 2
SIZES = ((640, 480), (1280, 720))
CLOSEST_PX = 7.0  # of neighbouring lamps


@dataclass(frozen=True)
class Shown:
    """A picture (H, W) uint8, what is told, and where the dock is; None where there is none."""

    image: np.ndarray
    camera: Camera
    dock: Dock
    position_m: np.ndarray | None = None
    normal: np.ndarray | None = None

    @property
    def truth(self) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) and normal (3,) to judge by; where there is no dock, one behind the camera."""
        if self.position_m is None or self.normal is None:
            return np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, -1.0])
        return self.position_m, self.normal


@dataclass
class Lamps:
    """Lamps in a picture before it is drawn."""

    camera: Camera
    points_px: np.ndarray  # (N, 2)
    radii_px: np.ndarray  # (N,)
    share: np.ndarray  # (N,) of the brightest one's light
    dock: Dock | None = None
    position_m: np.ndarray | None = None
    normal: np.ndarray | None = None
    points_m: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  # of the lamps, as the camera sees them

    def add(self, points_px: np.ndarray, radii_px: np.ndarray, share: np.ndarray) -> None:
        self.points_px = np.vstack([self.points_px, points_px])
        self.radii_px = np.concatenate([self.radii_px, radii_px])
        self.share = np.concatenate([self.share, share])


def camera_drawn(rng: np.random.Generator, focal: tuple[float, float] = (0.6, 1.6)) -> Camera:
    """A camera of either size, its focal length in widths of the picture."""
    width, height = SIZES[rng.integers(len(SIZES))]
    fx = width * float(np.exp(rng.uniform(*np.log(focal))))
    return Camera(fx, fx, (width - 1) / 2, (height - 1) / 2, width, height)


def circle(angles_rad: np.ndarray, radius_m: float = RADIUS_M) -> np.ndarray:
    """Points (N, 3) on a dock's rim, in its own frame."""
    return radius_m * np.column_stack([np.cos(angles_rad), np.sin(angles_rad), np.zeros(len(angles_rad))])


def even(lights: int) -> np.ndarray:
    return 2 * np.pi * np.arange(lights) / lights


def count(rng: np.random.Generator) -> int:
    return int(rng.integers(5, 13))


def seen_from(points_m: np.ndarray, position_m: np.ndarray, normal: np.ndarray, roll_rad: float) -> np.ndarray:
    """Points (N, 3) of a dock's frame in the camera's, for a dock whose face looks along ``normal``."""
    x = np.cross(normal, [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    y = np.cross(x, normal)
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    axes = np.array([c * x + s * y, c * y - s * x, -normal])
    return position_m + points_m @ axes


def on_picture(camera: Camera, points_m: np.ndarray) -> np.ndarray:
    """Where points (N, 3) are seen, (N, 2) in pixels, by a camera without distortion."""
    return camera.fx * points_m[:, :2] / points_m[:, 2:] + [camera.cx, camera.cy]


def closest_px(points_px: np.ndarray) -> float:
    apart = np.linalg.norm(points_px[:, None] - points_px, axis=2)
    return float((apart + 1e9 * np.eye(len(apart))).min())


def is_inside(camera: Camera, points_px: np.ndarray, edge_px: float) -> bool:
    return bool(((points_px > edge_px) & (points_px < [camera.width - edge_px, camera.height - edge_px])).all())


def dock_drawn(
    rng: np.random.Generator,
    points_m: np.ndarray,
    dock: Dock,
    *,
    share: tuple[float, float] = (0.14, 0.42),  # of its half axis in the picture's height
    diameters: float | None = None,  # its distance, instead
    focal: tuple[float, float] = (0.6, 1.6),
    tilt_deg: tuple[float, float] = (5, 40),
    lamp_px: float | None = None,  # radius of its lamps
    spacing_px: float = CLOSEST_PX,  # the least distance between them
) -> Lamps:
    """A dock wholly in view."""
    while True:
        camera = camera_drawn(rng, focal)
        height = camera.height
        z_m = (
            camera.fx * dock.radius / (rng.uniform(*share) * height)
            if diameters is None
            else diameters * 2 * dock.radius
        )
        normal = unit_normal(np.radians(rng.uniform(*tilt_deg)), rng.uniform(0, 2 * np.pi))
        middle_px = rng.uniform(0.1, 0.9, 2) * [camera.width, height]
        position = np.array([*((middle_px - [camera.cx, camera.cy]) * z_m / camera.fx), z_m])
        points = seen_from(points_m, position, normal, rng.uniform(0, 2 * np.pi))
        points_px = on_picture(camera, points)
        apart = closest_px(points_px)
        radius = lamp_px or float(np.clip(rng.uniform(0.12, 0.25) * apart, 1.3, 0.012 * camera.width))
        if apart >= max(spacing_px, 2.6 * radius) and is_inside(camera, points_px, 3 * radius + 6):
            radii = radius * z_m / points[:, 2]
            lit = rng.uniform(0.75, 1.0, len(points))
            return Lamps(camera, points_px, radii, lit, dock, position, normal, points)


def linear(grey: np.ndarray | float) -> np.ndarray:
    return (np.asarray(grey, float) / 255) ** GAMMA


def drawn(
    rng: np.random.Generator,
    lamps: Lamps,
    *,
    background: np.ndarray | float = 20.0,
    above: float | None = None,
    halos: Sequence[tuple[float, float]] = HALOS,
    noise: float = 1.5,
    jpeg: tuple[int, int] | None = (80, 96),
) -> Shown:
    """Draw lamps over a background in grey levels, ``above`` it by so many; without it far over white at times."""
    camera, dock = lamps.camera, lamps.dock
    ground = np.broadcast_to(np.asarray(background, float), (camera.height, camera.width))
    if above is None:
        light = np.exp(rng.uniform(np.log(0.6), np.log(6))) * lamps.share
    else:
        column, row = np.clip(np.rint(lamps.points_px).astype(int), 0, [camera.width - 1, camera.height - 1]).T
        light = linear(ground[row, column] + above * lamps.share) - linear(ground[row, column])
    image = draw_lamps(
        (camera.width, camera.height),
        lamps.points_px,
        lamps.radii_px,
        light,
        rng,
        ambient=linear(ground).astype(np.float32),
        halos=tuple(halos),
        noise_levels=noise,
        jpeg_quality=None if jpeg is None else int(rng.integers(*jpeg)),
    )
    return Shown(image, camera, dock or Dock(DIAMETER_M), lamps.position_m, lamps.normal)


def told(rng: np.random.Generator) -> tuple[np.ndarray, Dock]:
    """The lights of an even dock and the dock, its number told."""
    lights = count(rng)
    return circle(even(lights)), Dock(DIAMETER_M, lights)


def hazy(rng: np.random.Generator, above: tuple[float, float] = (3, 4.5)) -> Shown:
    """Twelve diameters away in haze: a bright veil, wide halos, lights so many times the noise above it."""
    lamps = dock_drawn(rng, *told(rng), diameters=12, focal=(0.8, 2.0))
    noise, veil = rng.uniform(3, 5), rng.uniform(80, 140)
    halos = ((0.8, 2.0), (1.0, 5.0))
    return drawn(
        rng, lamps, background=veil, above=noise * rng.uniform(*above), halos=halos, noise=noise, jpeg=(90, 98)
    )


def dark_haze(rng: np.random.Generator, above: tuple[float, float] = (3.5, 5)) -> Shown:
    """Fourteen diameters away in dark water, lights so many times the noise above it."""
    lamps = dock_drawn(rng, *told(rng), diameters=14, focal=(0.9, 2.2))
    noise, dark = rng.uniform(3, 6), rng.uniform(20, 40)
    halos = ((0.5, 2.0), (0.5, 5.0))
    return drawn(
        rng, lamps, background=dark, above=noise * rng.uniform(*above), halos=halos, noise=noise, jpeg=(90, 98)
    )


def on_a_slope(rng: np.random.Generator) -> Shown:
    """Lights 4 to 6 times the noise above water that grows brighter by 120 to 160 levels across the picture."""
    lamps = dock_drawn(rng, *told(rng))
    slope = ramp(rng, lamps.camera, rng.uniform(40, 60), rng.uniform(120, 160))
    noise = rng.uniform(3, 5)
    return drawn(rng, lamps, background=slope, above=noise * rng.uniform(4, 6), noise=noise)


def faint_on_a_slope(rng: np.random.Generator) -> Shown:
    """Lights 1.6 to 4.5 times the noise above water that grows brighter by 120 to 160 levels across the picture."""
    lamps = dock_drawn(rng, *told(rng))
    lamps.share = rng.uniform(5, 14, len(lamps.points_px)) / 14
    slope = ramp(rng, lamps.camera, rng.uniform(40, 60), rng.uniform(120, 160))
    return drawn(rng, lamps, background=slope, above=14, noise=3.1)


def noise_alone(rng: np.random.Generator) -> Shown:
    """Water with noise, and nothing else."""
    camera = camera_drawn(rng)
    levels = rng.normal(rng.uniform(30, 120), rng.uniform(2, 6), (camera.height, camera.width))
    return Shown(np.clip(np.rint(levels), 0, 255).astype(np.uint8), camera, Dock(DIAMETER_M, count(rng)))


def beside_a_copy(rng: np.random.Generator) -> Shown:
    """A dock, and a ring as far away to .3 % and .2 to .7 times as bright, as a wall of glass shows it."""
    points_m = circle(even(count(rng)))
    while True:
        lamps = dock_drawn(rng, points_m, Dock(DIAMETER_M, len(points_m)), share=(0.1, 0.2))
        camera = lamps.camera
        assert lamps.position_m is not None
        assert lamps.normal is not None
        ray = np.linalg.solve(camera.matrix, [*(rng.uniform(0.1, 0.9, 2) * [camera.width, camera.height]), 1.0])
        away_m = np.linalg.norm(lamps.position_m) * rng.uniform(0.997, 1.003)
        place_m = away_m * ray / np.linalg.norm(ray)
        copy_px = on_picture(camera, seen_from(points_m, place_m, lamps.normal, rng.uniform(0, 2 * np.pi)))
        middles_px = copy_px.mean(axis=0), lamps.points_px.mean(axis=0)
        is_apart = np.linalg.norm(middles_px[0] - middles_px[1]) > 1.25 * np.ptp(lamps.points_px, axis=0).max()
        if is_apart and is_inside(camera, copy_px, 10):
            lamps.add(copy_px, lamps.radii_px.copy(), rng.uniform(0.2, 0.7) * lamps.share)
            return drawn(rng, lamps, background=5.0)


def ramp(rng: np.random.Generator, camera: Camera, low: float, rise: float) -> np.ndarray:
    """Grey levels (H, W) that rise in a random direction."""
    y, x = np.mgrid[0 : camera.height, 0 : camera.width]
    angle = rng.uniform(0, 2 * np.pi)
    along = x * np.cos(angle) + y * np.sin(angle)
    return low + rise * (along - along.min()) / np.ptp(along)


def dim_discs(rng: np.random.Generator) -> Shown:
    """Discs 8 px across, 3 to 4.5 times the noise above the water."""
    return _discs(rng, 4.0)


def broad_discs(rng: np.random.Generator) -> Shown:
    """Discs 30 px across, 3 to 4.5 times the noise above the water."""
    return _discs(rng, 15.0)


def _discs(rng: np.random.Generator, radius_px: float) -> Shown:
    lamps = dock_drawn(rng, *told(rng), share=(0.2, 0.44), lamp_px=radius_px, tilt_deg=(5, 35))
    noise = rng.uniform(4, 6)
    ground = ramp(rng, lamps.camera, rng.uniform(15, 60), rng.uniform(0, 20))
    return drawn(rng, lamps, background=ground, above=noise * rng.uniform(3, 4.5), halos=(), noise=noise, jpeg=(90, 98))


def dark_enough_to_stretch(rng: np.random.Generator) -> Shown:
    """Lights 4 to 9 times the noise in a picture of at most 85 levels, so that three times these are still no white."""
    lamps = dock_drawn(rng, *told(rng))
    noise = rng.uniform(1.5, 3)
    shown = drawn(rng, lamps, background=rng.uniform(10, 15), above=noise * rng.uniform(4, 9), noise=noise, jpeg=None)
    return Shown(np.minimum(shown.image, 85), shown.camera, shown.dock, shown.position_m, shown.normal)


def in_glare(rng: np.random.Generator) -> Shown:
    """Lamps over white in halos so strong that they meet, each beside a glare of its own that a level takes with it."""
    lights = int(rng.integers(8, 13))
    lamps = dock_drawn(rng, circle(even(lights)), Dock(DIAMETER_M, lights), share=(0.2, 0.4), spacing_px=25)
    spacing, number = closest_px(lamps.points_px), len(lamps.points_px)
    lamps.radii_px = np.full(number, float(np.clip(0.1 * spacing, 2, 6)))
    level = float(rng.uniform(2, 6))
    away = rng.uniform(0, 2 * np.pi, number)
    off = lamps.radii_px * rng.uniform(1, 2.2, number)
    glare = lamps.points_px + off[:, None] * np.column_stack([np.cos(away), np.sin(away)])
    lamps.add(glare, lamps.radii_px * rng.uniform(1.2, 2.0, number), rng.uniform(0.1, 0.35, number) / level)
    lamps.share[:number] = rng.uniform(0.7, 1, number)
    halos = ((0.05, 1.5), (rng.uniform(0.1, 0.3), 3.0), (rng.uniform(0.1, 0.3), 6.0))
    ground = linear(rng.uniform(10, 40)).astype(np.float32)
    image = draw_lamps(
        (lamps.camera.width, lamps.camera.height),
        lamps.points_px,
        lamps.radii_px,
        level * lamps.share,
        rng,
        ambient=float(ground),
        halos=halos,
        noise_levels=1.5,
        jpeg_quality=int(rng.integers(80, 96)),
    )
    return Shown(image, lamps.camera, Dock(DIAMETER_M, lights), lamps.position_m, lamps.normal)


def spaced_by_eye(rng: np.random.Generator) -> Shown:
    """Lights on a true circle, each off even spacing by 3 to 5 % of the radius, to either side."""
    lights = count(rng)
    angles = even(lights) + rng.uniform(0.03, 0.05, lights) * rng.choice([-1, 1], lights)
    return drawn(rng, dock_drawn(rng, circle(angles), Dock(DIAMETER_M, lights), tilt_deg=(15, 45)))


def built_by_hand(rng: np.random.Generator) -> Shown:
    """Lights off their places in any direction, the worst by 3 to 5 % of the radius."""
    lights = count(rng)
    off = rng.uniform(0, 1, lights)
    off *= rng.uniform(0.03, 0.05) * RADIUS_M / off.max()
    towards = rng.uniform(0, 2 * np.pi, lights)
    points = circle(even(lights)) + off[:, None] * circle(towards, 1.0)
    return drawn(rng, dock_drawn(rng, points, Dock(DIAMETER_M, lights), tilt_deg=(15, 45)))


def learnt(offset_m: float) -> Callable[[np.random.Generator], Shown]:
    """A dock 0.30 m across that was learnt, its lights off their places by so much in each direction."""

    def draw(rng: np.random.Generator) -> Shown:
        lights = count(rng)
        offsets = rng.normal(0, offset_m, (lights, 3))
        dock = Dock(0.30, lights, offsets_m=offsets.tolist())
        return drawn(rng, dock_drawn(rng, dock.light_points(), dock))

    return draw
