"""Pictures without a dock, drawn by a program of its own: lamps, letters, hoops, cables, windows and more."""

from collections.abc import Callable

import cv2
import numpy as np

from tests.bench.lamps import as_jpeg

SIZES = ((320, 240), (640, 352), (640, 480), (1280, 720), (1920, 1080))


def picture(kind: str, seed: int) -> np.ndarray:
    """A grey picture (H, W) uint8 of a kind; the same seed gives the same picture."""
    rng = np.random.default_rng([seed, *kind.encode()])
    width, height = SIZES[rng.choice(len(SIZES), p=(0.25, 0.25, 0.3, 0.15, 0.05))]
    light = _background(rng, width, height)
    ALL[kind](light, rng)
    light += rng.normal(0, rng.uniform(0.5, 4), light.shape).astype(np.float32)
    grey = np.clip(light, 0, 255).astype(np.uint8)
    return as_jpeg(grey, int(rng.integers(35, 95))) if rng.random() < 0.3 else grey


def _background(rng: np.random.Generator, width: int, height: int) -> np.ndarray:
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    slope = rng.uniform(-60, 60, 2) * (rng.random() < 0.5)
    light = rng.uniform(5, 70) + slope[0] * (x / width - 0.5) + slope[1] * (y / height - 0.5)
    return np.maximum(light, 0).astype(np.float32)


def _lamp(light: np.ndarray, x: float, y: float, radius: float, level: float, halo: float) -> None:
    """Add a lamp: a disc with a soft edge, and a halo that falls with the square of the distance."""
    reach = int(12 * radius + 12)
    left, top = max(0, int(x) - reach), max(0, int(y) - reach)
    part = light[top : int(y) + reach + 1, left : int(x) + reach + 1]
    if not part.size:
        return
    rows, columns = np.mgrid[0 : part.shape[0], 0 : part.shape[1]].astype(np.float32)
    away = np.hypot(columns + left - x, rows + top - y)
    disc = 1 / (1 + np.exp(np.clip(2 * (away - radius), -30, 30)))
    fade = np.clip(1 - away / reach, 0, 1)
    part += level * (disc + halo * fade / (1 + (away / radius) ** 2))


def _lamps(light: np.ndarray, rng: np.random.Generator) -> None:
    """From 4 to 40 lamps anywhere, as alike or as different as it comes."""
    height, width = light.shape
    spread, radius = rng.uniform(0, 0.8), rng.uniform(1.2, 0.012 * width + 1.2)
    level, halo = rng.uniform(80, 600), rng.uniform(0, 0.5)
    for _ in range(rng.integers(4, 41)):
        factor = np.exp(rng.normal(0, spread))
        _lamp(light, rng.uniform(0, width), rng.uniform(0, height), radius * factor**0.5, level * factor, halo)


def _grid(light: np.ndarray, rng: np.random.Generator) -> None:
    """Lamps in rows and columns, seen in perspective; more than two by two, for a square is a dock of four lights."""
    height, width = light.shape
    rows, columns = rng.integers(2, 7), rng.integers(3, 9)
    corners = np.array([[0, 0], [columns - 1, 0], [columns - 1, rows - 1], [0, rows - 1]], np.float32)
    size = np.array([width, height])
    seen = (np.array([[0.12, 0.12], [0.88, 0.12], [0.88, 0.88], [0.12, 0.88]]) + rng.uniform(-0.1, 0.1, (4, 2))) * size
    H = cv2.getPerspectiveTransform(corners, seen.astype(np.float32))
    places = np.array([[[x, y]] for x in range(columns) for y in range(rows)], np.float32)
    radius, level, halo = rng.uniform(1.5, 0.01 * width + 1.5), rng.uniform(100, 500), rng.uniform(0, 0.5)
    lit = rng.random(len(places)) > rng.choice([0.0, 0.2])
    for (x, y), on in zip(cv2.perspectiveTransform(places, H)[:, 0].tolist(), lit, strict=True):
        if on:
            _lamp(light, x, y, radius, level * rng.uniform(0.7, 1.0), halo)


