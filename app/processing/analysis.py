"""One run of the pipeline for the page: a view in, an analysis out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from dockpose import Estimate, estimate
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.processing.trajectory import Trajectory
from dockpose.app.state.scene import rendered
from dockpose.app.state.view import View
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracked


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """A frame of a sequence, what the tracker made of it, and the trajectory over all frames so far."""

    frame: Frame
    tracked: Tracked
    trajectory: Trajectory


@dataclass(frozen=True, eq=False)
class Analysis:
    """A view and what the pipeline found in it; ``tracked_frame`` is set where the view shows a tracked frame."""

    view: View
    estimate: Estimate
    tracked_frame: TrackedFrame | None = None

    @cached_property
    def annotated(self) -> np.ndarray:
        """The annotated picture (H, W, 3) uint8 BGR, drawn when first asked for: not every frame is shown."""
        return annotate(self.view.image, self.estimate)


def analyse(view: View) -> Analysis:
    """Render the view if it is stale, run the pipeline on it, and apply the operator's choice of pose, if any."""
    view = rendered(view)
    found = estimate(view.image, view.camera, view.dock, view.settings)
    return Analysis(view, found if view.by_hand is None else chosen_by_hand(found, view.by_hand))


def chosen_by_hand(found: Estimate, normal: tuple[float, float, float]) -> Estimate:
    """Select the candidate whose normal is nearest to ``normal``."""
    return select_pose(found, nearest_pose(found, normal), "hand", "which was chosen by hand")


def nearest_pose(found: Estimate, normal: tuple[float, float, float]) -> int | None:
    """Index of the candidate whose normal is nearest to ``normal``; None without candidates."""
    return int(np.argmax([pose.normal @ np.array(normal) for pose in found.candidates])) if found.candidates else None


def select_pose(found: Estimate, index: int | None, by: str, why: str = "") -> Estimate:
    """Select another candidate of an estimate.

    Parameters
    ----------
    found : Estimate
        Returned as it is where it has no choice.
    index : int or None
        The candidate to select; None leaves the estimate as it is.
    by : str
        What selected it, for ``Choice.selected_by``.
    why : str
        End of the new message, "which ..."; empty keeps the message.
    """
    if found.choice is None or index is None:
        return found
    message = found.message
    if why:
        message = (
            f"{found.lights_on_ring} lights on the ring; the dock is "
            f"{100 * found.candidates[index].position_m[2]:.1f} cm ahead by pose {POSE_NAMES[index]}, {why}."
        )
    return replace(found, choice=replace(found.choice, selected=index, selected_by=by), message=message)
