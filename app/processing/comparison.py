"""What each threshold method makes of the picture on the page, and how the dock's centre moves with the level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose import Estimate, Settings, estimate
from dockpose.app.commands.compare import COMPARED
from dockpose.app.processing.analysis import chosen_by_hand
from dockpose.app.processing.background import Progress
from dockpose.app.state.view import View
from dockpose.paper.baselines import centres
from dockpose.pose.known import pose_error
from dockpose.thresholds import LEVELS

SWEPT_LEVELS = range(1, LEVELS)
CENTRES = ("mass moment of the lights", "ellipse centre", "true centre")


@dataclass(frozen=True, eq=False)
class LevelSweep:
    """How far the dock's centre is off, level by level.

    Attributes
    ----------
    levels : (N,) grey levels.
    errors_px : (N, 3) distance from the reference of each of ``CENTRES``; NaN where a level shows no dock.
    reference : what they are measured against, in words.
    """

    levels: np.ndarray
    errors_px: np.ndarray
    reference: str


def compare_view(view: View, progress: Progress) -> dict[str, Estimate]:
    """Estimate the view by each method, otherwise with its own settings; hats without its fallback."""
    return {
        method: _estimate(view, msgspec.structs.replace(view.settings, method=method))
        for method in progress.over(COMPARED)
    }


def error_words(found: Estimate, view: View) -> str:
    """How far the chosen pose is from the truth, or from the measured pose; empty where neither is known."""
    error = pose_error(found.selected, view.known_pose)
    return (
        ""
        if error is None
        else f"{100 * error.distance_m:.1f}\N{NO-BREAK SPACE}cm,\N{NO-BREAK SPACE}{np.degrees(error.angle_rad):.1f}°"
    )


def sweep_levels(
    view: View,
    present: Estimate,
    progress: Progress,
    levels: Sequence[int] = SWEPT_LEVELS,
    show: Callable[[LevelSweep], None] = lambda sweep: None,
) -> LevelSweep:
    """Estimate the view at every fixed level (Fig. 14 of Ghosh et al. 2016).

    Parameters
    ----------
    view : what to look at.
    present : found in it as it stands; its centre is the reference where the truth is not known.
    progress : told level by level.
    levels : which.
    show : given what was swept so far, level by level.
    """
    centre, reference = _reference(view, present)
    errors = np.full((len(levels), len(CENTRES)), np.nan)
    for index, level in enumerate(progress.over(levels)):
        found = _estimate(view, msgspec.structs.replace(view.settings, method="fixed", level=level))
        if centre is not None:
            errors[index] = _errors_px(found, centre)
        show(LevelSweep(np.asarray(levels[: index + 1]), errors[: index + 1].copy(), reference))
    return LevelSweep(np.asarray(levels), errors, reference)


def _estimate(view: View, settings: Settings) -> Estimate:
    found = estimate(view.image, view.camera, view.dock, settings, fall_back=False)
    return found if view.by_hand is None else chosen_by_hand(found, view.by_hand)


def _reference(view: View, present: Estimate) -> tuple[np.ndarray | None, str]:
    for known, words in ((view.truth, "the true centre"), (view.measured, "the measured centre")):
        if known is not None and known.position_m[2] > 0:
            camera = view.camera
            x, y, z = known.position_m
            return np.array([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy]), words
    if present.selected is not None:
        return present.selected.centre_px, "the centre found with the present settings"
    return None, "nothing: no dock was found with the present settings"


def _errors_px(found: Estimate, centre_px: np.ndarray) -> np.ndarray | float:
    """Distance of each of ``CENTRES`` (3,) from the reference, undistorted; NaN without a pose."""
    if found.selected is None or found.ellipse is None or found.markers is None or found.ring is None:
        return np.nan
    points = found.markers.points_px[found.ring.on_ring]
    undistorted = found.camera.virtual_pixels(points, float(found.selected.position_m[2]))
    three = centres(undistorted, found.ellipse, found.selected)
    return np.linalg.norm(np.array([three.mass_moment_px, three.ellipse_px, three.true_px]) - centre_px, axis=1)
