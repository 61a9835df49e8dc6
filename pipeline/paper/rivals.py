"""The threshold methods on random scenes, HATS against its rivals (Figure 15), and HATS from literal to ours."""

from collections.abc import Callable

import numpy as np
from dockpose.camera.image import to_grey
from dockpose.estimate import estimate
from dockpose.paper.levels import any_level_shows_the_lights, are_the_lights, group_centres, poses_of_all
from dockpose.paper.scenes import draw_scenes
from dockpose.settings import Settings
from dockpose.study.draw import Picture, picture_of
from dockpose.study.judge import is_right
from dockpose.thresholds import LEVELS, Histogram, histogram_of


def local_peaks(counts: np.ndarray) -> np.ndarray:
    """Levels, from bright to dark, with more pixels than the next darker and no fewer than the next brighter one."""
    padded = np.concatenate([[0], counts, [0]])
    return np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]))[::-1]


# What the paper leaves open is chosen the plainest way; ``literal_hats`` in static/parts.toml lists it.
def literal_hats(histogram: Histogram) -> int:
    """The level of the literal reading: the brightest of the elected candidates."""
    candidates = local_peaks(histogram.counts)
    counts = histogram.bright(0).groups_at_every_level(1)[candidates]
    numbers, votes = np.unique(counts, return_counts=True)
    elected = numbers[votes == votes.max()].max()
    return int(candidates[counts == elected][0])


# As the paper calls them in its Figure 15.
NAMES = {
    "hats": "HATS",
    "otsu": "Otsu",
    "sezan": "Sezan",
    "kittler": "Kittler-Illingworth",
    "kapur": "maximum entropy",
}
RIVALS = tuple(NAMES)[1:]
PER_LIGHT = "hats, then hats_local"
ANY_LEVEL = "best single level"
LITERAL, OURS = "literal", "ours"
SCENES_A_HALF = 50
# What is judged: whether the groups at the level are exactly the lights, whether one of both poses of the ellipse
# through all groups is right, and whether the pose that our further steps choose is.
COLUMNS = ("exact", "plain_chain", "right")
Tally = dict[str, dict[str, np.ndarray]]  # by column and method (N,) of bool: the plain scenes, then the hard ones


def compare_methods(seed: int) -> Tally:
    """Search random scenes by each method, all with the same later steps."""
    return _compared(seed, lambda histogram: {name: Settings(method=name) for name in ("hats", *RIVALS)})


def compare_schemes(seed: int) -> Tally:
    """Search the same scenes by the literal HATS, for which groups of one pixel count, and by ours."""

    def searches(histogram: Histogram) -> dict[str, Settings]:
        return {LITERAL: Settings("fixed", literal_hats(histogram), 1), OURS: Settings()}

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
