"""Score drawn pictures of what is met in tanks and at sea, kind by kind: ``python -m tests.bench.seen KIND...``."""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
from dockpose import Dock, Tracker, estimate

from tests.bench import seen_others as others
from tests.bench import seen_scenes as scenes
from tests.bench.floors import at_least, at_most
from tests.bench.lamps import DIAMETER_M
from tests.bench.seen_scenes import Shown
from tests.support.judged import judged

WORDS = ("right", "undecided", "asked", "refused", "wrong", "sure")
_ASKED = re.compile(r"degrees? off|angles_deg|--lights|lights=4")


@dataclass(frozen=True)
class Result:
    """What came of a picture."""

    # As of ``Judgement``; "asked", refused with the angles seen or the number of lights to be told; where there is no
    # dock "wrong" or "sure"
    outcome: str
    ms: float
    message: str


@dataclass(frozen=True)
class Kind:
    """How pictures are drawn, and the shares of all such that are right, may be asked about, or are wrong."""

    draw: Callable[[np.random.Generator], Shown]
    right: float = 0.99
    asked_will_do: bool = False
    most_wrong: float = 0.01
    most_sure: float = 0.0  # of it and wrong
    pictures: int = 20
    look: Callable[[Kind, Shown, np.random.Generator], Result] | None = None

    def misses(self, results: Sequence[Result]) -> str:
        """Say what is missed; "" where nothing is."""
        counts = Counter(one.outcome for one in results)
        good, wrong = counts["right"] + counts["asked"] * self.asked_will_do, counts["wrong"] + counts["sure"]
        least, most = at_least(self.right, len(results)), at_most(self.most_wrong, len(results))
        most_sure = at_most(self.most_sure, len(results))
        told = [f"right {good}, at least {least}"] if good < least else []
        told += [f"wrong {wrong}, at most {most}"] if wrong > most else []
        told += [f"sure and wrong {counts['sure']}, at most {most_sure}"] if counts["sure"] > most_sure else []
        return "; ".join(told)


def look_once(_kind: Kind, shown: Shown, _rng: np.random.Generator) -> Result:
    found = estimate(shown.image, shown.camera, shown.dock)
    outcome = judged(found, *shown.truth).outcome
    if outcome == "refused" and _ASKED.search(found.message):
        outcome = "asked"
    return Result(outcome, found.elapsed_ms, found.message)


def look_at_both(_kind: Kind, shown: Shown, _rng: np.random.Generator) -> Result:
    """Right where the picture at three times its levels has the same lights, to half a pixel."""
    found = estimate(shown.image, shown.camera, shown.dock)
    bright = estimate(3 * shown.image, shown.camera, shown.dock)
    lights = [
        np.empty((0, 2)) if one.markers is None or one.ring is None else one.markers.points_px[one.ring.on_ring]
        for one in (found, bright)
    ]
    same = len(lights[0]) == len(lights[1]) and found.status == bright.status
    if same and len(lights[0]):
        apart = np.linalg.norm(lights[0][:, None] - lights[1], axis=2).min(axis=1)
        same = bool(apart.max() < 0.5)
    outcome = "wrong" if not same else "right" if found.status == "ok" else "refused"
    return Result(outcome, found.elapsed_ms, f"{len(lights[0])} and {len(lights[1])} lights: {bright.message}")


def follow(_kind: Kind, _shown: Shown, rng: np.random.Generator) -> Result:
    """Right where the track stays with a dock that is wholly in view all the time, while another comes beside it."""
    frames = others.second_dock_comes(rng)
    tracker, near, slowest = None, [], 0.0
    for number, (first, second_m) in enumerate(frames):
        assert first.position_m is not None
        tracker = tracker or Tracker(first.camera, first.dock)
        tracked = tracker.see(first.image, 0.1 * number)
        slowest = max(slowest, tracked.estimate.elapsed_ms)
        if number < 4:
            continue
        if tracked.pose is None:
            near.append("refused")
            continue
        away = [float(np.linalg.norm(tracked.pose.position_m - place)) for place in (first.position_m, second_m)]
        near.append("right" if away[0] < min(away[1], 0.1 * np.linalg.norm(first.position_m)) else "wrong")
    outcome = next((word for word in ("wrong", "refused") if word in near), "right")
    return Result(outcome, slowest, f"on the first in {near.count('right')} of {len(near)} frames")


