"""One look at a picture, from a threshold on: markers, ring, ellipse, poses and choice."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.tone import linear, linear_level
from dockpose.dock import Dock
from dockpose.estimate.attempt import Attempt
from dockpose.estimate.result import Estimate
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError
from dockpose.lights.markers import Markers, find_markers, with_fitted_centres
from dockpose.lights.region import ring_in
from dockpose.lights.ring import Kind, Ring
from dockpose.pixels.bright import SATURATED
from dockpose.pose.choice import Choice
from dockpose.pose.detection import accept_pose, detection_of, evenly_spaced_part, few_in_words, found_in_words
from dockpose.pose.extra import with_extra_lights
from dockpose.pose.strokes import reason_not_lamps
from dockpose.settings import Settings
from dockpose.thresholds import Histogram, Threshold

# Behind a port a ring's picture is an ellipse only as seen from somewhere; this far away it is one for the ring search.
LIKELY_RANGE_M = 1.0
_LIGHTS_OF = attrgetter("lights", "angles_deg", "offsets_m")


@dataclass(frozen=True)
class Picture:
    """What is looked at: the picture or a part of it."""

    image: np.ndarray  # of the part
    grey: np.ndarray  # of the part
    histogram: Histogram  # of the part
    part: tuple[int, int, int, int]  # left, top, right and bottom of it
    width: int  # of the whole picture, in pixels
    height: int
    previous: Estimate | None  # another estimate of it, whose threshold and groups hold here
    tone: str | float  # curve of the camera
    min_channel: bool = False  # whether ``grey`` is the darkest of the colour channels

    @property
    def area_px2(self) -> float:
        """Of the whole picture, in which chance may make rings."""
        return float(self.width * self.height)

    @cached_property
    def light(self) -> tuple[np.ndarray, float]:
        """The part in linear light, and from which of its levels on that is saturated."""
        step = self.histogram.native_step
        return linear(self.grey, step, self.tone), linear_level(SATURATED, step, self.tone)


def detect_once(
    seen: Threshold | Attempt,
    picture: Picture,
    camera: Camera,
    dock: Dock,
    settings: Settings,
    kind: Kind = "exact",
    earlier: Sequence[Attempt] = (),
) -> Attempt:
    """What is found from a threshold on, or from an attempt's groups, unless an earlier one found no ring in these."""
    status, message, stages = _find_lights(picture, seen, camera, dock, settings, kind, earlier)
    if status != "ok":
        return Attempt(status, message, stages)
    return Attempt(*judge_ring(picture, camera, dock, stages))


def judge_ring(
    picture: Picture, camera: Camera, dock: Dock, stages: dict[str, Any]
) -> tuple[str, str, dict[str, Any], float]:
    """Status, message, stages and log of the chance of a ring; its threshold, markers and ring are in ``stages``."""
    ring, told = stages["ring"], dock
    if ring.focal_px is None and ring.lights and ring.on_ring.sum() < MIN_POINTS:
        dock = dock.with_lights(ring.lights)
    try:
        ellipse, choice, log_chance, reason = _accepted(ring, picture, stages["markers"], camera, dock)
        known = dock.with_lights(dock.lights or ring.lights)
        part = evenly_spaced_part(ring, stages["markers"], choice, camera, known)
        if part is not None:
            ring = part
            ellipse, choice, log_chance, reason = _accepted(ring, picture, stages["markers"], camera, dock)
        if choice.number is not None:
            ring = replace(ring, lights=choice.number)
        stages["ring"] = ring
    except NoEllipseError as error:
        if (lights := int(ring.on_ring.sum())) < MIN_POINTS:
            kept = {name: stages[name] for name in ("threshold", "markers")}
            found = few_in_words(stages["markers"], lights)
            return "too_few_markers", f"{found}, too few for an ellipse, and {error}.", kept, math.inf
        return "no_ellipse", f"No ellipse: {error}.", stages, math.inf
    if reason is not None:
        return "not_a_ring", reason, stages, log_chance
    choice = weighed_by_extra_lights(choice, ring, stages["markers"], picture, camera, dock)
    stages |= {"ellipse": ellipse, "choice": choice, "detection": detection_of(log_chance, ring, choice, camera, told)}
    return "ok", found_in_words(ring, choice, camera, dock), stages, log_chance


