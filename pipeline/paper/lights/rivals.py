"""The threshold methods on random scenes, HATS against its rivals (Figure 15), and HATS from literal to ours."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from dockpose.camera.image import to_grey
from dockpose.estimate import estimate
from dockpose.paper.lights.literal import STEPS, Scheme, Vote, literal_hats
from dockpose.paper.lights.outcomes import (
    any_level_shows_the_lights,
    are_the_lights,
    group_centres,
    is_right,
    pose_is_right,
    poses_of_all,
)
from dockpose.paper.lights.random_scenes import draw_scenes
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
    """What came of each scene, method by method; a method lacks where a column makes no sense for it."""

    is_hard: np.ndarray  # (N,): which scenes are of the hard half
    exact: dict[str, np.ndarray]  # whether the groups at the level are exactly the lights
    # whether one of both poses of the ellipse through all groups is right, as the paper reads
    plain_chain: dict[str, np.ndarray]
    right: dict[str, np.ndarray]  # whether the pose that our further steps choose is right


def compare_methods(seed: int, a_half: int = SCENES_A_HALF) -> Tally:
    """Search random scenes by each method, all with the same steps after the threshold.

    ``PER_LIGHT`` is HATS as ``estimate`` has it by default, which gives each light a level of its own where no single
    one shows the ring. ``ANY_LEVEL``, in ``exact`` alone, tells whether any single level shows exactly the lights.
    """
    rows = []
    for hard, scene in draw_scenes(seed, a_half):
        image, truth = render(scene)
        histogram = histogram_of(to_grey(image))
        searches = {name: Settings(method=name) for name in METHODS_COMPARED}
        row = _searched(image, histogram, scene, truth, searches)
        lights_px = truth.lights_px[truth.visible]
        row[0][ANY_LEVEL] = any_level_shows_the_lights(histogram, lights_px, Settings().min_area_px)
        row[2][PER_LIGHT] = pose_is_right(estimate(image, scene.camera, scene.dock), truth)
        rows.append((hard, *row))
    return _tally(rows)


def compare_schemes(seed: int, a_half: int = SCENES_A_HALF) -> Tally:
    """Search the same scenes by the literal HATS, with each of ``STEPS``, and by ours."""
    rows = []
    for hard, scene in draw_scenes(seed, a_half):
        image, truth = render(scene)
        histogram = histogram_of(to_grey(image))
        searches = {name: settings_of(scheme, literal_hats(histogram, scheme)) for name, scheme in STEPS.items()}
        row = _searched(image, histogram, scene, truth, {**searches, OURS: Settings()})
        row[2][PER_LIGHT] = pose_is_right(estimate(image, scene.camera, scene.dock), truth)
        rows.append((hard, *row))
    return _tally(rows)


def settings_of(scheme: Scheme, vote: Vote) -> Settings:
    """Return the settings that search a picture at an elected level; at 255, the highest, where none was elected."""
    return Settings(method="fixed", level=min(vote.level, LEVELS - 1), min_area_px=scheme.min_area_px)


def _searched(
    image: np.ndarray, histogram: Histogram, scene: Scene, truth: Truth, searches: dict[str, Settings]
) -> tuple[dict[str, bool], dict[str, bool], dict[str, bool]]:
    """Exact, right by the plain chain and right by ours, for each search; the same search is not done twice."""
    lights_px = truth.lights_px[truth.visible]
    judged: dict[Settings, tuple[bool, bool, bool]] = {}
    for settings in searches.values():
        if settings in judged:
            continue
        found = estimate(image, scene.camera, scene.dock, settings, fall_back=False)
        level = LEVELS if found.threshold is None else found.threshold.level
        points_px = group_centres(histogram, level, settings.min_area_px)
        poses = poses_of_all(points_px, scene.camera, scene.dock)
        chain = any(is_right(pose, truth) for pose in poses)
        judged[settings] = are_the_lights(points_px, lights_px), chain, pose_is_right(found, truth)
    exact, chain, right = ({name: judged[one][column] for name, one in searches.items()} for column in range(3))
    return exact, chain, right


def _tally(rows: Iterable[tuple[bool, dict[str, bool], dict[str, bool], dict[str, bool]]]) -> Tally:
    is_hard, *columns = zip(*rows, strict=True)
    return Tally(
        np.array(is_hard), *({name: np.array([row[name] for row in part]) for name in part[0]} for part in columns)
    )
