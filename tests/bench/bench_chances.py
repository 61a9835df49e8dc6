"""How often the chosen pose is right beside the p that it is given, 2 to 9 m away, drawn and photographed.

``python -m tests.bench.bench_chances [--pictures N] [--seed N] [--data DATA]``. A photograph is made as small as its
ring would be of a dock of 30 cm at 700 px, turned, and given a camera's noise and compression.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from itertools import pairwise
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.pose.circle import rotation_from_angles
from scipy.stats import binom

from tests.bench.bench_chosen import BINS, run
from tests.bench.marked import Marks, came_of, photographs, shown

DATA, PICTURES, SEED = Path("../shared/data"), 200, 31
NEAREST_PX, FARTHEST_PX = 52.0, 12.0  # radii of a ring of 30 cm by 700 px, 2 and 9 m away
_CHANCE = 0.001


def drawn(job: tuple[int, int]) -> tuple[float, bool] | None:
    """The p of a drawn dock's chosen pose, and whether it is the nearer one; None where none is found."""
    came = run(("2 to 9 m", *job)).judged
    return (came.probability, came.nearer) if came.found else None


def photographed(job: tuple[Path, str, int]) -> tuple[float, bool] | None:
    """The same of a photograph from afar; None where its ring is not found, or its marks tell no side."""
    folder, name, seed = job
    cv2.setNumThreads(1)
    rng = np.random.default_rng([seed, *name.encode()])
    image, camera, number, rings = shown(folder, name)
    if not rings[0].is_sided:
        return None
    size = float(np.linalg.norm(rings[0].places_px - rings[0].places_px.mean(axis=0), axis=1).max())
    scale = float(np.exp(rng.uniform(*np.log([FARTHEST_PX, NEAREST_PX])))) / size
    if scale > 1:
        return None
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    height, width = small.shape[:2]
    middle = (width - 1) / 2, (height - 1) / 2
    focal = camera.fx * width / camera.width
    turn = cv2.getRotationMatrix2D(middle, rng.uniform(0, 360), 1.0)
    small = cv2.warpAffine(small, turn, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    noisy = np.clip(small + rng.normal(0, rng.uniform(1, 4), small.shape), 0, 255).astype(np.uint8)
    _, coded = cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(60, 98))])
    seen = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)
    assert seen is not None
    far = Camera(focal, focal, *middle, width, height)
    moved = [_moved(one, width / camera.width, turn) for one in rings]
    came = came_of(estimate(seen, far, Dock(0.10, number)), moved)
    return (came.judged.probability, bool(came.side)) if came.judged.right else None


def _moved(marks: Marks, scale: float, turn: np.ndarray) -> Marks:
    """Marks in the picture that is so small, and turned (2, 3)."""
    marks_px, places_px = (
        (scale * (points + 0.5) - 0.5) @ turn[:, :2].T + turn[:, 2] for points in (marks.marks_px, marks.places_px)
    )
    return Marks(marks_px, places_px, max(1.5, scale * marks.within_px), turn[:, :2] @ marks.rising, marks.is_sided)


def counted(pairs: Sequence[tuple[float, bool] | None]) -> list[tuple[str, int, int, float, int, int]]:
    """For each bin of p its name, how many there are and how many wrong, and how many may be: mean, least and most."""
    rows = []
    for low, high in pairwise(BINS):
        part = [pair for pair in pairs if pair is not None and low <= pair[0] < high]
        wrong, share = sum(not right for _, right in part), float(np.mean([1 - p for p, _ in part] or [0.0]))
        least, most = (int(binom.ppf(chance, len(part), share)) for chance in (_CHANCE, 1 - _CHANCE))
        rows.append((f"p {low:.2f} to {min(1, high):.2f}", len(part), wrong, len(part) * share, max(0, least), most))
    return rows


def report(name: str, pairs: Sequence[tuple[float, bool] | None]) -> list[str]:
    """Print the bins; returns those beyond chance."""
    print(f"\n{name}: {sum(pair is not None for pair in pairs)} of {len(pairs)} found")
    beyond = []
    for of, count, wrong, mean, least, most in counted(pairs):
        print(f"  {of}: {wrong} wrong of {count}; {mean:.1f} said, {least} to {most} by chance", flush=True)
        beyond += [f"{name}, {of}"] if wrong > most else []
    return beyond


def jobs_of(data: Path, pictures: int, seed: int) -> list[tuple[Path, str, int]]:
    """So many photographs from afar, each as often as any other."""
    known = photographs(data)
    each = math.ceil(pictures / max(1, len(known)))
    return [(folder, name, 1000 * seed + number) for folder, name in known for number in range(each)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_chances", description=__doc__)
    parser.add_argument("--pictures", type=int, default=1000, metavar="N", help="of each sort")
    parser.add_argument("--seed", type=int, default=SEED, metavar="N")
    parser.add_argument("--data", type=Path, default=DATA, metavar="DATA", help="folder of the sets of photographs")
    parser.add_argument("--processes", type=int, default=2, metavar="N")
    options = parser.parse_args(arguments)
    with get_context("spawn").Pool(options.processes) as pool:
        seeds = [(options.seed, number) for number in range(options.pictures)]
        beyond = report("drawn", pool.map(drawn, seeds, 3))
        beyond += report("photographed", pool.map(photographed, jobs_of(options.data, options.pictures, options.seed)))
    print("\nbeyond chance:", ", ".join(beyond) or "none")
    return 0


@pytest.fixture(scope="module")
def pool():
    with get_context("spawn").Pool(2) as pool:
        yield pool


def test_drawn_docks_are_right_as_often_as_is_said(pool: Pool):
    pairs = pool.map(drawn, [(SEED, number) for number in range(PICTURES)], 3)
    assert sum(pair is not None for pair in pairs) > 0.9 * PICTURES
    assert not report("drawn", pairs)


def test_photographed_rings_are_right_as_often_as_is_said(pool: Pool):
    jobs = jobs_of(DATA, PICTURES, SEED)
    if not jobs:
        pytest.skip(f"{DATA} is not there")
    pairs = pool.map(photographed, jobs, 3)
    assert sum(pair is not None for pair in pairs) > 0.2 * len(jobs)
    assert not report("photographed", pairs)


def test_marks_of_some_lights_tell_the_places_of_all():
    camera = Camera(1000.0, 1000.0, 499.5, 399.5, 1000, 800)
    rotation = rotation_from_angles(0.4, -0.3, 0.1)

    def seen(lights: np.ndarray, number: int) -> np.ndarray:
        angles = math.tau * lights / number
        ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
        return camera.project(ring @ rotation.T + [0.05, -0.02, 0.9])

    lit = np.array([0, 3, 9, 12, 17, 20])
    marks = Marks.of({"N": 24, "lights": seen(lit, 24).tolist()}, camera)
    of_all = seen(np.arange(24.0), 24)
    assert np.linalg.norm(marks.places_px[:, None] - of_all, axis=2).min(axis=0).max() < 0.1
    assert marks.is_sided
    assert marks.are_of(of_all)
    assert marks.are_of(of_all[3:21])  # most of them unlit
    assert not marks.are_of(of_all[1:3])  # none of what is marked
    assert not marks.are_of(seen(np.arange(24) + 0.5, 24))  # between its lights
    assert not marks.are_of(of_all + [200.0, 0.0])


if __name__ == "__main__":
    main()
