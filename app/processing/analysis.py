"""One run of the pipeline for the page: a view in, an analysis out."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from dockpose import Dock, Estimate, estimate
from dockpose.app.drawing.colours import POSE_NAMES, TRUST_COLOURS
from dockpose.app.processing.trajectory import Trajectory
from dockpose.app.state.scene import rendered
from dockpose.app.state.trust import Trust, trust_in
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

    def prepare(self) -> None:
        """Judge now what is otherwise judged when first asked for."""
        _ = self.trust

    @cached_property
    def fitting_lights(self) -> int | None:
        """How many lights form a ring where the dock's number finds none, or one of fewer lights than are in view.

        None where no other number does better. It is searched for when first asked for.
        """
        found, lights = self.estimate, self.view.dock.lights
        seen, groups = found.lights_on_ring or 0, 0 if found.markers is None else len(found.markers)
        is_found = found.status == "ok" and (seen >= groups or seen == lights)
        return None if lights is None or is_found else _fitting_lights(self.view, seen if found.status == "ok" else 0)

    @cached_property
    def trust(self) -> Trust:
        """How far the result can be trusted; in a sequence with the probability that the track gives."""
        tracked = None if self.tracked_frame is None else self.tracked_frame.tracked
        is_guess = self.view.camera_of == "guess"
        return trust_of(self.estimate, tracked, camera_is_guessed=is_guess, fitting_lights=self.fitting_lights)


def _fitting_lights(view: View, more_than: int) -> int | None:
    found = estimate(view.image, view.camera, Dock(view.dock.diameter), view.settings)
    if found.status != "ok" or found.ring is None or (found.lights_on_ring or 0) <= more_than:
        return None
    return None if found.ring.lights == view.dock.lights else found.ring.lights


def trust_of(found: Estimate, tracked: Tracked | None = None, **more: Any) -> Trust:
    """Judge a result, with ``more`` as for :func:`dockpose.app.state.trust.trust_in`.

    One of a sequence is judged with the probability that its track gives to the chosen pose.
    """
    probability = None if tracked is None or tracked.selected is None else tracked.track.probability
    return trust_in(found, probability=probability, **more)


def headline_of(trust: Trust) -> tuple[str, str]:
    """Return the verdict and its colour, as the annotated picture shows them."""
    return trust.verdict, TRUST_COLOURS[trust.colour]


def analyse(view: View, last: Analysis | None = None) -> Analysis:
    """Render the view if it is stale, run the pipeline on it, and apply the operator's choice of pose, if any.

    What the ``last`` one found in the same picture is not searched for again.
    """
    view = rendered(view)
    like = last.estimate if last is not None and last.view.image is view.image else None
    found = estimate(view.image, view.camera, view.dock, view.settings, like=like)
    return Analysis(view, found if view.by_hand is None else chosen_by_hand(found, view.by_hand))


def chosen_by_hand(found: Estimate, normal: tuple[float, float, float]) -> Estimate:
    """Select the candidate whose normal is nearest to ``normal``."""
    return select_pose(found, nearest_pose(found, normal), "hand", "which was chosen by hand")


def nearest_pose(found: Estimate, normal: tuple[float, float, float]) -> int | None:
    """Index of the candidate whose normal is nearest to ``normal``; None without candidates."""
    return int(np.argmax([pose.normal @ np.array(normal) for pose in found.candidates])) if found.candidates else None


def select_pose(found: Estimate, index: int | None, by: str, why: str = "") -> Estimate:
    """Select another candidate of an estimate."""
    if found.choice is None or index is None:
        return found
    message = found.message
    if why:
        message = (
            f"{found.lights_on_ring} lights on the ring; the dock is "
            f"{100 * found.candidates[index].position_m[2]:.1f} cm ahead by pose {POSE_NAMES[index]}, {why}."
        )
    return replace(found, choice=replace(found.choice, selected=index, selected_by=by), message=message)
