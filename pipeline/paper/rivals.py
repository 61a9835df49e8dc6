"""The threshold methods on random scenes, HATS against its rivals (Figure 15), and HATS from literal to ours."""

import math
from collections.abc import Callable, Collection

import numpy as np
from dockpose.camera.image import to_grey
from dockpose.estimate import estimate
from dockpose.paper.levels import any_level_shows_the_lights, are_the_lights, group_centres, poses_of_all
from dockpose.paper.scenes import draw_scenes
from dockpose.pixels.bright import SATURATED
from dockpose.settings import Settings
from dockpose.study.draw import Picture, picture_of
from dockpose.study.judge import is_right
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

# Steps beyond the literal reading, each of which adds to those before.
_NAMES = (
    "minimum area",  # groups below two pixels do not count
    "bounds",  # candidates end above the background and at saturation
    "every level",  # is a candidate, not peaks alone
    "unbroken run",  # a count's votes are those of its longest run of candidates, not of all
    "log brightness",  # a vote weighs by its reach in the logarithm of brightness above the background
    "largest real count",  # elected is the largest count with a real share of the votes, not the one with the most
    "clear of noise",  # levels at which noise dissolves do not vote, and the level keeps clear of noise
)
LITERAL = "literal"
STEPS: dict[str, tuple[str, ...]] = {LITERAL: ()}
STEPS |= {f"+ {name}": _NAMES[:number] for number, name in enumerate(_NAMES, start=1)}


def local_peaks(counts: np.ndarray) -> np.ndarray:
    """Levels, from bright to dark, with more pixels than the next darker and no fewer than the next brighter one."""
    padded = np.concatenate([[0], counts, [0]])
    return np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]))[::-1]


