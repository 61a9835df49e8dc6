"""Which of the two poses is chosen, and how sure: ``python -m tests.bench.bench_chosen [KIND...] [--data DATA]``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path

import msgspec
import numpy as np
import pytest
from dockpose import Dock, Tracker, estimate
from dockpose.pose.circle import CirclePose, rotation_from_angles

from tests.bench.bench_built import built
from tests.bench.floors import at_least, at_most
from tests.bench.lamps import DIAMETER_M, draw_lamps
from tests.bench.marked import Came, photographs, rising_of, run_photograph
from tests.bench.seen_scenes import Shown, circle, closest_px, dock_drawn, drawn, even, on_picture, seen_from
from tests.support.judged import SURE, judged

BINS = (0.5, 0.8, 0.95, 0.99, 1.0001)
_SEED = 2026


def plain(rng: np.random.Generator, is_told: bool, most_missing: int = 2) -> Shown:
    """A dock a few diameters away on dark water, none to two of its lamps out."""
    lights = int(rng.integers(7, 25))
    return _drawn(rng, lights, int(rng.integers(0, most_missing + 1)), is_told, share=(0.14, 0.42))


def hard(rng: np.random.Generator, is_told: bool) -> Shown:
    """The same farther away, dim, in noise."""
    lights = int(rng.integers(7, 17))
    missing, noise = int(rng.integers(0, 3)), rng.uniform(2, 4)
    return _drawn(rng, lights, missing, is_told, share=(0.08, 0.2), above=noise * rng.uniform(6, 20), noise=noise)


def _drawn(
    rng: np.random.Generator,
    lights: int,
    missing: int,
    is_told: bool,
    share: tuple[float, float],
    noise: float = 1.5,
    above: float | None = None,
) -> Shown:
    kept = np.sort(rng.choice(lights, lights - missing, replace=False))
    dock = Dock(DIAMETER_M, lights if is_told else None)
    lamps = dock_drawn(rng, circle(even(lights)[kept]), dock, share=share, tilt_deg=(8, 45))
    return drawn(rng, lamps, background=rng.uniform(3, 40), noise=noise, above=above)


def of_another_camera(rng: np.random.Generator, factor: float) -> Shown:
    """Twenty-four lights, and a camera file with so many times the true focal length."""
    shown = _drawn(rng, 24, int(rng.integers(0, 2)), rng.random() < 0.5, share=(0.2, 0.42))
    camera = shown.camera
    wrong = msgspec.structs.replace(camera, fx=factor * camera.fx, fy=factor * camera.fy)
    return Shown(shown.image, wrong, shown.dock, shown.position_m, shown.normal)


def hand_built(rng: np.random.Generator) -> Shown:
    """A dock whose lamps are off their places by 3 %, 4 degrees or 6 degrees."""
    kind = ("3 %", "4 deg", "6 deg")[rng.integers(3)]
    return built(rng, kind, int(rng.choice([6, 8, 12])), 0, is_told=True)


def far(rng: np.random.Generator) -> Shown:
    """Eight to twelve lights on 0.30 m, 2 to 9 m away, tilted by up to 40 degrees."""
    lights = int(rng.integers(8, 13))
    dock = Dock(0.30, lights if rng.random() < 0.7 else None)
    points = circle(even(lights), 0.15)[np.sort(rng.choice(lights, lights - int(rng.integers(0, 2)), replace=False))]
    metres = float(np.exp(rng.uniform(*np.log([2, 9]))))
    lamps = dock_drawn(rng, points, dock, diameters=metres / 0.30, tilt_deg=(2, 40), focal=(0.8, 1.5), spacing_px=4.5)
    noise = rng.uniform(1, 5)
    above = None if rng.random() < 0.3 else min(220.0, noise * float(np.exp(rng.uniform(*np.log([5, 50])))))
    return drawn(rng, lamps, background=rng.uniform(3, 40), noise=noise, above=above, jpeg=(60, 97))


def with_a_lamp_behind(
    rng: np.random.Generator,
    is_lit: bool = True,
    is_told: bool = True,
    depth: float = 1 / 6,
    number: int = 1,
    off: float = 0.01,
) -> Shown:
    """Eight lamps as hands build them, 3 degrees and 2 % off, and one so many diameters behind the middle of the ring.

    It is as far off its place as the others across the rim.
    """
    angles = even(8) + rng.normal(0, math.radians(3), 8)
    ring = circle(angles) * (1 + rng.normal(0, 0.02, 8))[:, None]
    places = [[0.0, 0.0, (n + 1) * depth * DIAMETER_M] for n in range(number)]
    built_m = np.vstack([ring, np.array(places) + rng.normal(0, off, (number, 3)) * DIAMETER_M])
    dock = Dock(DIAMETER_M, 8, extra_lights_m=places if is_told else ())
    diameters = float(np.exp(rng.uniform(*np.log([4, 20]))))
    lamps = dock_drawn(rng, built_m, dock, diameters=diameters, tilt_deg=(3, 40), spacing_px=3.5)
    if not is_lit:
        for name in ("points_px", "radii_px", "share"):
            setattr(lamps, name, getattr(lamps, name)[:8])
    return drawn(rng, lamps, background=rng.uniform(3, 40))


def sevens(rng: np.random.Generator) -> Shown:
    """Seven lit things at places of a ring of 19 to 24, as part of other things; no dock."""
    lights = int(rng.integers(19, 25))
    kept = np.sort(rng.choice(lights, lights // 3 + int(rng.integers(0, 2)), replace=False))
    lamps = dock_drawn(rng, circle(even(lights)[kept]), Dock(DIAMETER_M), share=(0.2, 0.42))
    lamps.position_m = None
    return drawn(rng, lamps, background=rng.uniform(3, 40))


FILMS = ("films, wrong focal", "films, lamps off", "films, files right")
_FRAMES = 24


def film(kind: str, rng: np.random.Generator) -> list[Shown]:
    """An approach or a hover, with a wrong focal length in the camera file, lamps off their places, or neither."""
    lights = int(rng.choice([6, 8, 10, 12] if kind == FILMS[1] else [6, 8, 10, 12, 16, 24]))
    angles, radii = even(lights), np.ones(lights)
    if kind == FILMS[1]:
        along, across = ((0.03, 0.03), (math.radians(4), 0.01), (math.radians(6), 0.01))[rng.integers(3)]
        angles, radii = angles + rng.normal(0, along, lights), 1 + rng.normal(0, across, lights)
    points = circle(angles) * radii[:, None]
    dock = Dock(DIAMETER_M, lights if rng.random() < 0.7 else None)
    begun = dock_drawn(rng, points, dock, share=(0.1, 0.25), tilt_deg=(5, 40))
    camera, place, normal = begun.camera, begun.position_m, begun.normal
    assert place is not None
    assert normal is not None
    factor = float(rng.choice([0.6, 0.75, 1.3, 1.6])) if kind == FILMS[0] else 1.0
    told = msgspec.structs.replace(camera, fx=factor * camera.fx, fy=factor * camera.fy)
    nearer, swing, turned = rng.choice([1.0, 0.6]), rng.uniform(0, 0.02, 2), rng.uniform(-6, 6, 2)
    around, roll, bright = rng.uniform(0, 2 * np.pi, 2), rng.uniform(0, 2 * np.pi), float(np.exp(rng.uniform(0, 1.5)))
    frames = []
    for number in range(_FRAMES):
        t = number / (_FRAMES - 1)
        moved = place * (1 + (nearer - 1) * t)
        moved = moved + [*(swing * place[2] * np.sin(5 * t + around)), 0.0]
        # The camera turns, and with it all that it sees.
        R = rotation_from_angles(*(np.radians(turned) * np.sin(4 * t + around[::-1])))
        seen_m = seen_from(points, moved, normal, roll) @ R.T
        points_px = on_picture(camera, seen_m)
        apart = closest_px(points_px)
        radius = float(np.clip(0.18 * apart, 1.3, 0.012 * camera.width))
        image = draw_lamps(
            (camera.width, camera.height),
            points_px,
            radius * moved[2] / seen_m[:, 2],
            bright * np.ones(lights),
            rng,
            ambient=0.005,
            noise_levels=2.0,
            jpeg_quality=85,
        )
        frames.append(Shown(image, told, dock, R @ moved, R @ normal))
    return frames


def run_film(job: tuple[str, int, int]) -> tuple[int, int, int, int, float]:
    """Frames in which the dock is tracked, the right pose is chosen, one is sure, and the wrong one is; the last p."""
    kind, base, seed = job
    tracker, counts, last = None, np.zeros(4, int), 0.0
    for number, shown in enumerate(film(kind, np.random.default_rng([base, seed, *kind.encode()]))):
        tracker = tracker or Tracker(shown.camera, shown.dock)
        tracked = tracker.see(shown.image, number / 10)
        if tracked.index is None or shown.position_m is None or shown.normal is None:
            continue
        found = tracked.estimate.candidates
        last = tracked.track.probability or 0.0
        is_right = _has_true_side(found[tracked.index], found[1 - tracked.index], shown)
        counts += [1, is_right, last >= SURE, last >= SURE and not is_right]
    return (*counts.tolist(), last)


KINDS: dict[str, Callable[[np.random.Generator], Shown]] = {
    "plain, told": partial(plain, is_told=True),
    "plain, unknown": partial(plain, is_told=False),
    "hard, told": partial(hard, is_told=True),
    "hard, unknown": partial(hard, is_told=False),
    "focal .6": partial(of_another_camera, factor=0.6),
    "focal 1.6": partial(of_another_camera, factor=1.6),
    "hand-built": hand_built,
    "2 to 9 m": far,
    "a lamp behind": with_a_lamp_behind,
    "a lamp behind, dead": partial(with_a_lamp_behind, is_lit=False),
    "a lamp behind, untold": partial(with_a_lamp_behind, is_told=False),
    "a third of a ring": sevens,
}


def run(job: tuple[str, int, int]) -> Came:
    """Judge one picture of a kind."""
    kind, base, seed = job
    shown = KINDS[kind](np.random.default_rng([base, seed, *kind.encode()]))
    found = estimate(shown.image, shown.camera, shown.dock)
    came, side = judged(found, *shown.truth), None
    if came.found and shown.position_m is not None:
        side = _has_true_side(found.candidates[0], found.candidates[1], shown)
    return Came(came, found.message, side)


def _has_true_side(chosen: CirclePose, other: CirclePose, shown: Shown) -> bool:
    """Whether the chosen one of two poses has the side nearer that the dock has, whatever the camera file says."""
    place, normal = shown.position_m, shown.normal
    assert place is not None
    assert normal is not None
    sight = place / np.linalg.norm(place)
    twin = 2 * float(normal @ sight) * sight - normal
    apart = rising_of(place, normal) - rising_of(place, twin)
    one, another = (rising_of(pose.position_m, pose.normal) for pose in (chosen, other))
    return float((one - another) @ apart) > 0


def report(name: str, came: Sequence[Came]) -> None:
    """Print a line for a kind, and p in bins where that is asked."""
    whole = [one.judged for one in came]
    found = [one for one in came if one.judged.found]
    total = max(1, len(came))

    def share(of: Sequence[bool], whole: int) -> str:
        return f"{100 * sum(of) / whole:5.1f}"

    sides = [one.side for one in found if one.side is not None]
    decided = [one.judged for one in found if one.judged.probability >= SURE]
    holds = np.array([one.judged.holds for one in found if one.judged.holds], dtype=bool).reshape(-1, 5)
    print(
        f"{name:22} of {len(came):4} found {share([one.found for one in whole], total)}"
        f" right {share([one.right for one in whole], total)} either {share([one.either for one in whole], total)}"
        f" | undecided {share([one.undecided for one in whole], total)}"
        f" side {share([bool(one) for one in sides], max(1, len(sides)))}"
        f" wrong side and p>=.95 {sum(one.side is False and one.judged.probability >= SURE for one in found):3}"
        f" sure {sum(one.judged.sure for one in found):4} sure and wrong"
        f" {sum(one.judged.sure and not one.judged.right for one in found):3}"
        f" nearer where p>=.95 {share([one.nearer for one in decided], max(1, len(decided)))}"
        f" holds {' '.join(f'{100 * each:.0f}' for each in holds.mean(axis=0)) if len(holds) else '-'}"
        f" camera questioned {sum(_is_questioned(one) for one in came)}",
        flush=True,
    )
    if name == "2 to 9 m":
        bins([(one.judged.probability, one.judged.nearer) for one in found])
        off = sum(one.judged.probability >= SURE and not one.judged.right for one in found)
        print(f"    of {len(decided)} with p >= .95 {off} are off by more than 5 % or 5 degrees")


def _is_questioned(came: Came) -> bool:
    """Whether the message names another focal length than the camera's."""
    return "check the camera file" in came.message