def _text(light: np.ndarray, rng: np.random.Generator) -> None:
    """Lines of letters and digits."""
    height, width = light.shape
    letters = list("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789:/-. ")
    for _ in range(rng.integers(1, 6)):
        words = "".join(rng.choice(letters, rng.integers(4, 24)))
        scale = float(rng.uniform(0.4, 1.6)) * width / 640
        place = int(rng.uniform(0, 0.6 * width)), int(rng.uniform(0.08, 0.97) * height)
        font = int(rng.choice([cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_PLAIN]))
        letters_px = np.zeros(light.shape, np.uint8)
        level, thickness = float(rng.uniform(120, 255)), int(rng.integers(1, 4))
        cv2.putText(letters_px, words, place, font, scale, level, thickness, cv2.LINE_AA)
        light += letters_px


def _snow(light: np.ndarray, rng: np.random.Generator) -> None:
    """Bubbles, bright on one side of a thin ring, and specks."""
    height, width = light.shape
    for _ in range(rng.integers(5, 150)):
        _lamp(light, rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.5, 2.0), rng.uniform(20, 250), 0.0)
    for _ in range(rng.integers(0, 25)):
        x, y = (rng.random(2) * [width, height]).astype(int).tolist()
        radius = int(rng.uniform(3, 0.03 * width + 3))
        start = float(rng.uniform(0, 360))
        bubble = np.zeros_like(light)
        cv2.ellipse(bubble, (x, y), (radius, radius), start, 0, 140, float(rng.uniform(60, 250)), 1, cv2.LINE_AA)
        light += bubble


def _torches(light: np.ndarray, rng: np.random.Generator) -> None:
    """One to five torches: wide saturated spots with streaks, and what they light up."""
    height, width = light.shape
    for _ in range(rng.integers(1, 6)):
        x, y = (rng.random(2) * [width, height]).tolist()
        _lamp(light, x, y, rng.uniform(0.01, 0.06) * width, rng.uniform(200, 900), rng.uniform(0.2, 0.8))
        for _ in range(rng.integers(0, 4)):
            angle, length = rng.uniform(0, 6.3), rng.uniform(0.02, 0.2) * width
            end = int(x + length * np.cos(angle)), int(y + length * np.sin(angle))
            streak = np.zeros_like(light)
            cv2.line(streak, (int(x), int(y)), end, float(rng.uniform(40, 200)), int(rng.integers(1, 4)), cv2.LINE_AA)
            light += streak
    for _ in range(rng.integers(0, 20)):
        _lamp(light, rng.uniform(0, width), rng.uniform(0, height), rng.uniform(0.8, 3.0), rng.uniform(30, 250), 0.1)


def _hoops(light: np.ndarray, rng: np.random.Generator) -> None:
    """One to four bright hoops, as the mouths of pipes and the letter O: ellipses of any size and stroke."""
    height, width = light.shape
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
    for _ in range(rng.integers(1, 5)):
        major = float(np.exp(rng.uniform(np.log(5), np.log(0.3 * height))))
        minor, turn = major * rng.uniform(0.4, 1.0), rng.uniform(0, np.pi)
        x, y = columns - rng.uniform(0.2, 0.8) * width, rows - rng.uniform(0.2, 0.8) * height
        along, across = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
        share = np.hypot(along / major, across / minor)
        slope = np.hypot(along / major**2, across / minor**2) / np.maximum(share, 1e-6)
        off = np.abs(share - 1) / np.maximum(slope, 1e-6)
        stroke = rng.uniform(0.5, 1.5 + 0.1 * major)
        light += rng.uniform(60, 400) / (1 + np.exp(np.clip(2 * (off - stroke / 2), -30, 30)))


