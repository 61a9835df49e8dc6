"""One run of the pipeline: a view in, an analysis out; the trajectory over many frames; stored results again."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import SI_COLUMNS
from dockpose.app.state.scene import rendered
from dockpose.app.state.trust import Trust, trust_of
from dockpose.app.state.view import View
from dockpose.lights.by_hand import ByHand
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracked

_MOST_ON_PATH = 600  # frames
MOST_POINTS = 20_000  # beyond which the oldest are dropped; a live source may run for hours
COLUMNS = ("time_s", *SI_COLUMNS, "eccentricity", "probability", "lost")
_NOMINAL_HZ = 10.0  # of frames without times
ROUNDING = 1e-11  # relative, and absolute below 1
_FROM_OUTSIDE = ("hand", "tracking")  # choices that a picture alone does not determine
_COMPARED = ("status", "image", "threshold", "markers", "ellipse", "candidates", "selected", "selected_by")


class Trajectory:
    """What was found in each frame, by its number; the columns are ``COLUMNS``."""

    def __init__(self) -> None:
        self._rows: dict[int, tuple[float, ...]] = {}

    def note(self, frame: Frame, tracked: Tracked) -> None:
        """Record a frame, replacing any earlier entry."""
        pose, ellipse = tracked.pose, tracked.estimate.ellipse
        place = (math.nan,) * 3 if pose is None else tuple(pose.position_m.tolist())
        thetas = (math.nan,) * 2 if pose is None else (math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad))
        chance = tracked.track.probability
        self._rows[frame.index] = (
            frame.index / _NOMINAL_HZ if frame.time_s is None else frame.time_s,
            *place,
            *thetas,
            math.nan if ellipse is None else ellipse.eccentricity,
            math.nan if chance is None else chance,
            float(tracked.track.lost or tracked.track.predicted),
        )
        while len(self._rows) > MOST_POINTS:
            del self._rows[next(iter(self._rows))]

    def rows(self, first: int = 0, last: int | None = None) -> list[tuple[int, tuple[float, ...]]]:
        """Return the frames from ``first`` to ``last`` that are known, in order, with the columns of each."""
        if last is not None:
            return [(index, self._rows[index]) for index in range(first, last + 1) if index in self._rows]
        return [(index, self._rows[index]) for index in sorted(self._rows) if index >= first]

    def path_m(self, last: int, seconds: float) -> np.ndarray:
        """Positions (N, 3) of the dock's centre, in the camera's frame, where it was seen so long before a frame."""
        since_s, lost = self._rows[last][0] - seconds, COLUMNS.index("lost")
        known = (row for _, row in self.rows(max(0, last - _MOST_ON_PATH), last) if row[0] >= since_s)
        return np.array([row for row in known if not (row[lost] or math.isnan(row[1]))]).reshape(-1, len(COLUMNS))[
            :, 1:4
        ]


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
    def fitting_lights(self) -> int | None:
        """How many lights form a ring where the dock's number finds none or fewer than there are; None for none."""
        found, view, lights = self.estimate, self.view, self.view.dock.lights
        seen, groups = found.lights_on_ring or 0, 0 if found.markers is None else len(found.markers)
        is_ok = found.status == "ok"
        if lights is None or view.set_lights is not None or (is_ok and (seen >= groups or seen == lights)):
            return None
        free = estimate(view.image, view.camera, Dock(view.dock.diameter), view.settings)
        if free.status != "ok" or free.ring is None or (free.lights_on_ring or 0) <= (seen if is_ok else 0):
            return None
        return None if free.ring.lights == lights else free.ring.lights

    @cached_property
    def shown(self) -> Estimate:
        """The estimate with each pose as likely as the verdict says: in a sequence, by all its frames."""
        found, tracked = self.estimate, None if self.tracked_frame is None else self.tracked_frame.tracked
        likely = None if tracked is None or tracked.index is None else tracked.track.probability
        if tracked is None or likely is None or found.choice is None:
            return found
        return replace(found, choice=found.choice.with_first(1 - likely if tracked.index else likely))

    @cached_property
    def trust(self) -> Trust:
        """How far the result can be trusted; in a sequence with the probability that the track gives."""
        tracked = None if self.tracked_frame is None else self.tracked_frame.tracked
        view, camera = self.view, self.view.camera
        ratios = camera.fx / camera.fy, view.given_fx_per_fy
        lights = self.fitting_lights
        return trust_of(self.estimate, tracked, assumed=view.assumed, fitting_lights=lights, fx_per_fy=ratios)


