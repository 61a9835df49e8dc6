"""Docks beside their mirror images and other lamps, and lamps that are no dock, a drawing a kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from dockpose import Camera, Dock

from tests.bench.lamps import DIAMETER_M, unit_normal
from tests.bench.seen_scenes import (
    CLOSEST_PX,
    RADIUS_M,
    Lamps,
    Shown,
    camera_drawn,
    circle,
    closest_px,
    dock_drawn,
    drawn,
    even,
    is_inside,
    on_picture,
    ramp,
    seen_from,
    told,
)

_FIXED = Camera(700.0, 700.0, 319.5, 239.5, 640, 480)


def mirrored(
    towards: tuple[float, float, float], bright: tuple[float, float], soft: bool = False
) -> Callable[[np.random.Generator], Shown]:
    """A dock and its image, so bright, in a mirror that stands towards (x, y, z) or (-x, y, z), both in view, apart."""

    def draw(rng: np.random.Generator) -> Shown:
        while True:
            lamps = dock_drawn(rng, *told(rng), share=(0.1, 0.25), focal=(0.5, 1.0))
            assert lamps.position_m is not None
            facing = np.array(towards) * [rng.choice([-1, 1]), 1, 1] + rng.normal(0, 0.1, 3)
            facing /= np.linalg.norm(facing)
            distance_m = float((lamps.points_m @ facing).max() + rng.uniform(0.05, 1.0))
            behind = distance_m - lamps.points_m @ facing
            image_m = lamps.points_m + 2 * behind[:, None] * facing
            centre_m = lamps.position_m + 2 * (distance_m - lamps.position_m @ facing) * facing
            farther = np.linalg.norm(centre_m) / np.linalg.norm(lamps.position_m)
            if distance_m < 0.15 or (image_m[:, 2] < 0.5).any() or farther < 1.04:
                continue
            image_px = on_picture(lamps.camera, image_m)
            radii = lamps.radii_px * lamps.points_m[:, 2] / image_m[:, 2] * (1.5 if soft else 1.0)
            apart = np.linalg.norm(image_px[:, None] - lamps.points_px, axis=2).min()
            if is_inside(lamps.camera, image_px, 10) and min(apart, closest_px(image_px)) > CLOSEST_PX:
                lamps.add(image_px, np.maximum(radii, 1.2), lamps.share * rng.uniform(*bright))
                return drawn(rng, lamps, noise=rng.uniform(0.5, 2))

    return draw


def with_every_second_inside(rng: np.random.Generator) -> Shown:
    """A ring, up to two lights out, around a brighter one of half as many lamps: every second of a ring farther."""
    lights = int(rng.choice([12, 16, 20, 24]))
    lit = rng.permutation(lights)[rng.integers(3) :]
    inner = circle(even(lights // 2) + rng.uniform(0, np.pi), RADIUS_M * rng.uniform(0.4, 0.65))
    points = np.vstack([circle(even(lights)[lit]), inner])
    lamps = dock_drawn(rng, points, Dock(DIAMETER_M, lights), share=(0.3, 0.44), tilt_deg=(5, 30))
    lamps.share[: len(lit)] *= np.exp(rng.uniform(np.log(0.02), np.log(0.5)))
    return drawn(rng, lamps)


def with_lamps_on_its_rim(rng: np.random.Generator) -> Shown:
    """Seven lights of eight, and two lamps of others between them on the rim."""
    gaps = rng.choice(8, 2, replace=False)
    others = even(8)[gaps] + np.radians(rng.uniform(12, 33, 2))
    angles = np.concatenate([np.delete(even(8), rng.integers(8)), others])
    return drawn(rng, dock_drawn(rng, circle(angles), Dock(DIAMETER_M, 8)))


def with_strays(rng: np.random.Generator, lamps: Lamps, number: int) -> Lamps:
    """Lamps of others beside the dock's, as large and bright, anywhere in the picture but on another lamp."""
    for _ in range(number):
        stray = lamps.points_px[0]
        while np.linalg.norm(lamps.points_px - stray, axis=1).min() < 4 * lamps.radii_px.max() + CLOSEST_PX:
            stray = rng.uniform(0.03, 0.97, 2) * [lamps.camera.width, lamps.camera.height]
        lamps.add(stray[None], lamps.radii_px[:1], lamps.share[:1])
    return lamps


