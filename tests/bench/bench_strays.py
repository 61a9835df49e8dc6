"""Rings among stray lamps: complete, half seen, uneven; each drawn as a picture of small lamps and estimated."""

import math
from dataclasses import dataclass
from multiprocessing import Pool

import numpy as np
from dockpose import Dock, Estimate, estimate
from dockpose.pose.circle import angles_of, rotation_from_angles

from tests.bench.lamps import unit_normal
from tests.bench.seen_scenes import circle, closest_px, even
from tests.support.scenes import CAMERA

DIAMETER_M = 0.30
NOISE_PX = 0.3
SIGMA_PX = 1.6  # of a lamp's picture
CLOSEST_PX = 12.0  # two lamps nearer than this run together
SURE = 0.9
PICTURES = 100


@dataclass(frozen=True)
class Drawn:
    """A picture, and the dock's position and normal in it."""

    image: np.ndarray
    position_m: np.ndarray
    normal: np.ndarray


def drawn(rng: np.random.Generator, angles_rad: np.ndarray, strays: int) -> Drawn:
    """Lights of a dock at some angles, in view, apart, off by the noise, and strays anywhere, up to twice as bright."""
    size = np.array([CAMERA.width, CAMERA.height])
    while True:
        tilt, around, z = rng.uniform(0.1, 0.7), rng.uniform(0, 2 * math.pi), rng.uniform(0.6, 1.6)
        normal = unit_normal(tilt, around)
        position = z * np.array([*(rng.uniform(-0.3, 0.3, 2) * [1, 0.7]), 1.0])
        ring = circle(angles_rad + rng.uniform(0, 2 * math.pi), DIAMETER_M / 2)
        rotation = rotation_from_angles(*angles_of(normal))
        points = CAMERA.project(position + ring @ rotation.T) + rng.normal(0, NOISE_PX, (len(ring), 2))
        if (points > 10).all() and (points < size - 10).all() and closest_px(points) > CLOSEST_PX:
            break
    while len(points) < len(angles_rad) + strays:
        stray = rng.uniform(10, size - 10)
        if np.linalg.norm(points - stray, axis=1).min() > CLOSEST_PX:
            points = np.vstack([points, stray])
    light = rng.normal(15, 1.5, (CAMERA.height, CAMERA.width))
    for (x, y), level in zip(points.tolist(), rng.uniform(100, 200, len(points)).tolist(), strict=True):
        left, top = round(x) - 8, round(y) - 8
        across = np.exp(-((np.arange(left, left + 17) - x) ** 2) / (2 * SIGMA_PX**2))
        down = np.exp(-((np.arange(top, top + 17) - y) ** 2) / (2 * SIGMA_PX**2))
        light[top : top + 17, left : left + 17] += level * np.outer(down, across)
    return Drawn(np.clip(light, 0, 255).astype(np.uint8), position, normal)


def outcome(found: Estimate, scene: Drawn) -> str:
    """What came of it: "right", "undecided" (another pose, but not sure), "not seen", or "wrong" (sure of another)."""
    pose = found.selected
    if found.status != "ok" or pose is None:
        return "not seen"
    near = np.linalg.norm(pose.position_m - scene.position_m) < 0.05 * scene.position_m[2]
    if near and pose.normal @ scene.normal > math.cos(math.radians(8)):
        return "right"
    return "wrong" if (pose.probability or 0) > SURE else "undecided"


def uneven(rng: np.random.Generator, count: int) -> np.ndarray:
    """Angles drawn at random, no two lights nearer than half the even spacing."""
    gaps = math.pi / count + math.pi * rng.dirichlet(np.ones(count))
    return np.cumsum(gaps)


def complete(job: tuple[int, int]) -> str:
    """All lights of a dock of so many, among twenty strays."""
    count, _ = job
    scene = drawn(np.random.default_rng([1, *job]), even(count), 20)
    return outcome(estimate(scene.image, CAMERA, Dock(DIAMETER_M, count)), scene)


def half(job: tuple[int, int]) -> str:
    """Five lights of ten, with so many strays."""
    strays, _ = job
    rng = np.random.default_rng([2, *job])
    scene = drawn(rng, even(10)[rng.choice(10, 5, replace=False)], strays)
    return outcome(estimate(scene.image, CAMERA, Dock(DIAMETER_M, 10)), scene)


def known(job: tuple[int, int, int]) -> str:
    """A dock given by its angles, 5 to 12 lights, with strays; so many lights are missing."""
    strays, missing, _ = job
    rng = np.random.default_rng([3, *job])
    # One of five that is missing leaves four among others, which is another task.
    angles = uneven(rng, int(rng.integers(5 + missing, 13)))
    lit = rng.choice(len(angles), len(angles) - missing, replace=False)
    scene = drawn(rng, angles[lit], strays)
    return outcome(
        estimate(scene.image, CAMERA, Dock(DIAMETER_M, angles_deg=tuple(np.degrees(angles).tolist()))), scene
    )


def shares(task, jobs) -> dict[str, float]:
    with Pool(2) as pool:
        found = pool.map(task, jobs, chunksize=5)
    return {name: found.count(name) / len(found) for name in ("right", "undecided", "not seen", "wrong")}


def row(name: str, share: dict[str, float]) -> None:
    print(f"{name:34}" + "".join(f"{word} {100 * value:5.1f}   " for word, value in share.items()))


# Six lights among twenty strays leave room for rings of chance; ten leave hardly any.
COMPLETE = {6: 0.90, 8: 0.97, 10: 0.99, 12: 0.99, 16: 0.99}


def test_a_complete_ring_among_twenty_strays():
    print(f"\nComplete ring among 20 strays, centres good to {NOISE_PX} px, {PICTURES} pictures each, in %")
    found = {}
    for count in COMPLETE:
        found[count] = shares(complete, [(count, seed) for seed in range(PICTURES)])
        row(f"{count} lights", found[count])
    assert not [count for count, asked in COMPLETE.items() if found[count]["right"] < asked]
    assert max(share["wrong"] for share in found.values()) <= 0.01


def test_five_of_ten_with_strays_are_right_or_undecided():
    print(f"\nFive of ten lights with strays, {PICTURES} pictures each, in %; wrong: with p > {SURE}")
    found = [shares(half, [(strays, seed) for seed in range(PICTURES)]) for strays in (1, 2, 3)]
    for strays, share in enumerate(found, start=1):
        row(f"{strays} strays", share)
    together = {name: float(np.mean([share[name] for share in found])) for name in found[0]}
    assert together["right"] + together["undecided"] >= 0.97
    assert together["wrong"] <= 0.01


def test_uneven_docks_with_strays():
    print(f"\nUneven docks of 5 to 12 lights, angles known, {PICTURES} pictures each, in %")
    found = []
    for strays in (1, 3, 10, 30):
        found.append(shares(known, [(strays, 0, seed) for seed in range(PICTURES)]))
        row(f"all lights, {strays} strays", found[-1])
    missing = shares(known, [(0, 1, seed) for seed in range(PICTURES)])
    row("one light missing, no stray", missing)
    assert np.mean([share["right"] for share in found]) >= 0.98
    assert missing["right"] >= 0.95