def _spokes(light: np.ndarray, rng: np.random.Generator) -> None:
    """Five to twelve lines from a middle, as a wheel or a propeller has: of any length, stroke and brightness."""
    height, width = light.shape
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
    count, reach = rng.integers(5, 13), float(np.exp(rng.uniform(np.log(15), np.log(0.4 * height))))
    x, y = columns - rng.uniform(0.3, 0.7) * width, rows - rng.uniform(0.3, 0.7) * height
    squeeze, turn = rng.uniform(0.5, 1.0), rng.uniform(0, 2 * np.pi)
    off = np.full(light.shape, np.inf, np.float32)
    for angle in turn + 2 * np.pi * np.arange(count) / count:
        end = reach * np.array([np.cos(angle), squeeze * np.sin(angle)])
        share = ((x * end[0] + y * end[1]) / (end @ end)).clip(0, 1)
        off = np.minimum(off, np.hypot(x - share * end[0], y - share * end[1]))
    stroke = rng.uniform(1, 1.5 + 0.06 * reach)
    light += rng.uniform(60, 400) / (1 + np.exp(np.clip(2 * (off - stroke / 2), -30, 30)))


def _lit(light: np.ndarray, rng: np.random.Generator, points_px: np.ndarray, spacing_px: float) -> None:
    """Draw lamps that are alike at points (N, 2), so far apart."""
    radius = max(1.2, rng.uniform(0.08, 0.2) * min(spacing_px, 0.1 * light.shape[1]))
    level, halo = rng.uniform(100, 600), rng.uniform(0, 0.5)
    for x, y in points_px.tolist():
        _lamp(light, x, y, radius, level * rng.uniform(0.75, 1.0), halo)


def _inside(rng: np.random.Generator, light: np.ndarray, points_px: np.ndarray) -> np.ndarray:
    """Points (N, 2) moved to somewhere in the picture, and without those that are beyond its edge."""
    size = np.array(light.shape[::-1])
    moved = points_px - points_px.mean(axis=0) + rng.uniform(0.25, 0.75, 2) * size
    return moved[((moved > 3) & (moved < size - 3)).all(axis=1)]


def _round(rng: np.random.Generator, angles_rad: np.ndarray, radius_px: float) -> np.ndarray:
    """Points (N, 2) of a circle, seen from far away at any tilt up to 60 degrees."""
    turn, squeeze = rng.uniform(0, np.pi), rng.uniform(0.5, 1.0)
    x, y = radius_px * np.cos(angles_rad), squeeze * radius_px * np.sin(angles_rad)
    return np.column_stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y])


def _strings(light: np.ndarray, rng: np.random.Generator) -> None:
    """One or two bent cables of 8 to 30 lamps each, a few hundredths of their spacing off it."""
    for _ in range(rng.integers(1, 3)):
        number, step = int(rng.integers(8, 31)), rng.uniform(0.02, 0.06) * light.shape[1]
        along = np.cumsum(step * rng.normal(1, 0.03, number))
        waves = np.sin(np.outer(along / light.shape[1], rng.uniform(1, 9, 3)) + rng.uniform(0, 6.3, 3))
        heading = rng.uniform(0, 2 * np.pi) + waves @ rng.uniform(0.2, 1.5, 3)
        points = np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
        _lit(light, rng, _inside(rng, light, points), step)


