"""Thresholds alone: those of the library, and Sauvola's and Bradley's local ones, over the scenes of three drawers."""

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from dockpose import Camera, Dock, Settings, estimate, register_threshold
from dockpose.paper.levels import are_the_lights
from dockpose.study import draw
from dockpose.study.judge import RIGHT_DEG, RIGHT_SHARE
from dockpose.thresholds import METHODS
from skimage import filters

from tests.bench import variety
from tests.bench.peers.scenes import AUTOMATIC, RANGES, TURBIDITIES, seen

_KINDS = ("plain", "motion blur", "rolling bands", "text")
_WINDOW, _LEAST_LEVELS = 31, 8.0  # pixels; above what is around, lest all noise of dark water be lights


class Lit(NamedTuple):
    """A picture with a dock, and what it shows."""

    drawer: str
    image: np.ndarray
    camera: Camera
    dock: Dock
    lights_px: np.ndarray
    position_m: np.ndarray
    normal: np.ndarray


@register_threshold("sauvola", title="Sauvola")
def sauvola(grey: np.ndarray) -> np.ndarray:
    """Above Sauvola's level (2000) of a window, turned over for bright objects, and above what is around."""
    turned = float(grey.max()) - grey.astype(float)
    return (turned < filters.threshold_sauvola(turned, _WINDOW)) & _is_raised(grey)


@register_threshold("bradley", title="Bradley")
def bradley(grey: np.ndarray) -> np.ndarray:
    """Above the mean of a window by 15 % (Bradley and Roth 2007), and above what is around."""
    return (grey > 1.15 * filters.threshold_local(grey, _WINDOW, "mean")) & _is_raised(grey)


def _is_raised(grey: np.ndarray) -> np.ndarray:
    return grey > filters.threshold_local(grey, _WINDOW, "mean") + _LEAST_LEVELS


def names() -> list[str]:
    """Of all methods but a fixed level."""
    return [name for name in METHODS if name != "fixed"]


def scenes(seed: int, number: int) -> Iterator[Lit]:
    """A scene of the study, one of this comparison, and one by the other drawer."""
    drawn = next(one for index in range(100) if (one := draw.draw(seed, 100 * number + index)).has_dock)
    picture = draw.picture_of(drawn)
    truth, scene = picture.truth, picture.scene
    lights_px = truth.lights_px[truth.visible]
    yield Lit("study", picture.image, scene.camera, scene.dock, lights_px, truth.position_m, truth.normal)
    ours = seen(seed, TURBIDITIES[number % 4], RANGES[number % 5], 1000 + number, plates=False)[AUTOMATIC]
    place = ours.position_m, ours.normal
    yield Lit("tank", ours.images["ring"], ours.camera, ours.dock, ours.lights_px, *place)
    other, told = variety.draw(_KINDS[number % 4], seed + number, sizes=3)
    dock = Dock(other.dock.diameter, told)
    yield Lit("lamps.py", other.image, other.camera, dock, other.lamps_px, other.position_m, other.normal)


def judged(lit: Lit, name: str) -> tuple[bool, bool, float]:
    """Whether the groups are exactly the lights, whether the chosen pose is right, and milliseconds of computing."""
    began_s = time.process_time()
    found = estimate(lit.image, lit.camera, lit.dock, Settings(method=name), fall_back=False)
    took_ms = 1000 * (time.process_time() - began_s)
    points_px = np.empty((0, 2)) if found.markers is None else found.markers.points_px
    pose = found.selected if found.status == "ok" else None
    is_right = pose is not None and is_near(pose.position_m, pose.normal, lit.position_m, lit.normal)
    return are_the_lights(points_px, lit.lights_px), is_right, took_ms


def is_near(position_m: np.ndarray, normal: np.ndarray, true_m: np.ndarray, true_normal: np.ndarray) -> bool:
    """Whether a pose is right as the study says."""
    off = float(np.linalg.norm(position_m - true_m) / np.linalg.norm(true_m))
    return off <= RIGHT_SHARE and angle_deg(normal, true_normal) <= RIGHT_DEG


def angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two unit vectors."""
    return float(np.degrees(np.arccos(np.clip(one @ other, -1, 1))))
