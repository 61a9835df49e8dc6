"""All threshold methods on one picture."""

import functools
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.processing.analysis import chosen_by_hand
from dockpose.app.processing.background import Progress
from dockpose.app.state.scene import NOT_OF_THE_PAPER, paper_scene
from dockpose.app.state.view import View
from dockpose.camera.image import to_grey
from dockpose.lights.masks import hide
from dockpose.paper.rivals import RIVALS
from dockpose.pose.known import pose_error
from dockpose.simulate import truth_of
from dockpose.study.judge import is_right
from dockpose.thresholds import METHODS, Histogram, histogram_of

DEFAULTS = Settings()
_TIMED_AGAIN, _SLOW_MS = 3, 500.0


def compared() -> tuple[str, ...]:
    """Return the methods that are compared: all but the fixed level, which somebody chose."""
    return tuple(name for name in METHODS if name != "fixed")


def compare(
    image: Any, camera: Camera, dock: Dock, settings: Settings = DEFAULTS, methods: Iterable[str] | None = None
) -> dict[str, Estimate]:
    """Estimate a picture by each of ``methods`` (default: :func:`compared`); hats does not fall back on hats_local."""
    return {
        name: estimate(image, camera, dock, msgspec.structs.replace(settings, method=name), fall_back=False)
        for name in (compared() if methods is None else methods)
    }


def compare_view(view: View, progress: Progress) -> dict[str, Estimate]:
    """Estimate the view by each method, keeping a choice by hand; times of quick ones are medians of more runs."""
    _import_for(compared())
    view_of = (view.image, view.camera, view.dock, view.settings)
    found = compare(*view_of, progress.over(compared()))
    quick = [name for name, one in found.items() if one.elapsed_ms < _SLOW_MS]
    again = [compare(*view_of, quick) for _ in range(_TIMED_AGAIN)]
    for name in quick:
        median_ms = float(np.median([other[name].elapsed_ms for other in again]))
        found[name] = replace(found[name], elapsed_ms=median_ms)
    return {name: chosen_by_hand(one, view.by_hand) for name, one in found.items()}


@functools.cache
def _import_for(methods: tuple[str, ...]) -> None:
    """Run methods for the first time, which imports what they need, so that no time that is told has that in it."""
    ramp = np.arange(64, dtype=np.uint8).reshape(8, 8)
    compare(ramp, Camera(8.0, 8.0, 3.5, 3.5, 8, 8), Dock(1.0), methods=methods)


def figure_15(view: View) -> list[tuple[str, int, int, bool]] | None:
    """Return method, level, groups, and whether the pose is right, as the report's Figure 15; None off its scenes."""
    scene = view.scene
    if scene is None or paper_scene(view) == NOT_OF_THE_PAPER:
        return None
    found, truth = compare(view.image, scene.camera, scene.dock, methods=("hats", *RIVALS)), truth_of(scene)
    return [
        (METHODS[name].label, one.threshold.level, one.markers.seen, is_right(one.selected, truth))
        for name, one in found.items()
        if one.threshold is not None and one.markers is not None
    ]


def same_comparison(one: View, other: View) -> bool:
    """Whether two views give the same comparison: the method in use does not matter, nor does a fixed level."""

    def what_matters(view: View) -> tuple[Any, ...]:
        settings = msgspec.structs.replace(view.settings, method="hats", level=None)
        return view.camera, view.dock, settings, view.by_hand, view.known_pose

    return one.image is other.image and what_matters(one) == what_matters(other)


def histogram_in(view: View, found: Estimate) -> Histogram:
    """Return the histogram of the picture of an estimate, with its masks."""
    return histogram_of(*hide(to_grey(view.image), found.settings.masks))


def error_words(found: Estimate, view: View) -> str:
    """How far the chosen pose is from the truth, or from the measured pose; empty where neither is known."""
    error = pose_error(found.selected, view.known_pose)
    if error is None:
        return ""
    return f"{100 * error.distance_m:.1f} cm, {np.degrees(error.angle_rad):.1f}°".replace(" ", "\N{NO-BREAK SPACE}")
