"""All threshold methods on one picture."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.processing.analysis import chosen_by_hand
from dockpose.app.processing.background import Progress
from dockpose.app.state.view import View
from dockpose.camera.image import to_grey
from dockpose.lights.masks import hide
from dockpose.pose.known import pose_error
from dockpose.thresholds import METHODS, Histogram, histogram_of

DEFAULTS = Settings()
_IMPORTS_MS, _SLOW_MS = 3000.0, 500.0  # a first run may take so long by what it imports; the others are not repeated


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
    """Estimate the view by each method, keeping a choice by hand; times are medians of later runs, without imports."""
    view_of = (view.image, view.camera, view.dock, view.settings)
    found = latest = compare(*view_of, progress.over(compared()))
    times_ms: dict[str, list[float]] = {name: [] for name in found}
    for slow_ms in (_IMPORTS_MS, _SLOW_MS, _SLOW_MS):
        latest = compare(*view_of, [name for name, one in latest.items() if one.elapsed_ms < slow_ms])
        for name, one in latest.items():
            times_ms[name].append(one.elapsed_ms)
    for name, later_ms in times_ms.items():
        found[name] = replace(found[name], elapsed_ms=float(np.median(later_ms or found[name].elapsed_ms)))
    return {name: chosen_by_hand(one, view.by_hand) for name, one in found.items()}


def same_comparison(one: View, other: View) -> bool:
    """Whether two views give the same comparison: the method in use does not matter, nor does a fixed level."""

    def what_matters(view: View) -> tuple[Any, ...]:
        settings = msgspec.structs.replace(view.settings, method="hats", level=None)
        return view.camera, view.dock, settings, view.by_hand, view.set_lights, view.known_pose

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