def four_and_a_stray(rng: np.random.Generator) -> Shown:
    """Four lights off their places by a hundredth of the radius, and a lamp."""
    points = circle(even(4)) + rng.normal(0, 0.01 * RADIUS_M, (4, 3)) * [1, 1, 0]
    return drawn(rng, with_strays(rng, dock_drawn(rng, points, Dock(DIAMETER_M, 4)), 1))


def four_of_unknown_number(rng: np.random.Generator) -> Shown:
    return drawn(rng, dock_drawn(rng, circle(even(4)), Dock(DIAMETER_M)))


def many(number_told: bool) -> Callable[[np.random.Generator], Shown]:
    """A ring of 32, 48 or 60 lights, one or two of them out, and three other lamps."""

    def draw(rng: np.random.Generator) -> Shown:
        lights = int(rng.choice([32, 48, 60]))
        dock = Dock(DIAMETER_M, lights if number_told else None)
        points = circle(even(lights)[rng.permutation(lights)[rng.integers(1, 3) :]])
        lamps = dock_drawn(rng, points, dock, share=(0.3, 0.44), tilt_deg=(5, 30))
        return drawn(rng, with_strays(rng, lamps, 3))

    return draw


def string_of_lamps(number_told: bool) -> Callable[[np.random.Generator], Shown]:
    """A bent cable with 10 to 30 lamps, evenly spaced but for some hundredths."""

    def draw(rng: np.random.Generator) -> Shown:
        camera, number = camera_drawn(rng), int(rng.integers(10, 31))
        while True:
            step = rng.uniform(0.02, 0.06) * camera.width
            along = np.cumsum(step * rng.normal(1, 0.03, number))
            bends = rng.uniform(0.2, 1.5, 3) * np.sin(
                np.outer(along / camera.width, rng.uniform(1, 9, 3)) + rng.uniform(0, 6.3, 3)
            )
            heading = rng.uniform(0, 2 * np.pi) + bends.sum(axis=1)
            points = np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
            points += rng.uniform(0.1, 0.9, 2) * [camera.width, camera.height] - points.mean(axis=0)
            if is_inside(camera, points, 12) and closest_px(points) > CLOSEST_PX:
                break
        radii = np.full(number, max(1.3, rng.uniform(0.1, 0.2) * step))
        lamps = Lamps(camera, points, radii, rng.uniform(0.75, 1, number))
        lamps.dock = Dock(DIAMETER_M, int(rng.integers(4, 25)) if number_told else None)
        return drawn(rng, lamps)

    return draw


def specks(rng: np.random.Generator) -> Shown:
    """Small specks as on coral: on ovals at a steep tilt, a tenth to a quarter of their spacing off, and strewn."""
    camera = camera_drawn(rng)
    size = np.array([camera.width, camera.height])
    parts = [rng.uniform(0.05, 0.95, (5, 2)) * size]
    for _ in range(rng.integers(2, 6)):
        number = int(rng.integers(6, 13))
        angles = even(number) + rng.normal(0, rng.uniform(0.1, 0.25), number) * 2 * np.pi / number
        oval = circle(angles, rng.uniform(0.02, 0.08) * camera.width)[:, :2] * [1.0, rng.uniform(0.2, 0.5)]
        turn = rng.uniform(0, np.pi)
        across = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        parts.append(rng.uniform(0.15, 0.85, 2) * size + (oval * rng.normal(1, 0.08, (number, 1))) @ across)
    points = np.vstack(parts)
    points = points[((points > 5) & (points < size - 5)).all(axis=1)]
    lamps = Lamps(camera, points, rng.uniform(0.7, 1.6, len(points)), rng.uniform(0.3, 1.0, len(points)))
    lamps.dock = Dock(DIAMETER_M, int(rng.integers(5, 13)))
    return drawn(rng, lamps, background=ramp(rng, camera, 20, rng.uniform(0, 40)), above=rng.uniform(100, 200))


