"""One run of the pipeline for the page: what was found in a View, and the picture that shows it."""

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
    """A frame of a sequence, what was found in it with the frames before, and the course over all that were seen."""

    frame: Frame
    tracked: Tracked
    trajectory: Trajectory


@dataclass(frozen=True, eq=False)
class Analysis:
    """A view, and what the pipeline found in it.

    ``followed`` is there where the view shows a frame that was followed from the one before.
    """

    view: View
    estimate: Estimate
    tracked_frame: TrackedFrame | None = None

    @cached_property
    def annotated(self) -> np.ndarray:
        """The annotated picture (H, W, 3) uint8 BGR; not every frame of a sequence is shown, and drawing takes time."""
        return annotate(self.view.image, self.estimate)


def analyse(view: View) -> Analysis:
    """Render the view if it is to be, run the pipeline on it, and choose the pose that the operator chose, if any."""
    view = rendered(view)
    found = estimate(view.image, view.camera, view.dock, view.settings)
    if view.by_hand is not None:
        found = chosen_by_hand(found, view.by_hand)
    return Analysis(view, found)


def chosen_by_hand(found: Estimate, normal: tuple[float, float, float]) -> Estimate:
    """The same estimate with the candidate selected that faces most nearly along ``normal``."""
    if found.choice is None:
        return found
    selected = int(np.argmax([pose.normal @ np.array(normal) for pose in found.candidates]))
    pose = found.candidates[selected]
    message = (
        f"{found.lights_on_ring} lights on the ring; the dock is {100 * pose.position_m[2]:.1f} cm ahead by pose "
        f"{POSE_NAMES[selected]}, which was chosen by hand."
    )
    return replace(found, choice=replace(found.choice, selected=selected, selected_by="hand"), message=message)
