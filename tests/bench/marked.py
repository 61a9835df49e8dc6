"""Photographs of rings whose lit lights are marked: whether the ring is found, and the side of it that is nearer."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from dockpose import Camera, Dock, Estimate, estimate
from dockpose.camera.image import read

from tests.support.judged import Judgement

_FIELD_OF_VIEW = 1.1547  # of a photograph's width to the assumed focal length: 60 degrees across
_SIGMAS = 2.5  # by which a side is beyond the marks' noise


@dataclass(frozen=True)
class Came:
    """What came of a picture."""

    judged: Judgement
    message: str
    side: bool | None = None  # whether the chosen pose has the true side of the dock nearer; None where it has none


@dataclass(frozen=True)
class Marks:
    """What a ring's marks say: places (N, 2) of all its lights in pixels, lit or not, and which side is nearer."""

    marks_px: np.ndarray  # (M, 2)
    places_px: np.ndarray
    within_px: float
    rising: np.ndarray  # (2,): direction in which its plane comes nearer, as of ``rising_of``
    is_sided: bool  # whether that is beyond the marks' noise

    @classmethod
    def of(cls, entry: dict[str, Any], camera: Camera) -> Marks:
        """Those of an entry of ``leds.json``."""
        marks_px, middle = np.array(entry["lights"]), [camera.cx, camera.cy]
        tangents = (marks_px - middle) / camera.fx
        H, off = _numbered(tangents, entry["N"])
        line = np.linalg.inv(H)[2]
        centre = H[:2, 2] / H[2, 2]
        rising = line[:2] / float(line @ [*centre, 1.0])
        size, count = float(np.linalg.norm(tangents - centre, axis=1).mean()), len(tangents)
        sigma = math.sqrt(off / max(1, 2 * count - 8)) / size**2 * math.sqrt(8 / count)
        places = _seen(H, _model(np.arange(entry["N"]), entry["N"])) * camera.fx + middle
        within_px = 0.06 * entry.get("radius_px", float(np.ptp(marks_px, axis=0).max()) / 2) + 4
        return cls(marks_px, places, within_px, rising, float(np.linalg.norm(rising)) > _SIGMAS * sigma)

    def are_of(self, lights_px: np.ndarray) -> bool:
        """Whether lights (K, 2) are the ring's: nearly all are in its places, and half of the marks are of some."""
        in_place, marked = (
            np.linalg.norm(lights_px[:, None] - places, axis=2) < self.within_px
            for places in (self.places_px, self.marks_px)
        )
        return bool(in_place.any(axis=1).mean() > 0.85 and marked.any(axis=0).mean() > 0.5)


def photographs(data: Path) -> list[tuple[Path, str]]:
    """The photographs of marked rings in a folder of sets."""
    return [
        (path.parent, name)
        for path in sorted(data.glob("leds*/leds.json"))
        for name, entry in json.loads(path.read_text("utf-8")).items()
        if "lights" in entry
    ]


def shown(folder: Path, name: str) -> tuple[np.ndarray, Camera, int, list[Marks]]:
    """A photograph, a camera that may have taken it, how many lights its ring has, and the marks of all its rings."""
    entries = json.loads((folder / "leds.json").read_text("utf-8"))
    entry = entries[name]
    image = read(folder / entry["picture"])
    height, width = image.shape[:2]
    focal = width / _FIELD_OF_VIEW
    camera = Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)
    others = [one for other, one in entries.items() if one["picture"] == entry["picture"] and other != name]
    alike = [one for one in others if "lights" in one and one["N"] == entry["N"]]
    return image, camera, entry["N"], [Marks.of(one, camera) for one in [entry, *alike]]


def run_photograph(job: tuple[Path, str, bool]) -> Came:
    """Judge a photograph by the side that the homography of its marked lights has nearer."""
    image, camera, number, rings = shown(*job[:2])
    return came_of(estimate(image, camera, Dock(0.10, number if job[2] else None)), rings)


def came_of(found: Estimate, rings: Sequence[Marks]) -> Came:
    """What came of a photograph that shows some rings alike: of that which was found, or of the first."""
    if found.status != "ok" or found.selected is None or found.ring is None or found.markers is None:
        return Came(Judgement(found=False), found.message)
    on_px = found.markers.points_px[found.ring.on_ring]
    ring = next((one for one in rings if one.are_of(on_px)), None)
    marks = ring or rings[0]
    chance, detection = found.selected.probability or 0.0, found.detection or 0.0
    came = Judgement(found=True, right=ring is not None, either=marks.is_sided, probability=chance, detection=detection)
    one, other = (rising_of(pose.position_m, pose.normal) for pose in (found.candidates[0], found.candidates[-1]))
    return Came(came, found.message, float((marks.rising - (one + other) / 2) @ (one - other)) >= 0)


def rising_of(position_m: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Direction (2,) in the picture in which a dock's plane comes nearer, by shares per unit of its tangent."""
    return normal[:2] / float(normal @ position_m) * position_m[2]


def _model(lights: np.ndarray, number: int) -> np.ndarray:
    """Places (K, 2) on the unit circle of lights (K,) of so many."""
    angles = math.tau * lights / number
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _seen(H: np.ndarray, flat: np.ndarray) -> np.ndarray:
    seen = np.column_stack([flat, np.ones(len(flat))]) @ H.T
    return seen[:, :2] / seen[:, 2:]


def _numbered(tangents: np.ndarray, number: int) -> tuple[np.ndarray, float]:
    """The homography (3, 3) that takes a ring of so many lights to marks (M, 2) at best, and what it leaves."""
    count = len(tangents)
    (x, y), (a, b), turn = cv2.fitEllipseDirect((1000 * tangents).astype(np.float32))
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    local = (1000 * tangents - [x, y]) @ np.array([[c, -s], [s, c]]) / (np.array([a, b]) / 2)
    order = np.argsort(np.arctan2(local[:, 1], local[:, 0]))
    around = np.arctan2(local[order, 1], local[order, 0])
    best: tuple[float, np.ndarray] | None = None
    gaps = np.diff(around, append=around[0] + math.tau)
    base = np.maximum(1, np.rint(gaps * number / math.tau)).astype(int)
    for longest in range(count):  # the gaps add up to the number
        steps = base.copy()
        steps[longest] += number - steps.sum()
        if steps[longest] < 1:
            continue
        model = _model(np.concatenate([[0], np.cumsum(steps)[:-1]]), number)
        H, _ = cv2.findHomography(model, tangents[order])
        if H is None:
            continue
        off = float(((_seen(H, model) - tangents[order]) ** 2).sum())
        if best is None or off < best[0]:
            best = off, H
    assert best is not None
    return best[1], best[0]
