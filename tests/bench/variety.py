"""Rings of lamps under trouble of many kinds, each with its twin: the same picture with the lamps strewn, no ring."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
from dockpose import Camera, Dock, estimate

from tests.bench.lamps import DIAMETER_M, HALOS, Drawn, draw_lamps, ring_px, unit_normal
from tests.bench.seen_scenes import closest_px
from tests.support.judged import judged

SIZES = {(320, 240): 0.25, (640, 480): 0.4, (1280, 720): 0.2, (1920, 1080): 0.1, (3840, 2160): 0.05}
LEAST_SPACING_PX = 7.0  # of neighbouring lamps
DARK = 0.15  # of the light of the brightest lamp, which all have at least


@dataclass
class _Scene:
    """What is drawn: lamps of the dock and others, and what happens to their light."""

    rng: np.random.Generator
    size: tuple[int, int]
    camera: Camera
    lights: int
    semi_axis_px: float
    position_m: np.ndarray
    normal: np.ndarray
    lamps_px: np.ndarray
    radii_px: np.ndarray
    brightness: np.ndarray
    others: list[tuple[float, float, float, float]] = field(default_factory=list)  # x, y, radius, brightness
    exposed: Callable[[np.ndarray], np.ndarray] | None = None
    over: np.ndarray | None = None
    told: int | None = None

    @property
    def spacing_px(self) -> float:
        """The least distance between two lamps of the dock."""
        return closest_px(self.lamps_px)

    @property
    def centre_px(self) -> np.ndarray:
        x, y, z = self.position_m
        return np.array([self.camera.fx * x / z + self.camera.cx, self.camera.fy * y / z + self.camera.cy])


@dataclass(frozen=True)
class _Kind:
    """What befalls the picture, between which numbers the lights are, whether the ring is large, whether it is cut."""

    trouble: Callable[[_Scene], None]
    lights: tuple[int, int] = (5, 24)
    largest: bool = False
    cut: bool = False


def _scene(rng: np.random.Generator, what: _Kind) -> _Scene:
    """A dock in view, its lamps apart; if it is cut, two of its lamps in five are beyond the picture's edge at most."""
    while True:
        size = width, height = list(SIZES)[rng.choice(len(SIZES), p=list(SIZES.values()))]
        focal = width * float(np.exp(rng.uniform(np.log(0.5), np.log(3))))
        camera = Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)
        count = int(rng.integers(what.lights[0], what.lights[1] + 1))
        semi_axis = rng.uniform(0.36 if what.largest else 0.15, 0.44) * height
        z_m = focal * DIAMETER_M / 2 / semi_axis
        normal = unit_normal(np.radians(rng.uniform(5, 40)), rng.uniform(0, 2 * np.pi))
        position = np.array([*(rng.uniform(-0.5, 0.5, 2) * [width, height] * z_m / focal), z_m])
        lamps, depth = ring_px(camera, count, position, normal, rng.uniform(0, 2 * np.pi))
        scene = _Scene(rng, size, camera, count, semi_axis, position, normal, lamps, np.empty(0), np.empty(0))
        scene.told = count
        if (depth < 0.2 * z_m).any() or scene.spacing_px < LEAST_SPACING_PX:
            continue
        share = rng.uniform(0.12, 0.25)
        scene.radii_px = np.maximum(1.2, min(share * scene.spacing_px, 0.02 * width)) * z_m / depth
        scene.brightness = np.exp(rng.uniform(np.log(0.6), np.log(6))) * rng.uniform(0.5, 1.0, count)
        inside = ((lamps > 2 * scene.radii_px[:, None]) & (lamps < size - 2 * scene.radii_px[:, None])).all(axis=1)
        if inside.all() != what.cut and inside.sum() >= 0.6 * count:
            return scene