KINDS = {
    "noise-haze": Kind(scenes.hazy),
    "noise-dark": Kind(scenes.dark_haze, right=0.95),
    "noise-slope": Kind(scenes.on_a_slope),
    "noise-discs": Kind(scenes.dim_discs),
    "noise-broad": Kind(scenes.broad_discs),
    "faint-slope": Kind(scenes.faint_on_a_slope),
    "faint-haze": Kind(partial(scenes.hazy, above=(2, 3))),
    "faint-dark": Kind(partial(scenes.dark_haze, above=(2, 3.5))),
    "faint-none": Kind(scenes.noise_alone, right=0.0, most_wrong=0.0, pictures=60),
    "copy": Kind(scenes.beside_a_copy, right=0.91, most_wrong=0.09, pictures=100),  # asked: 0.95 and 0.01
    "contrast": Kind(scenes.dark_enough_to_stretch, 0.95, most_wrong=0.05, look=look_at_both),
    "halos": Kind(scenes.in_glare, most_wrong=0.0),
    "builder-spaced": Kind(scenes.spaced_by_eye, 0.85, asked_will_do=True, most_wrong=0.1),
    "builder-placed": Kind(scenes.built_by_hand, asked_will_do=True),
    "learnt-3mm": Kind(scenes.learnt(0.003)),
    "learnt-5mm": Kind(scenes.learnt(0.005)),
    "mirror-below": Kind(others.mirrored((0, 1, 0.2), (0.7, 1.0))),
    "mirror-above": Kind(others.mirrored((0, -1, 0.2), (0.7, 1.0))),
    "mirror-side": Kind(others.mirrored((1, 0, 0.2), (0.5, 1.3))),
    "mirror-floor": Kind(others.mirrored((0, 1, 0.3), (0.2, 0.5), soft=True)),
    "concentric": Kind(others.with_every_second_inside, right=0.95),
    "rim": Kind(others.with_lamps_on_its_rim),
    "few-stray": Kind(others.four_and_a_stray),
    "few-unknown": Kind(others.four_of_unknown_number, asked_will_do=True),
    "many-told": Kind(others.many(True)),
    "many-unknown": Kind(others.many(False)),
    "strings-told": Kind(others.string_of_lamps(True), right=0.0, most_sure=0.01, pictures=100),  # asked: none
    "strings-unknown": Kind(others.string_of_lamps(False), 0.0, most_wrong=0.1, most_sure=0.05, pictures=40),
    "specks": Kind(others.specks, right=0.0, most_wrong=0.05, pictures=60),
    "arcs": Kind(others.short_arc, right=0.0, pictures=40),
    "second-dock": Kind(others.nothing, look=follow, right=1.0, most_wrong=0.0),
}
# Pictures of many lamps, and how many times a good picture's time they take: 5 was asked when that took 5 ms.
MOST_GOOD_ONES = 60.0
SLOW = {
    "60 in a ring, N unknown": (others.ring_of_60, None),
    "60 anywhere, N unknown": (others.lamps_anywhere(60), None),
    "400 anywhere, N 10": (others.lamps_anywhere(400), 10),
    "400 anywhere, N unknown": (others.lamps_anywhere(400), None),
}


def run(job: tuple[str, int]) -> Result:
    """Draw one picture of a kind and look at it."""
    name, seed = job
    kind, rng = KINDS[name], np.random.default_rng([seed, *name.encode()])
    shown = kind.draw(rng)
    return (kind.look or look_once)(kind, shown, rng)


def head() -> str:
    return f"{'':18}" + "".join(f"{word:>9}" for word in (*WORDS, "of", "ms")) + "   missed"


def row(name: str, results: Sequence[Result]) -> str:
    """A line of the table: how often each outcome, the median time, and what is missed."""
    counts = Counter(one.outcome for one in results)
    cells = [*(counts[word] for word in WORDS), len(results), round(float(np.median([one.ms for one in results])))]
    return f"{name:18}" + "".join(f"{cell:9}" for cell in cells) + f"   {KINDS[name].misses(results)}"


def ratios() -> dict[str, float]:
    """How many times a good picture's processor time each of ``SLOW`` takes."""
    good = others.good_picture()

    def took_ms(shown: Shown, dock: Dock, repeats: int) -> float:
        times = []
        for _ in range(repeats + 1):  # the first loads what was compiled
            began_s = time.process_time()
            estimate(shown.image, shown.camera, dock)
            times.append(time.process_time() - began_s)
        return 1000 * float(np.median(times[1:]))

    usual_ms = took_ms(good, good.dock, 30)
    return {
        name: took_ms(draw(np.random.default_rng(0)), Dock(DIAMETER_M, lights), 2) / usual_ms
        for name, (draw, lights) in SLOW.items()
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table. Returns 1 where something is missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.seen", description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"as it begins: {', '.join(KINDS)}, time; or all")
    parser.add_argument("--pictures", type=int, metavar="N", help="of each kind (default: 20 of most)")
    parser.add_argument("--processes", type=int, default=2, metavar="N", help="worker processes (default: 2)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write the pictures into this folder")
    parser.add_argument("--messages", action="store_true", help="tell what was said of each that is not right")
    options = parser.parse_args(arguments)
    named = tuple(options.kinds) or ("",)
    chosen = [name for name in KINDS if name.startswith(named)]
    timed = "time".startswith(named)
    if not chosen and not timed:
        parser.error(f"no kind is called {' '.join(named)}: {', '.join(KINDS)}, time")
    print(head())
    missed, start_s = 0, time.monotonic()
    with get_context("spawn").Pool(options.processes) as pool:
        for name in chosen:
            seeds = range(options.pictures or KINDS[name].pictures)
            results = pool.map(run, [(name, seed) for seed in seeds], chunksize=2)
            print(row(name, results), flush=True)
            missed += bool(KINDS[name].misses(results))
            for seed, one in enumerate(results):
                if options.messages and one.outcome != "right":
                    print(f"    {seed}: {one.outcome} | {one.message}")
                if options.out is not None:
                    options.out.mkdir(parents=True, exist_ok=True)
                    image = KINDS[name].draw(np.random.default_rng([seed, *name.encode()])).image
                    cv2.imwrite(str(options.out / f"{name}_{seed:02}_{one.outcome}.png"), image)
    if timed:
        for name, ratio in ratios().items():
            print(f"{name:28} {ratio:6.1f} of a good picture's time (asked {MOST_GOOD_ONES:g})")
            missed += ratio > MOST_GOOD_ONES
    print(f"{(time.monotonic() - start_s) / 60:.1f} minutes, {missed} missed")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
