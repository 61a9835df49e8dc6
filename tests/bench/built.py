"""Score docks as people build them, told and not, alone and among strays: ``python -m tests.bench.built [KIND...]``."""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from collections.abc import Sequence
from multiprocessing import get_context

import numpy as np
from dockpose import Dock, estimate

from tests.bench.lamps import DIAMETER_M
from tests.bench.seen_scenes import Lamps, Shown, circle, closest_px, dock_drawn, drawn, even

LIGHTS = (5, 6, 8, 12, 24)
# Standard deviations of the lights' places along and across the rim, in radii, and the share that must be found where
# the number of lights is told, and where it is not.
KINDS = {
    "2 %": (0.02, 0.02, 0.97, 0.95),
    "3 %": (0.03, 0.03, 0.95, 0.90),
    "4 deg": (math.radians(4), 0.01, 0.95, 0.90),
    "5 %": (0.05, 0.05, 0.80, 0.70),
    "6 deg": (math.radians(6), 0.01, 0.80, 0.70),
    "strewn": (math.inf, math.inf, 0.998, 0.998),
}
NUMBERS = (5, 6, 8, 9, 11, 12, 15, 20)  # that are told where ten even lights are in view
STREWN = "strewn"  # anywhere in the picture: no ring, and right to be refused
# Of so many lights, which stand 15 degrees apart, neighbours that are off by so much can change places.
_NOT_24 = ("4 deg", "6 deg")
AMONG_STRAYS = ("3 %", "4 deg", STREWN)
STRAYS, ASKED_AMONG_STRAYS, ASKED_NAMED = 10, 0.85, 0.95
WITHIN = 0.05  # of the range
SURE = 0.95
WORDS = ("right", "refused", "wrong", "sure")


def built(rng: np.random.Generator, kind: str, lights: int, strays: int, is_told: bool) -> Shown:
    """A dock three diameters away on black, its lights off their places; ``strays`` other lamps around it."""
    along, across = KINDS["2 %" if kind == STREWN else kind][:2]
    angles = even(lights) + rng.normal(0, along, lights)
    points = circle(angles) * (1 + rng.normal(0, across, lights))[:, None]
    lamps = dock_drawn(rng, points, Dock(DIAMETER_M, lights if is_told else None), diameters=3, tilt_deg=(0, 45))
    if kind == STREWN:
        radii_px = lamps.radii_px
        lamps.points_px, lamps.radii_px, lamps.share = np.empty((0, 2)), np.empty(0), np.empty(0)
        lamps.position_m = None
        add_strays(rng, lamps, lights, radii_px)
    add_strays(rng, lamps, strays, lamps.radii_px)
    return drawn(rng, lamps, background=5.0)


def add_strays(rng: np.random.Generator, lamps: Lamps, number: int, radii_px: np.ndarray) -> None:
    """Add lamps anywhere in the picture, as large as some, as bright as the dock's, and apart from all others."""
    camera, least_px = lamps.camera, 2.6 * float(radii_px.max())
    while number:
        place = rng.uniform(10, [camera.width - 10, camera.height - 10])
        points_px = np.vstack([lamps.points_px, place])
        if closest_px(points_px) > least_px:
            lamps.add(place[None], radii_px[:1], rng.uniform(0.75, 1.0, 1))
            number -= 1


def run(job: tuple[str, int, int, bool, int]) -> tuple[str, str, float, bool]:
    """What came of a picture, the message, the time in ms, and whether the range's interval of 95 % holds."""
    kind, lights, strays, is_told, seed = job
    rng = np.random.default_rng([seed, lights, strays, *kind.encode()])
    shown = built(rng, kind, lights, strays, is_told)
    found = estimate(shown.image, shown.camera, shown.dock)
    pose = found.selected
    if found.status != "ok" or pose is None:
        return "right" if kind == STREWN else "refused", found.message, found.elapsed_ms, False
    outcome, holds = "wrong" if (pose.probability or 0) * (found.detection or 0) < SURE else "sure", False
    if shown.position_m is not None:
        off_m = pose.position_m - shown.position_m
        is_right = np.linalg.norm(off_m) < WITHIN * np.linalg.norm(shown.position_m)
        outcome = "right" if is_right else outcome
        holds = pose.sigma_position_m is not None and bool(abs(off_m[2]) < 1.96 * pose.sigma_position_m[2])
    return outcome, found.message, found.elapsed_ms, holds