def _blurred_by_motion(scene: _Scene) -> None:
    """The camera moved while the shutter was open, by up to half the lamps' spacing."""
    length, angle = scene.rng.uniform(0.15, 0.5) * scene.spacing_px, scene.rng.uniform(0, np.pi)
    half = int(np.ceil(length / 2)) + 1
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    for along in np.linspace(-length / 2, length / 2, 8 * half):
        x, y = half + along * np.cos(angle), half + along * np.sin(angle)
        column, row = int(x), int(y)
        weights = np.outer([row + 1 - y, y - row], [column + 1 - x, x - column])
        kernel[row : row + 2, column : column + 2] += weights
    kernel /= kernel.sum()
    scene.exposed = lambda light: cv2.filter2D(light, -1, kernel, borderType=cv2.BORDER_REPLICATE)


def _banded(scene: _Scene) -> None:
    """Lamps that flicker under a rolling shutter: each row of the picture has light or less of it."""
    period = scene.rng.uniform(0.05, 0.5) * scene.size[1]
    rows = np.arange(scene.size[1])[:, None]
    wave = 0.5 + 0.5 * np.sin(2 * np.pi * rows / period + scene.rng.uniform(0, 6.3))
    band = (1 - scene.rng.uniform(0.3, 0.8) * wave).astype(np.float32)
    scene.exposed = lambda light: light * band


def _nearly_touching(scene: _Scene) -> None:
    scene.radii_px *= scene.rng.uniform(0.3, 0.42) * scene.spacing_px / scene.radii_px.max()


def _of_different_size(scene: _Scene) -> None:
    """Radii from one to four, so that the areas differ by sixteen."""
    largest = 0.35 * scene.spacing_px
    smallest = max(1.2, largest / 4)
    scene.radii_px = np.exp(scene.rng.uniform(np.log(smallest), np.log(max(largest, smallest)), scene.lights))


def _with_a_lamp_in_the_middle(scene: _Scene) -> None:
    radius = float(np.mean(scene.radii_px)) * scene.rng.uniform(0.7, 2)
    place = scene.centre_px + scene.rng.uniform(-0.1, 0.1, 2) * scene.semi_axis_px
    scene.others.append((*place.tolist(), radius, float(scene.brightness.mean() * scene.rng.uniform(0.5, 3))))


def _with_a_nested_ring(scene: _Scene) -> None:
    """A smaller ring on the same plate, of a number of lamps that makes it no part of the dock's."""
    number = scene.lights
    while scene.lights % number == 0:
        number = int(scene.rng.integers(4, 13))
    inner = scene.position_m * DIAMETER_M / 2, scene.rng.uniform(0.35, 0.65)
    lamps, _ = ring_px(scene.camera, number, scene.position_m / inner[1], scene.normal, scene.rng.uniform(0, 6.3))
    radius = float(np.mean(scene.radii_px)) * inner[1]
    for x, y in lamps.tolist():
        scene.others.append((x, y, max(1.2, radius), float(scene.brightness.mean())))


def _with_a_torch(scene: _Scene) -> None:
    """A lamp far over white, several times as large as the dock's, outside the ring."""
    width, height = scene.size
    for _ in range(100):
        place = scene.rng.random(2) * [width, height]
        radius = scene.rng.uniform(0.02, 0.06) * width
        if np.linalg.norm(scene.lamps_px - place, axis=1).min() > 3 * radius:
            scene.others.append((*place.tolist(), radius, scene.rng.uniform(5, 20)))
            return


def _with_text(scene: _Scene) -> None:
    """A clock and a name, burnt in where no lamp is."""
    width, height = scene.size
    scene.over = np.zeros((height, width), np.uint8)
    clock = "20{:02}-{:02}-{:02} {:02}:{:02}:{:02}".format(*scene.rng.integers(10, 24, 6).tolist())
    for text in (clock, "CAM 0" + str(scene.rng.integers(10)))[: scene.rng.integers(1, 3)]:
        scale, thick = scene.rng.uniform(0.5, 1.2) * width / 640, max(1, width // 640)
        box, base = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, thick)
        for _ in range(100):
            x, y = (scene.rng.uniform(0.01, 0.95, 2) * [max(1, width - box[0]), height - box[1]]).astype(int).tolist()
            off = np.maximum(np.maximum([x, y] - scene.lamps_px, scene.lamps_px - [x + box[0], y + box[1] + base]), 0)
            if np.linalg.norm(off, axis=1).min() > 3 * scene.radii_px.max() + 5:
                level = int(scene.rng.integers(180, 256))
                place = x, y + box[1]
                cv2.putText(scene.over, text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, level, thick, cv2.LINE_AA)
                break