def analyse(view: View, last: Analysis | None = None) -> Analysis:
    """Render a stale view, run the pipeline, and choose by hand; ``last`` saves work on the same picture."""
    view = rendered(view)
    previous = last.estimate if last is not None and last.view.image is view.image else None
    lights = {} if view.set_lights is None else msgspec.structs.asdict(view.set_lights)
    found = estimate(view.image, view.camera, view.dock, view.settings, previous=previous, **lights)
    return Analysis(view, chosen_by_hand(found, view.by_hand))


def chosen_by_hand(found: Estimate, normal: tuple[float, float, float] | None) -> Estimate:
    """Select the candidate whose normal is nearest to ``normal``, if there is one."""
    return select_pose(found, nearest_pose(found, normal), "hand", "which was chosen by hand")


def nearest_pose(found: Estimate, normal: tuple[float, float, float] | None) -> int | None:
    """Index of the candidate whose normal is nearest to ``normal``; None without candidates, or without a normal."""
    if normal is None or not found.candidates:
        return None
    return int(np.argmax([pose.normal @ np.array(normal) for pose in found.candidates]))


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


def estimate_again(image: np.ndarray, line: dict[str, Any]) -> Estimate:
    """Estimate as a line of schema 1 says, with its choice by hand or track. ValueError names what it lacks."""
    parts = {}
    for name, kind in (("camera", Camera), ("dock", Dock), ("settings", Settings), ("by_hand", ByHand | None)):
        try:
            parts[name] = msgspec.convert(({"by_hand": None} | line)[name], kind)  # older versions wrote none
        except KeyError as error:
            raise ValueError(f"has no {name}") from error
        except msgspec.ValidationError as error:
            raise ValueError(f"{name}: {error}") from error
    by_hand = parts.pop("by_hand")
    found = estimate(image, **parts, **({} if by_hand is None else msgspec.structs.asdict(by_hand)))
    chosen_by = line.get("selected_by")
    if chosen_by not in _FROM_OUTSIDE:
        return found
    try:
        x, y, z = line["candidates"][line["selected"]]["normal"]
        index = nearest_pose(found, (float(x), float(y), float(z)))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ValueError(f"says that a pose was chosen by {chosen_by}, but not which") from error
    return select_pose(found, index, chosen_by)


def differences(line: dict[str, Any], found: Estimate) -> list[tuple[str, Any, Any]]:
    """Name, stored and new value of what differs by more than rounding; of lists of different length, the lengths."""
    new = msgspec.json.decode(msgspec.json.encode(found.to_dict()))
    return [entry for name in _COMPARED if name in line for entry in _different(name, line[name], new.get(name))]


def _different(name: str, stored: Any, new: Any) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(stored, dict) and isinstance(new, dict):
        for key in stored:
            yield from _different(f"{name}.{key}", stored[key], new.get(key))
    elif isinstance(stored, list) and isinstance(new, list):
        if len(stored) != len(new):
            yield f"number of {name}", len(stored), len(new)
            return
        for index, (one, other) in enumerate(zip(stored, new, strict=True)):
            yield from _different(f"{name}[{index}]", one, other)
    elif isinstance(stored, float) and isinstance(new, float):
        if not (stored == new or math.isclose(stored, new, rel_tol=ROUNDING, abs_tol=ROUNDING)):
            yield name, stored, new
    elif stored != new:
        yield name, stored, new