def short_arc(rng: np.random.Generator) -> Shown:
    """From 5 to 8 lamps along 40 to 90 degrees of a circle, and a number told that they need not fit."""
    camera, number = camera_drawn(rng), int(rng.integers(5, 9))
    while True:
        radius = rng.uniform(0.3, 0.9) * camera.height
        angles = rng.uniform(0, 2 * np.pi) + np.radians(np.linspace(0, rng.uniform(40, 90), number))
        points = circle(angles, radius)[:, :2] * [1.0, rng.uniform(0.6, 1.0)]
        points += rng.uniform(0.1, 0.9, 2) * [camera.width, camera.height] - points.mean(axis=0)
        if is_inside(camera, points, 12) and closest_px(points) > CLOSEST_PX:
            break
    radii = np.full(number, max(1.3, 0.15 * closest_px(points)))
    lamps = Lamps(camera, points, radii, rng.uniform(0.75, 1, number), Dock(DIAMETER_M, int(rng.integers(6, 25))))
    return drawn(rng, lamps)


def nothing(_rng: np.random.Generator) -> Shown:
    """An empty picture, where a kind draws its own."""
    return Shown(np.zeros((480, 640), np.uint8), _FIXED, Dock(DIAMETER_M))


def second_dock_comes(rng: np.random.Generator) -> Iterator[tuple[Shown, np.ndarray]]:
    """Frames of a dock on the left, approached slowly, and where another one is that comes in from the right."""
    lights = int(rng.integers(6, 13))
    points, dock = circle(even(lights)), Dock(DIAMETER_M, lights)
    normals = [unit_normal(np.radians(rng.uniform(5, 30)), rng.uniform(0, 2 * np.pi)) for _ in range(2)]
    rolls = rng.uniform(0, 2 * np.pi, 2)
    z_m = rng.uniform(2.6, 4.0) * np.array([1.0, rng.uniform(0.7, 1.3)])
    bright = rng.uniform(0.7, 1.5, 2)
    for number in range(36):
        z_m = z_m * 0.997
        across = np.array([-0.21, max(0.21, 0.62 - 0.02 * number)])
        down = np.array([0.02, -0.02]) * np.sin(number / 9)
        lamps = Lamps(_FIXED, np.empty((0, 2)), np.empty(0), np.empty(0), dock)
        places = np.column_stack([across * z_m, down * z_m, z_m])
        for place, normal, roll, light in zip(places, normals, rolls, bright, strict=True):
            seen = seen_from(points, place, normal, roll)
            lamps.add(on_picture(_FIXED, seen), 3.0 * 3.0 / seen[:, 2], np.full(lights, light))
        lamps.position_m, lamps.normal = places[0], normals[0]
        shown = drawn(rng, lamps, above=180.0, jpeg=None)
        yield shown, places[1]


def ring_of_60(rng: np.random.Generator) -> Shown:
    while True:
        lamps = dock_drawn(rng, circle(even(60)), Dock(DIAMETER_M, 60), share=(0.35, 0.44), tilt_deg=(5, 20))
        if lamps.camera.width == _FIXED.width:
            return drawn(rng, lamps)


def lamps_anywhere(number: int) -> Callable[[np.random.Generator], Shown]:
    def draw(rng: np.random.Generator) -> Shown:
        points = rng.uniform(8, 632, (number, 2)) * [1, 472 / 632]
        return drawn(rng, Lamps(_FIXED, points, np.full(number, 2.0), np.ones(number)), above=180.0)

    return draw


def good_picture() -> Shown:
    """Ten bright lamps in dark water, found at the first look."""
    position, normal = np.array([0.1, -0.05, 1.5]), unit_normal(0.35, 0.8)
    seen = seen_from(circle(even(10)), position, normal, 0.2)
    radii = np.full(10, 4.0)
    dock = Dock(DIAMETER_M, 10)
    lamps = Lamps(_FIXED, on_picture(_FIXED, seen), radii, np.ones(10), dock, position, normal)
    return drawn(np.random.default_rng(0), lamps, above=200.0)