def _of_unknown_number(scene: _Scene) -> None:
    scene.told = None


def _plain(scene: _Scene) -> None:
    pass


KINDS = {
    "plain": _Kind(_plain),
    "number unknown": _Kind(_of_unknown_number, (4, 24)),
    "motion blur": _Kind(_blurred_by_motion),
    "rolling bands": _Kind(_banded),
    "24 touching": _Kind(_nearly_touching, (24, 24), largest=True),
    "48 touching": _Kind(_nearly_touching, (48, 48), largest=True),
    "unlike sizes": _Kind(_of_different_size),
    "lamp in middle": _Kind(_with_a_lamp_in_the_middle),
    "nested ring": _Kind(_with_a_nested_ring, (6, 24)),
    "cut by the edge": _Kind(_plain, (8, 24), cut=True),
    "torch": _Kind(_with_a_torch),
    "text": _Kind(_with_text),
}


def draw(kind: str, seed: int, *, ring: bool = True, sizes: int = len(SIZES)) -> tuple[Drawn, int | None]:
    """A picture of a kind, of the smallest ``sizes``, and the number told; without ``ring`` the lamps are strewn."""
    what = KINDS[kind]
    scene = next(
        scene
        for attempt in itertools.count()
        if list(SIZES).index((scene := _scene(np.random.default_rng([seed, attempt, *kind.encode()]), what)).size)
        < sizes
    )
    what.trouble(scene)
    if not ring:
        _strew(scene)
    lamps, radii, brightness = scene.lamps_px, scene.radii_px, scene.brightness
    if scene.others:
        x, y, radius, value = np.array(scene.others).T
        lamps = np.vstack([lamps, np.column_stack([x, y])])
        radii, brightness = np.concatenate([radii, radius]), np.concatenate([brightness, value])
    share = scene.rng.uniform(0, 0.5)
    image = draw_lamps(
        scene.size,
        lamps,
        radii,
        brightness,
        scene.rng,
        ambient=float(scene.rng.uniform(0.001, 0.05)),
        halos=tuple((share * weight, wide) for weight, wide in HALOS),
        noise_levels=float(scene.rng.uniform(0.5, 3)),
        jpeg_quality=int(scene.rng.integers(50, 96)),
        exposed=scene.exposed,
        over=scene.over,
    )
    dock = Dock(DIAMETER_M, scene.lights)
    return Drawn(image, scene.camera, dock, scene.lamps_px, scene.position_m, scene.normal), scene.told


def _strew(scene: _Scene) -> None:
    """Put the dock's lamps anywhere, no nearer to each other than they were."""
    apart = min(scene.spacing_px, 0.3 * min(scene.size) / np.sqrt(scene.lights))
    places: list[np.ndarray] = []
    while len(places) < scene.lights:
        place = scene.rng.uniform(0.02, 0.98, 2) * scene.size
        if all(np.linalg.norm(place - other) > apart for other in places):
            places.append(place)
    scene.lamps_px = np.array(places)


def run(job: tuple[str, int, bool]) -> tuple[str, str, int | None, float]:
    """Outcome, status, number told and chosen probability for a kind, a seed, and whether there is a ring."""
    kind, seed, ring = job
    drawn, told = draw(kind, seed, ring=ring)
    found = estimate(drawn.image, drawn.camera, Dock(DIAMETER_M, told))
    chance = 0.0 if found.selected is None else found.selected.probability or 0.0
    return judged(found, drawn.position_m, drawn.normal).outcome, found.status, told, chance
