"""The threshold methods on random scenes, HATS against its rivals (Figure 15), and HATS from literal to ours."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from dockpose.camera.image import to_grey
from dockpose.estimate import estimate
from dockpose.paper.lights import levels
from dockpose.paper.lights.scenes import draw_scenes
from dockpose.pixels.bright import SATURATED
from dockpose.settings import Settings
from dockpose.simulate import Scene, Truth, render
from dockpose.thresholds import LEVELS, Histogram, histogram_of
from dockpose.thresholds.hats import (
    DIM_LEVELS,
    REAL_LEVELS,
    REAL_SHARE,
    RISE_NOISE,
    above_noise,
    background_limit,
    background_mode,
)


@dataclass(frozen=True)
class Scheme:
    """Which steps are taken beyond the literal reading; none by default."""

    min_area_px: int = 1  # smaller groups do not count
    is_bounded: bool = False  # candidates end above the background and at saturation
    has_every_level: bool = False  # every level is a candidate, not peaks alone
    in_a_row: bool = False  # a count's votes are those of its longest unbroken run of candidates, not of all
    by_brightness: bool = False  # a vote weighs by its reach in the logarithm of brightness above the background
    largest_real: bool = False  # elected is the largest count with a real share of the votes, not the one with the most
    above_noise: bool = False  # levels at which noise dissolves do not vote, and the level keeps clear of noise


# Each step adds to the one before.
_NAMES = ("bounds", "every level", "unbroken run", "log brightness", "largest real count", "clear of noise")
STEPS = {"literal": Scheme(), "+ minimum area": Scheme(2)}
STEPS |= {f"+ {name}": Scheme(2, *[True] * number) for number, name in enumerate(_NAMES, start=1)}


@dataclass(frozen=True)
class Vote:
    """How the candidates voted."""

    level: int  # elected, 0..255; 256 where there is no candidate with a group
    groups: int  # elected
    candidates: np.ndarray  # (n,): levels, from bright to dark
    counts: np.ndarray  # (n,): number of groups at each
    weights: np.ndarray  # (n,): of each one's vote


def local_peaks(counts: np.ndarray) -> np.ndarray:
    """Levels, from bright to dark, with more pixels than the next darker and no fewer than the next brighter one."""
    padded = np.concatenate([[0], counts, [0]])
    return np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]))[::-1]


# What the paper leaves open is chosen the plainest way; ``literal_hats`` in static/parts.toml lists it.
def literal_hats(histogram: Histogram, scheme: Scheme | None = None) -> Vote:
    """Choose a level by the literal reading, or with the steps of a scheme; the brightest of the elected candidates."""
    scheme = scheme or Scheme()
    sketch = histogram.sketch if scheme.is_bounded else histogram.counts
    mode, floor, top = 0, 0, LEVELS - 1
    if scheme.is_bounded:
        mode, floor = background_mode(sketch), background_limit(sketch)
    if floor >= LEVELS or (pixels := histogram.bright(floor)).is_empty:
        nothing = np.empty(0, dtype=int)
        return Vote(LEVELS, 0, nothing, nothing, nothing.astype(float))
    groups = pixels.groups_at_every_level(scheme.min_area_px)
    if scheme.is_bounded:
        top = max(floor, min(int(pixels.level.max()), SATURATED))
    if scheme.above_noise:
        floor = above_noise(groups, floor, top)
    candidates = np.arange(LEVELS)[::-1] if scheme.has_every_level else local_peaks(histogram.counts)
    candidates = candidates[(candidates >= floor) & (candidates <= top)]
    counts = groups[candidates]
    weights = np.ones(len(candidates))
    if scheme.by_brightness:  # each stands for the brightness above the background down to the next, or the floor
        reached = np.append(candidates[1:], floor - 1)
        weights = np.log((candidates - mode + DIM_LEVELS) / (reached - mode + DIM_LEVELS))
    return _elected(scheme, candidates, counts, weights, histogram.noise)


def _elected(scheme: Scheme, candidates: np.ndarray, counts: np.ndarray, weights: np.ndarray, noise: float) -> Vote:
    runs = _runs(counts, weights, scheme.in_a_row)
    if not runs:
        return Vote(LEVELS, 0, candidates, counts, weights)
    most = max(votes for _, _, votes in runs.values())
    if scheme.largest_real:
        share = min(most, REAL_SHARE * float(weights.sum()))
        least = min(REAL_LEVELS, max(length for _, length, _ in runs.values()))
        real = [count for count, (_, length, votes) in runs.items() if _at_least(votes, share) and length >= least]
        elected = max(real) if real else max(runs, key=lambda count: runs[count][2])
    else:
        elected = max(count for count, (_, _, votes) in runs.items() if _at_least(votes, most))
    first, length, _ = runs[elected]
    if scheme.above_noise:
        first += max(0, min(math.floor(RISE_NOISE * noise) - 1, (length - 1) // 2))
    return Vote(int(candidates[first]), elected, candidates, counts, weights)


def _at_least(votes: float, needed: float) -> bool:
    """Compare sums of weights regardless of the order in which they were added."""
    return votes >= needed * (1 - 1e-12)


def _runs(counts: np.ndarray, weights: np.ndarray, in_a_row: bool) -> dict[int, tuple[int, int, float]]:
    """For each count above 0 its first candidate, how many there are, and their votes: of all, or the longest run."""
    found: dict[int, tuple[int, int, float]] = {}
    if in_a_row:
        runs = np.split(np.arange(len(counts)), np.flatnonzero(np.diff(counts)) + 1)
    else:
        runs = [np.flatnonzero(counts == count) for count in np.unique(counts)]
    for run in runs:
        count = int(counts[run[0]]) if len(run) else 0
        if count > 0 and len(run) > found.get(count, (0, 0, 0.0))[1]:
            found[count] = int(run[0]), len(run), float(weights[run].sum())
    return found


RIVALS = ("otsu", "sezan", "kittler", "kapur")
METHODS_COMPARED = ("hats", *RIVALS)
PER_LIGHT = "hats, then hats_local"
ANY_LEVEL = "best single level"
OURS = "ours: + second look"
SCENES_A_HALF = 50


@dataclass(frozen=True)
class Tally:
    """What came of each of N scenes, by method; a method is missing where a column makes no sense for it."""

    is_hard: np.ndarray  # (N,): which scenes are of the hard half
    exact: dict[str, np.ndarray]  # (N,): whether the groups at the level are exactly the lights
    plain_chain: dict[str, np.ndarray]  # (N,): whether one of both poses of the ellipse through all groups is right
    right: dict[str, np.ndarray]  # (N,): whether the pose that our further steps choose is right


def compare_methods(seed: int, a_half: int = SCENES_A_HALF) -> Tally:
    """Search random scenes by each method, all with the same later steps; ``PER_LIGHT`` is our default."""
    searches = {name: Settings(method=name) for name in METHODS_COMPARED}
    return _compared(seed, a_half, lambda histogram: searches, has_any_level=True)


def compare_schemes(seed: int, a_half: int = SCENES_A_HALF) -> Tally:
    """Search the same scenes by the literal HATS, with each of ``STEPS``, and by ours."""

    def searches(histogram: Histogram) -> dict[str, Settings]:
        steps = {name: settings_of(scheme, literal_hats(histogram, scheme)) for name, scheme in STEPS.items()}
        return {**steps, OURS: Settings()}

    return _compared(seed, a_half, searches)


def settings_of(scheme: Scheme, vote: Vote) -> Settings:
    """Return the settings that search a picture at an elected level; at 255, the highest, where none was elected."""
    return Settings(method="fixed", level=min(vote.level, LEVELS - 1), min_area_px=scheme.min_area_px)


def _compared(
    seed: int, a_half: int, searches: Callable[[Histogram], dict[str, Settings]], *, has_any_level: bool = False
) -> Tally:
    """What came of each scene by each search; the same search is not done twice."""
    scenes, rows = draw_scenes(seed, a_half), []
    for _, scene in scenes:
        image, truth = render(scene)
        histogram = histogram_of(to_grey(image))
        wanted = searches(histogram)
        judged = {settings: _judged(image, histogram, scene, truth, settings) for settings in set(wanted.values())}
        exact, chain, right = ({name: judged[one][column] for name, one in wanted.items()} for column in range(3))
        if has_any_level:
            lights_px = truth.lights_px[truth.visible]
            exact[ANY_LEVEL] = levels.any_level_shows_the_lights(histogram, lights_px, Settings().min_area_px)
        right[PER_LIGHT] = levels.pose_is_right(estimate(image, scene.camera, scene.dock), truth)
        rows.append((exact, chain, right))
    columns = ({name: np.array([row[name] for row in part]) for name in part[0]} for part in zip(*rows, strict=True))
    return Tally(np.array([is_hard for is_hard, _ in scenes]), *columns)


def _judged(
    image: np.ndarray, histogram: Histogram, scene: Scene, truth: Truth, settings: Settings
) -> tuple[bool, bool, bool]:
    """Exact, right by the plain chain, and right by ours."""
    found = estimate(image, scene.camera, scene.dock, settings, fall_back=False)
    level = LEVELS if found.threshold is None else found.threshold.level
    points_px = levels.group_centres(histogram, level, settings.min_area_px)
    chain = any(levels.is_right(pose, truth) for pose in levels.poses_of_all(points_px, scene.camera, scene.dock))
    return levels.are_the_lights(points_px, truth.lights_px[truth.visible]), chain, levels.pose_is_right(found, truth)
