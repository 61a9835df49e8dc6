"""Photographs and pictures by other programs, estimated through the library, and what came of each by its truth."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from dockpose import Camera, Dock, estimate
from dockpose.app.inputs.pictures import camera_and_dock
from dockpose.camera.files import load_camera
from dockpose.camera.image import read

LEDS, TANK, CHALLENGE, NO_DOCK = "leds", "tank", "challenge", "no_dock"
SETS = (LEDS, TANK, CHALLENGE, NO_DOCK)
LAMPS = "lamps, no ring"
FIVE = ("five_water", "five_air_a", "five_air_b")
TOLD_OF_NO_DOCK = (4, 5, 6, 7, 8, 10, 12, None)
SURE = 0.95
_INTERVAL = 1.96  # standard errors that hold 95 %
_LED_FIELD_OF_VIEW = 1.1547  # of a picture's width to the assumed focal length: 60 degrees across
_ANGLES_SEEN = re.compile(r"degrees? off|angles_deg")


@dataclass(frozen=True)
class Job:
    """A picture to be estimated: where it stands, what is told, and what is known of it."""

    set: str
    kind: str
    name: str
    path: Path
    told: int | None
    truth: dict[str, Any]
    altered: int = 0  # number of the alteration, see ``altered``; 0 for the picture as it is


@dataclass(frozen=True)
class Result:
    """What came of a picture."""

    set: str
    kind: str
    name: str
    told: int | None
    outcome: str
    wrong: bool | None  # None where nobody marked what is right
    status: str
    message: str
    range_m: float | None
    probability: float | None
    detection: float | None
    ms: float
    has_dock: bool = True
    exact: bool = True  # whether all lamps are in their places
    seen: bool = False  # whether the dock was found, or refused with its angles
    held: tuple[bool, ...] | None = None  # whether 95 % intervals of x, y, z and both angles hold the truth
    held_seen: tuple[bool, ...] | None = None  # against where the lamps' light is seen
    altered: int = 0  # number of the alteration

    @property
    def sure(self) -> bool:
        """Whether it is "ok" and claims to be right by at least ``SURE``."""
        return self.status == "ok" and (self.probability or 0) * (self.detection or 0) >= SURE


def jobs(data: Path, sets: Sequence[str] = SETS) -> Iterator[Job]:
    """All pictures of some sets, once for each number of lights that is told; none of a set that is not there."""
    of_set = {LEDS: _leds, TANK: _tank, CHALLENGE: _challenge, NO_DOCK: _no_dock}
    for name in sets:
        yield from of_set[name](data)


def _leds(data: Path) -> Iterator[Job]:
    for path in data.glob("leds/leds.json"):
        for name, entry in json.loads(path.read_text("utf-8")).items():
            for told in (entry["N"] or 8, None):
                yield Job(LEDS, entry["kind"], name, path.parent / entry["picture"], told, entry)


def _tank(data: Path) -> Iterator[Job]:
    for path in sorted(data.glob("tank/*/truth.json")):
        for truth in json.loads(path.read_text("utf-8")):
            picture = path.with_name(truth["file"])
            yield Job(TANK, path.parent.name, picture.name, picture, truth["spec"]["lights"], truth)


def _challenge(data: Path) -> Iterator[Job]:
    for path in sorted(data.glob("challenge/*/truth.json")):
        for name, truth in json.loads(path.read_text("utf-8")).items():
            yield Job(CHALLENGE, truth["kind"], name, path.with_name(name), truth["lights"], truth)


def _no_dock(data: Path) -> Iterator[Job]:
    for path in sorted(data.glob("challenge/no_dock/*.jpg")):
        for told in TOLD_OF_NO_DOCK:
            yield Job(NO_DOCK, str(told or "unknown"), path.name, path, told, {})


def altered(image: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """The same sight by another camera: turned, mirrored, larger or smaller, brighter or darker, noisy, JPEG.

    With it the map (2, 3) of its pixels, and how many times as large it is.
    """
    height, width = image.shape[:2]
    least, most = 240 / min(height, width), 2200 / max(height, width)
    scale = min(max(float(np.exp(rng.uniform(math.log(0.5), math.log(1.4)))), least), most)
    size = round(scale * width), round(scale * height)
    turn = cv2.getRotationMatrix2D((0.0, 0.0), rng.uniform(-15, 15), scale) @ np.diag(
        [rng.choice([-1.0, 1.0]), 1.0, 1.0]
    )
    turn[:, 2] = np.array(size) / 2 - turn[:, :2] @ [width / 2, height / 2]
    smooth = cv2.GaussianBlur(image, (0, 0), 0.45 / scale) if scale < 1 else image
    light = cv2.warpAffine(smooth, turn, size, borderMode=cv2.BORDER_REFLECT_101) / 255.0
    light = light ** np.exp(rng.uniform(math.log(0.7), math.log(1.5))) * rng.uniform(0.75, 1.25)
    levels = np.clip(np.rint(255 * light + rng.normal(0, rng.uniform(0, 3), light.shape)), 0, 255).astype(np.uint8)
    _, stored = cv2.imencode(".jpg", levels, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(50, 96))])
    decoded = cv2.imdecode(stored, cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    return decoded, turn, scale


def _altered(job: Job, image: np.ndarray) -> tuple[Job, np.ndarray]:
    """An alteration of a photograph of lamps, and where its lights are then."""
    image, pixels, scale = altered(image, np.random.default_rng([job.altered, *job.name.encode()]))
    truth = dict(job.truth)
    if "lights" in truth:
        truth["lights"] = np.array(truth["lights"]) @ pixels[:, :2].T + pixels[:, 2]
        truth["radius_px"] *= scale
    return replace(job, truth=truth), image


def run(job: Job) -> Result:
    """Estimate one picture, and judge what was found as the set says it is right."""
    image = read(job.path)
    if job.altered:
        job, image = _altered(job, image)
    camera, dock = camera_and_dock_of(job, image.shape[1], image.shape[0])
    row = estimate(image, camera, dock).to_dict()
    chosen = row["candidates"][row["selected"]] if row["status"] == "ok" else None
    seen, held = False, (None, None)
    if job.set == LEDS:
        outcome, wrong = _of_leds(row, job)
        seen = outcome == "right" or (chosen is None and _ANGLES_SEEN.search(row["message"]) is not None)
    elif job.set == TANK:
        outcome, wrong = _of_tank(row, job.truth)
        held = _held(chosen, job.truth) if outcome == "right" and chosen is not None else held
    elif job.set == CHALLENGE:
        outcome, wrong = _of_challenge(row, job.truth)
    else:
        outcome, wrong = ("refused", False) if chosen is None else ("false", True)
    return Result(
        set=job.set,
        kind=job.kind,
        name=job.name,
        told=job.told,
        outcome=outcome,
        wrong=wrong,
        status=row["status"],
        message=row["message"],
        range_m=None if chosen is None else float(np.linalg.norm(chosen["position_m"])),
        probability=None if chosen is None else chosen["probability"],
        detection=row["detection"],
        ms=row["elapsed_ms"],
        has_dock=job.truth.get("dock", True),
        exact=job.truth.get("spec", {}).get("misplaced_mm", 0.0) == 0,
        seen=seen,
        held=held[0],
        held_seen=held[1],
        altered=job.altered,
    )


def camera_and_dock_of(job: Job, width: int, height: int) -> tuple[Camera, Dock]:
    """The camera that is known, or taken, for a picture of that size, and the dock with the number that is told."""
    if job.set == TANK:
        return camera_and_dock(job.path, None, None)
    if job.set == CHALLENGE:
        return load_camera(job.path.parent / "camera.yaml"), Dock(job.truth.get("diameter_m", 0.5), job.told)
    focal, diameter = (width / _LED_FIELD_OF_VIEW, 0.10) if job.set == LEDS else (width, 0.5)
    return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height), Dock(diameter, job.told)


def _near(points: np.ndarray, others: np.ndarray, within_px: float) -> np.ndarray:
    """For each point (N, 2) whether one of the others (M, 2) is near."""
    if not len(points) or not len(others):
        return np.zeros(len(points), bool)
    return np.linalg.norm(points[:, None] - others, axis=2).min(axis=1) < within_px


def _on_ring(row: dict[str, Any]) -> np.ndarray:
    return np.array([(one["x_px"], one["y_px"]) for one in row["markers"] if one["on_ring"]]).reshape(-1, 2)


def _of_leds(row: dict[str, Any], job: Job) -> tuple[str, bool | None]:
    """Right with three in four of the lights (half where part is hidden), and at most one in ten that is none."""
    if row["status"] != "ok":
        return "refused", False
    if "lights" not in job.truth:
        return ("false", True) if job.kind == LAMPS else ("ok, not marked", None)
    lights, found = np.array(job.truth["lights"]), _on_ring(row)
    within_px = max(4.0, 0.06 * job.truth["radius_px"])
    if (~_near(found, lights, within_px)).sum() > 0.1 * len(found):
        return "wrong", True
    enough = _near(lights, found, within_px).mean() >= (0.75 if job.kind == "full" else 0.5)
    return ("right" if enough else "few lights"), False


def _angle_deg(normal: Sequence[float], other: Sequence[float]) -> float:
    return math.degrees(math.acos(np.clip(np.dot(normal, other), -1, 1)))


def _of_tank(row: dict[str, Any], truth: dict[str, Any]) -> tuple[str, bool]:
    """Right within 3 % of the range and 5 degrees; "twin" where the other candidate is right."""
    if not truth["dock"]:
        return ("false", True) if row["status"] == "ok" else ("refused", False)
    if row["status"] != "ok":
        return "refused", False
    position = np.array(truth["position_m"])
    fits = [
        np.linalg.norm(pose["position_m"] - position) < 0.03 * np.linalg.norm(position)
        and _angle_deg(pose["normal"], truth["normal"]) < 5
        for pose in row["candidates"]
    ]
    if fits[row["selected"]]:
        return "right", False
    return ("twin" if any(fits) else "wrong"), True


def _held(pose: dict[str, Any], truth: dict[str, Any]) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    """Whether 95 % intervals hold the lamps' rims, and their light, seen in a dome or behind a rim."""
    sigma = np.array(
        [
            *(pose.get("sigma_total_position_m") or pose["sigma_position_m"]),
            *(pose.get("sigma_total_theta_deg") or pose["sigma_theta_deg"]),
        ]
    )
    spec = truth["spec"]
    nearer_m = spec["lamp_r"] * (-0.4 if spec["lamp_kind"] == "dome" else 0.15)
    thetas = [pose[name] - truth[name] for name in ("theta_x_deg", "theta_y_deg")]

    def within(position_m: np.ndarray) -> tuple[bool, ...]:
        off = [*(np.array(pose["position_m"]) - position_m), *thetas]
        return tuple((np.abs(off) < _INTERVAL * sigma).tolist())

    rims = np.array(truth["position_m"])
    return within(rims), within(rims + nearer_m * np.array(truth["normal"]))


def _of_challenge(row: dict[str, Any], truth: dict[str, Any]) -> tuple[str, bool]:
    """Right within 5 % of the range and 5 degrees; false with fewer than 3 in 4 lamps on the ring, or 10 % off."""
    if row["status"] != "ok":
        return "refused", False
    if not truth["ring"]:
        return "false", True
    visible = np.array(truth["lamps_px"])[np.array(truth["visible"], bool)]
    lamps = _near(visible, _on_ring(row), max(4.0, 0.2 * truth["spacing_px"])).sum()
    distance = np.linalg.norm(truth["position_m"])
    off = [abs(np.linalg.norm(pose["position_m"]) / distance - 1) for pose in row["candidates"]]
    fits = [
        share < 0.05 and _angle_deg(pose["normal"], truth["normal"]) < 5
        for share, pose in zip(off, row["candidates"], strict=True)
    ]
    if fits[row["selected"]]:
        return "right", False
    if lamps < 0.75 * len(_on_ring(row)) or off[row["selected"]] > 0.10:
        return "false", True
    return ("twin" if any(fits) else "wrong"), True