def bins(pairs: Sequence[tuple[float, bool]]) -> None:
    """Print, for poses given a probability, how many are wrong, beside how many may be."""
    for low, high in pairwise(BINS):
        part = [(p, right) for p, right in pairs if low <= p < high]
        if part:
            expected = sum(1 - p for p, _ in part)
            spread = math.sqrt(sum(p * (1 - p) for p, _ in part))
            wrong = sum(not right for _, right in part)
            verdict = "" if abs(wrong - expected) <= 2 * spread + 1 else "   BEYOND CHANCE"
            print(
                f"    p {low:.2f} to {high:.2f}: {wrong} wrong of {len(part)}, {expected:.1f} +- {spread:.1f}{verdict}"
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each kind."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.bench_chosen", description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"{', '.join(KINDS)} (default: all)")
    parser.add_argument("--data", type=Path, metavar="DATA", help="folder of the sets of photographs")
    parser.add_argument("--pictures", type=int, default=40, metavar="N", help="of each kind")
    parser.add_argument("--seed", type=int, default=_SEED, metavar="N")
    parser.add_argument("--processes", type=int, default=2, metavar="N", help="worker processes (default: 2)")
    parser.add_argument("--messages", action="store_true", help="tell what was said of what is not right")
    options = parser.parse_args(arguments)
    with get_context("spawn").Pool(options.processes) as pool:
        for kind in options.kinds or ([] if options.data else [*KINDS, *FILMS]):
            if kind in FILMS:
                films = pool.map(run_film, [(kind, options.seed, n) for n in range(options.pictures)], chunksize=1)
                sums = np.array(films).sum(axis=0)
                print(
                    f"{kind:22} {len(films)} of {_FRAMES} frames: tracked {sums[0]:.0f}, right {sums[1]:.0f},"
                    f" sure {sums[2]:.0f}, sure and wrong {sums[3]:.0f} in films"
                    f" {[(n, one[3], round(one[4], 4)) for n, one in enumerate(films) if one[3]]}",
                    flush=True,
                )
                continue
            came = pool.map(run, [(kind, options.seed, n) for n in range(options.pictures)], chunksize=3)
            report(kind, came)
            for number, one in enumerate(came):
                if options.messages and not (one.judged.right and one.judged.sure):
                    print(f"    {number} {one.judged.right} p {one.judged.probability:.4f} {one.message}")
        for is_told in (True, False) if options.data else ():
            jobs = [(folder, name, is_told) for folder, name in photographs(options.data)]
            results = list(zip(jobs, pool.map(run_photograph, jobs, chunksize=1), strict=True))
            for (_, name, _), one in results:
                if options.messages and one is not None:
                    j = one.judged
                    print(
                        f"    {name:28} ring {j.right!s:5} truth {j.either!s:5} side {one.side!s:5}"
                        f" p {j.probability:.3f} d {j.detection:.3f} | {one.message}"
                    )
            rings = [one for _, one in results if one is not None and one.judged.right]
            known = [one for one in rings if one.judged.either]
            wrong_ring = [one for _, one in results if one and one.judged.found and not one.judged.right]
            print(
                f"photographs, {'told' if is_told else 'unknown'}: {len(results)}, right rings {len(rings)},"
                f" undecided {sum(one.judged.undecided for one in rings)}, of {len(known)} whose side is known wrong"
                f" {sum(one.side is False for one in known)}, sure and wrong"
                f" {sum(one.side is False and one.judged.sure for one in known)};"
                f" wrong rings {len(wrong_ring)}, sure {sum(one.judged.sure for one in wrong_ring)}"
            )
    return 0