# What the paper leaves open is chosen the plainest way; ``literal_hats`` in static/parts.toml lists it.
def literal_hats(histogram: Histogram, steps: Collection[str] = ()) -> int:
    """The level of the literal reading, or with some steps; the brightest of the elected candidates, 256 for none."""
    mode, floor, top = 0, 0, LEVELS - 1
    if "bounds" in steps:
        mode, floor = background_mode(histogram.sketch), background_limit(histogram.sketch)
    if floor >= LEVELS or (pixels := histogram.bright(floor)).is_empty:
        return LEVELS
    groups = pixels.groups_at_every_level(_min_area_px(steps))
    if "bounds" in steps:
        top = max(floor, min(int(pixels.level.max()), SATURATED))
    if "clear of noise" in steps:
        floor = above_noise(groups, floor, top)
    candidates = np.arange(LEVELS)[::-1] if "every level" in steps else local_peaks(histogram.counts)
    candidates = candidates[(candidates >= floor) & (candidates <= top)]
    weights = np.ones(len(candidates))
    if "log brightness" in steps:  # each stands for the brightness above the background down to the next, or the floor
        reached = np.append(candidates[1:], floor - 1)
        weights = np.log((candidates - mode + DIM_LEVELS) / (reached - mode + DIM_LEVELS))
    runs = _runs(groups[candidates], weights, "unbroken run" in steps)
    if not runs:
        return LEVELS
    first, length, _ = runs[_elected(runs, float(weights.sum()), "largest real count" in steps)]
    if "clear of noise" in steps:
        first += max(0, min(math.floor(RISE_NOISE * histogram.noise) - 1, (length - 1) // 2))
    return int(candidates[first])


def _min_area_px(steps: Collection[str]) -> int:
    return 2 if "minimum area" in steps else 1


Runs = dict[int, tuple[int, int, float]]


def _runs(counts: np.ndarray, weights: np.ndarray, in_a_row: bool) -> Runs:
    """For each count above 0 its first candidate, how many there are, and their votes: of all, or the longest run."""
    found: Runs = {}
    if in_a_row:
        runs = np.split(np.arange(len(counts)), np.flatnonzero(np.diff(counts)) + 1)
    else:
        runs = [np.flatnonzero(counts == count) for count in np.unique(counts)]
    for run in runs:
        count = int(counts[run[0]]) if len(run) else 0
        if count > 0 and len(run) > found.get(count, (0, 0, 0.0))[1]:
            found[count] = int(run[0]), len(run), float(weights[run].sum())
    return found


def _elected(runs: Runs, weight: float, largest_real: bool) -> int:
    """The count with the most votes, or the largest with a real share of them; of several the largest."""
    needed, least = max(votes for _, _, votes in runs.values()), 0
    if largest_real:
        needed = min(needed, REAL_SHARE * weight)
        least = min(REAL_LEVELS, max(length for _, length, _ in runs.values()))
    # Sums of weights are compared regardless of the order in which they were added.
    real = [count for count, (_, length, votes) in runs.items() if votes >= needed * (1 - 1e-12) and length >= least]
    return max(real) if real else max(runs, key=lambda count: runs[count][2])


RIVALS = ("otsu", "sezan", "kittler", "kapur")
PER_LIGHT = "hats, then hats_local"
ANY_LEVEL = "best single level"
OURS = "ours: + second look"
SCENES_A_HALF = 50
# What is judged: whether the groups at the level are exactly the lights, whether one of both poses of the ellipse
# through all groups is right, and whether the pose that our further steps choose is.
COLUMNS = ("exact", "plain_chain", "right")
Tally = dict[str, dict[str, np.ndarray]]  # by column and method (N,) of bool: the plain scenes, then the hard ones


def compare_methods(seed: int) -> Tally:
    """Search random scenes by each method, all with the same later steps."""
    return _compared(seed, lambda histogram: {name: Settings(method=name) for name in ("hats", *RIVALS)})


def compare_schemes(seed: int) -> Tally:
    """Search the same scenes by the literal HATS, with each of ``STEPS``, and by ours."""

    def searches(histogram: Histogram) -> dict[str, Settings]:
        fixed = {
            name: Settings("fixed", min(literal_hats(histogram, steps), LEVELS - 1), _min_area_px(steps))
            for name, steps in STEPS.items()
        }
        return {**fixed, OURS: Settings()}

    return _compared(seed, searches)


def _compared(seed: int, searches: Callable[[Histogram], dict[str, Settings]]) -> Tally:
    """What came of each scene by each search, by any level at all, and ``PER_LIGHT``, as is our default."""
    rows: list[dict[str, dict[str, bool]]] = []
    for drawn in draw_scenes(seed, SCENES_A_HALF):
        picture = picture_of(drawn)
        histogram, scene, truth = histogram_of(to_grey(picture.image)), picture.scene, picture.truth
        wanted = searches(histogram)
        judged = {settings: _judged(picture, histogram, settings) for settings in set(wanted.values())}
        row = {column: {name: judged[one][k] for name, one in wanted.items()} for k, column in enumerate(COLUMNS)}
        row["exact"][ANY_LEVEL] = any_level_shows_the_lights(histogram, truth.lights_px[truth.visible])
        found = estimate(picture.image, scene.camera, scene.dock)
        row["right"][PER_LIGHT] = is_right(found.selected, truth)
        rows.append(row)
    return {
        column: {name: np.array([row[column][name] for row in rows]) for name in of} for column, of in rows[0].items()
    }


def _judged(picture: Picture, histogram: Histogram, settings: Settings) -> tuple[bool, bool, bool]:
    """Each of ``COLUMNS``."""
    scene, truth = picture.scene, picture.truth
    found = estimate(picture.image, scene.camera, scene.dock, settings, fall_back=False)
    level = LEVELS if found.threshold is None else found.threshold.level
    points_px = group_centres(histogram, level, settings.min_area_px)
    poses = (*poses_of_all(points_px, scene.camera, scene.dock), found.selected)
    *chain, chosen = (is_right(pose, truth) for pose in poses)
    return are_the_lights(points_px, truth.lights_px[truth.visible]), any(chain), chosen