def run_number(job: tuple[int, int]) -> tuple[str, str, float, bool]:
    """What came of ten even lights where another number was told; right where the message names them."""
    told, seed = job
    rng = np.random.default_rng([seed, told])
    lamps = dock_drawn(rng, circle(even(10)), Dock(DIAMETER_M, told), diameters=3, tilt_deg=(0, 45))
    shown = drawn(rng, lamps, background=5.0)
    found = estimate(shown.image, shown.camera, shown.dock)
    is_named = found.status != "ok" and found.message.startswith("10 evenly spaced lights")
    sure = found.selected is not None and (found.selected.probability or 0) * (found.detection or 0) >= SURE
    outcome = "right" if is_named else "refused" if found.status != "ok" else "sure" if sure else "wrong"
    return outcome, found.message, found.elapsed_ms, False


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table. Returns 1 where something is missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.built", description=__doc__)
    kinds = ", ".join(KINDS).replace("%", "%%")
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"{kinds} (default: all)")
    parser.add_argument("--pictures", type=int, default=30, metavar="N", help="of each kind and number of lights")
    parser.add_argument("--processes", type=int, default=2, metavar="N", help="worker processes (default: 2)")
    parser.add_argument("--messages", action="store_true", help="tell what was said of each that is not right")
    options = parser.parse_args(arguments)
    missed = 0
    print(f"{'':34}" + "".join(f"{word:>9}" for word in (*WORDS, "± holds", "ms")) + "   missed")
    with get_context("spawn").Pool(options.processes) as pool:
        for strays in (0, STRAYS):
            for is_told in (True, False):
                for kind in options.kinds or KINDS:
                    if strays and kind not in AMONG_STRAYS:
                        continue
                    for lights in LIGHTS:
                        if lights == 24 and kind in _NOT_24:
                            continue
                        jobs = [(kind, lights, strays, is_told, seed) for seed in range(options.pictures)]
                        results = pool.map(run, jobs, chunksize=3)
                        asked = ASKED_AMONG_STRAYS if strays and kind != STREWN else KINDS[kind][2 if is_told else 3]
                        name = f"{kind}, {lights} lights{'' if is_told else ', unknown'}"
                        missed += not report(f"{name}{', strays' if strays else ''}", results, asked, options.messages)
        for told in () if options.kinds else NUMBERS:
            results = pool.map(run_number, [(told, seed) for seed in range(options.pictures)], chunksize=3)
            missed += not report(f"10 lights, {told} told", results, ASKED_NAMED, options.messages)
    return 1 if missed else 0


def report(name: str, results: Sequence[tuple[str, str, float, bool]], asked: float, messages: bool) -> bool:
    """Print a line of the table; returns whether as many are right as asked."""
    counts, total = Counter(one[0] for one in results), len(results)
    is_enough = counts["right"] >= asked * total
    holds = sum(one[3] for one in results if one[0] != "refused")
    cells = [*(counts[word] for word in WORDS), f"{100 * holds / max(1, total - counts['refused']):.0f} %"]
    cells.append(f"{np.median([one[2] for one in results]):.0f}")
    told = "" if is_enough else f"   right {counts['right'] / total:.0%}, asked {asked:.0%}"
    print(f"{name:34}" + "".join(f"{cell:>9}" for cell in cells) + told, flush=True)
    for outcome, message, *_ in results:
        if messages and outcome != "right":
            print(f"    {outcome} | {message}")
    return is_enough


if __name__ == "__main__":
    sys.exit(main())