PICTURES, FILMS_SEEN = 30, 6  # of each kind, in the test
# Shares of pictures whose pose is right (of another camera none is), of those found whose nearer side is right, and of
# those sure of the wrong side, or of what is no dock.
REACHED = {
    "plain, told": (0.99, 0.995, 0.0),
    "plain, unknown": (0.99, 0.995, 0.0),
    "hard, told": (0.97, 0.99, 0.0),
    "hard, unknown": (0.97, 0.99, 0.0),
    "focal .6": (0.0, 0.98, 0.01),
    "focal 1.6": (0.0, 0.99, 0.005),
    "hand-built": (0.65, 0.9, 0.02),
    "2 to 9 m": (0.8, 0.9, 0.005),
    "a third of a ring": (0.0, 0.0, 0.05),
}
FRAMES_REACHED = {FILMS[0]: 0.0, FILMS[1]: 0.01, FILMS[2]: 0.0}  # of all, sure of the wrong pose
QUESTIONED_REACHED = 0.99  # of another camera's pictures, those whose message says so; of the right one's none
NEARER_REACHED = 0.978  # of all given p >= .95


@pytest.fixture(scope="module")
def pool():
    with get_context("spawn").Pool(2) as pool:
        print()
        yield pool


@pytest.mark.parametrize("kind", REACHED)
def test_the_choice_in_a_picture(kind: str, pool: Pool):
    came = pool.map(run, [(kind, _SEED, number) for number in range(PICTURES)], chunksize=3)
    report(kind, came)
    right, side, sure = REACHED[kind]
    sides = [one.side for one in came if one.side is not None]
    assert sum(one.judged.right for one in came) >= at_least(right, len(came))
    assert sum(sides) >= at_least(side, len(sides))
    questioned, found = sum(map(_is_questioned, came)), sum(one.judged.found for one in came)
    if kind.startswith("focal"):
        assert questioned >= at_least(QUESTIONED_REACHED, found)
    else:
        assert questioned <= at_most(0.001, found)
    assert sum(one.judged.sure and not one.side for one in came) <= at_most(sure, len(came))
    if sure < 0.05 and not kind.startswith("focal"):  # of another camera the attitude is off by itself
        decided = [one.judged.nearer for one in came if one.judged.found and not one.judged.undecided]
        assert sum(decided) >= at_least(NEARER_REACHED, len(decided))


@pytest.mark.parametrize("kind", FILMS)
def test_the_choice_over_frames(kind: str, pool: Pool):
    films = pool.map(run_film, [(kind, _SEED, number) for number in range(FILMS_SEEN)], chunksize=1)
    wrong = sum(one[3] for one in films)
    print(f"{kind}: {wrong} of {FILMS_SEEN * _FRAMES} frames sure of the wrong pose")
    assert wrong <= at_most(FRAMES_REACHED[kind], FILMS_SEEN * _FRAMES)


if __name__ == "__main__":
    main()