def _thirds(light: np.ndarray, rng: np.random.Generator) -> None:
    """Seven lit things, or a third of them, at places of a ring of 19 to 24."""
    places, radius = int(rng.integers(19, 25)), rng.uniform(0.15, 0.42) * light.shape[0]
    kept = rng.choice(places, places // 3 + int(rng.integers(0, 2)), replace=False)
    _lit(light, rng, _inside(rng, light, _round(rng, 2 * np.pi * kept / places, radius)), 6 * radius / places)


def _joints(light: np.ndarray, rng: np.random.Generator) -> None:
    """Pairs of solder joints of parts along a bent strip, each pair across it, some of them duller."""
    number, step, bend = int(rng.integers(3, 9)), rng.uniform(0.05, 0.12) * light.shape[1], rng.uniform(0, 0.5)
    heading = bend * np.arange(number) + rng.uniform(0, 6.3)
    middle = np.cumsum(step * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0)
    across = step * rng.uniform(0.15, 0.5) * np.column_stack([-np.sin(heading), np.cos(heading)])
    points = np.vstack([middle + across, middle - across])
    _lit(light, rng, _inside(rng, light, points + rng.normal(0, 0.02 * step, points.shape)), 0.3 * step)


def _windows(light: np.ndarray, rng: np.random.Generator) -> None:
    """One to four lit rows of windows, one above the other, in perspective, some of them dark."""
    rows, columns, step = int(rng.integers(1, 5)), int(rng.integers(4, 16)), rng.uniform(0.04, 0.1) * light.shape[1]
    x, y = np.meshgrid(np.arange(columns) - columns / 2, (np.arange(rows) - rows / 2) * rng.uniform(0.7, 1.5))
    nearness = 1 + rng.uniform(-0.5, 0.5) * x / columns
    points = step * np.column_stack([(x * nearness).ravel(), (y * nearness).ravel()])
    width, height = max(2, int(rng.uniform(0.2, 0.5) * step)), max(2, int(rng.uniform(0.2, 0.6) * step))
    for x_px, y_px in _inside(rng, light, points[rng.random(len(points)) > rng.choice([0.0, 0.3])]).astype(int):
        light[y_px : y_px + height, x_px : x_px + width] += rng.uniform(100, 250)


def _clusters(light: np.ndarray, rng: np.random.Generator) -> None:
    """Two clusters of 3 to 6 lamps, each of them near together."""
    for _ in range(2):
        spread = rng.uniform(0.03, 0.1) * light.shape[1]
        points = rng.normal(0, spread, (int(rng.integers(3, 7)), 2))
        _lit(light, rng, _inside(rng, light, points), 0.7 * spread)


def _arcs(light: np.ndarray, rng: np.random.Generator) -> None:
    """From 5 to 9 lamps along 40 to 120 degrees of a circle, by hand: 3 % of their spacing off."""
    number, radius, length = int(rng.integers(5, 10)), rng.uniform(0.3, 0.9) * light.shape[0], rng.uniform(0.7, 2.1)
    angles = np.linspace(0, length, number) + rng.normal(0, 0.03 * length / number, number)
    _lit(light, rng, _inside(rng, light, _round(rng, angles, radius)), radius * length / number)


def _reflections(light: np.ndarray, rng: np.random.Generator) -> None:
    """From 3 to 6 lamps and their images in the water's surface, duller and shaken."""
    height, width = light.shape
    number, surface = int(rng.integers(3, 7)), rng.uniform(0.35, 0.65) * height
    points = rng.uniform(0.1, 0.9, (number, 2)) * [width, surface]
    images = points * [1, -1] + [0, 2 * surface] + rng.normal(0, 0.004 * width, (number, 2))
    _lit(light, rng, np.vstack([points, images]), 0.1 * width)


KINDS: dict[str, Callable[[np.ndarray, np.random.Generator], None]] = {
    "lamps": _lamps,
    "grid": _grid,
    "text": _text,
    "snow": _snow,
    "torches": _torches,
    "hoops": _hoops,
    "spokes": _spokes,
}
# Of lamps that are placed as those of a dock are not: where the number of lights is unknown.
PLACED: dict[str, Callable[[np.ndarray, np.random.Generator], None]] = {
    "strings": _strings,
    "thirds": _thirds,
    "joints": _joints,
    "windows": _windows,
    "clusters": _clusters,
    "arcs": _arcs,
    "reflections": _reflections,
}
ALL = KINDS | PLACED