def weighed_by_extra_lights(
    choice: Choice, ring: Ring, markers: Markers, picture: Picture, camera: Camera, dock: Dock
) -> Choice:
    """The choice with what a dock's extra lights tell of it, if it has any."""
    if not dock.extra_lights_m:
        return choice
    lights, density = markers.part(ring.on_ring), (1 + np.count_nonzero(~ring.on_ring)) / picture.area_px2
    return with_extra_lights(choice, picture.light[0], picture.part[:2], lights, density, camera, dock)


def _find_lights(
    picture: Picture,
    seen: Threshold | Attempt,
    camera: Camera,
    dock: Dock,
    settings: Settings,
    kind: Kind,
    earlier: Sequence[Attempt],
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and the stages from the threshold to the ring."""
    previous, ring = picture.previous, None
    threshold: Threshold = seen.stages["threshold"] if isinstance(seen, Attempt) else seen
    if isinstance(seen, Attempt):
        markers: Markers = seen.stages["markers"].unfitted
        stages: dict[str, Any] = {"threshold": threshold, "markers": markers}
    elif previous is not None and previous.markers is not None and threshold is previous.threshold:
        is_same = previous.camera == camera and _LIGHTS_OF(previous.dock) == _LIGHTS_OF(dock)
        ring = previous.ring if is_same else None  # whatever the dock's diameter
        markers = previous.markers.unfitted if ring is None else previous.markers
        stages = {"threshold": threshold, "markers": markers}
    else:
        stages = {"threshold": threshold}
        light, _ = picture.light
        markers = stages["markers"] = find_markers(
            light, picture.histogram, threshold, settings.min_area_px, settings.centroid
        )
    count = len(markers)
    if count == 0:
        small = f"all {markers.dropped} groups at level {threshold.level} are below {settings.min_area_px} pixels."
        why = small if markers.dropped else f"{threshold.reason[:1].lower()}{threshold.reason[1:]}"
        return "no_lights", f"No lights: {why}", stages
    if dock.lights is not None and min(4, dock.lights) <= count < MIN_POINTS:
        few = f"{count} groups, too few for an ellipse: their spacing must tell."
        stages["ring"] = Ring(np.ones(count, dtype=bool), few)
        return "ok", "", stages
    if count < MIN_POINTS:
        small = f" and {markers.dropped} below {settings.min_area_px} pixels" if markers.dropped else ""
        found = f"{few_in_words(markers, count)}{small} at level {threshold.level}"
        four = " Four do if the dock's number of lights is given: --lights 4." if count == 4 else ""
        return "too_few_markers", f"{found}; an ellipse needs {MIN_POINTS}.{four}", stages
    same = next((one for one in earlier if one.has_no_ring_in(markers)), None)
    if same is not None:
        return same.status, same.message, stages | {"ring": same.stages["ring"]}
    is_new = ring is None
    if ring is None:
        points_px = camera.virtual_pixels(markers.points_px, LIKELY_RANGE_M)
        ring = ring_in(points_px, markers, camera, dock, picture.area_px2, kind)
    stages["ring"] = ring
    if not ring.found:
        return "not_a_ring", ring.reason, stages
    if settings.centroid == "grey" and is_new:
        middle_px = camera.cx, camera.cy
        stages["markers"] = with_fitted_centres(markers, ring.on_ring, *picture.light, middle_px)
    return "ok", "", stages


def _accepted(
    ring: Ring, picture: Picture, markers: Markers, camera: Camera, dock: Dock
) -> tuple[Ellipse, Choice, float, str | None]:
    """Ellipse, poses, log of the chance and why a ring is no dock."""
    ellipse, choice, log_chance, reason = accept_pose(ring, markers, camera, dock, picture.area_px2)
    pose = choice.candidates[choice.selected]
    # Of another diameter the same lights were looked at before.
    is_known = picture.previous is not None and picture.previous.status == "ok" and ring is picture.previous.ring
    if reason is None and not is_known:
        reason = reason_not_lamps(picture.light[0], picture.part[:2], ring, markers, pose, camera, dock)
    return ellipse, choice, log_chance, reason
