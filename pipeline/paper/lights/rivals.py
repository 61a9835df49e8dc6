"""The threshold methods on random scenes, HATS against its rivals (Figure 15), and HATS from literal to ours."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from dockpose.camera.image import to_grey
from dockpose.estimate import estimate
from dockpose.paper.lights.levels import (
    any_level_shows_the_lights,
    are_the_lights,
    group_centres,
    is_right,
    pose_is_right,
    poses_of_all,
)
from dockpose.paper.lights.literal import STEPS, Scheme, Vote, literal_hats
from dockpose.paper.lights.scenes import draw_scenes
from dockpose.settings import Settings
from dockpose.simulate import Scene, Truth, render
from dockpose.thresholds import LEVELS, Histogram, histogram_of

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
            exact[ANY_LEVEL] = any_level_shows_the_lights(histogram, lights_px, Settings().min_area_px)
        right[PER_LIGHT] = pose_is_right(estimate(image, scene.camera, scene.dock), truth)
        rows.append((exact, chain, right))
    columns = ({name: np.array([row[name] for row in part]) for name in part[0]} for part in zip(*rows, strict=True))
    return Tally(np.array([is_hard for is_hard, _ in scenes]), *columns)


def _judged(
    image: np.ndarray, histogram: Histogram, scene: Scene, truth: Truth, settings: Settings
) -> tuple[bool, bool, bool]:
    """Exact, right by the plain chain, and right by ours."""
    found = estimate(image, scene.camera, scene.dock, settings, fall_back=False)
    level = LEVELS if found.threshold is None else found.threshold.level
    points_px = group_centres(histogram, level, settings.min_area_px)
    chain = any(is_right(pose, truth) for pose in poses_of_all(points_px, scene.camera, scene.dock))
    return are_the_lights(points_px, truth.lights_px[truth.visible]), chain, pose_is_right(found, truth)
