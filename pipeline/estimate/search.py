"""The search for a dock in the pixels of one picture: by one level, by each light's own, by size, and in white."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import Any

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import darkest_channel
from dockpose.camera.tone import linear, linear_level
from dockpose.dock import Dock
from dockpose.estimate.found import EXACT_OF_AXIS, LITTLE_CHANCE, NO_CHANCE, Found
from dockpose.estimate.result import Estimate
from dockpose.lights.colours import tell_colours
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError
from dockpose.lights.markers import Markers, find_markers, with_fitted_centres
from dockpose.lights.polygon import FIRST_POINTS
from dockpose.lights.region import ring_in
from dockpose.lights.ring import Kind, Ring
from dockpose.pixels.bright import SATURATED
from dockpose.pose.choice import Choice
from dockpose.pose.detection import detection_of, few_in_words, found_in_words, judged, spaced_alone
from dockpose.pose.strokes import why_no_lights
from dockpose.settings import Settings
from dockpose.thresholds import METHODS, Histogram, MethodError, Threshold, hats_local, histogram_of
from dockpose.thresholds.outlines import by_outlines
from dockpose.thresholds.scales import at_scales

# Behind a port a ring's picture is an ellipse only as seen from somewhere; this far away it is one for the ring search.
LIKELY_RANGE_M = 1.0
_CLEAR = 3  # looks in which rings are sought that hands have built
# Three quarters of a ring lie nearer to their places, root mean square, only by the right number: of one more or one
# less they are farther off for any ring of up to 60 lights.
_ONE_MORE_OF_AXIS = 0.02
_IN_WHITE = " It shows where the picture is white, in the darkest of its colour channels."
_LIGHTS_OF = attrgetter("lights", "angles_deg", "colours", "offsets_m")


@dataclass(frozen=True)
class Picture:
    """What is looked at: the picture or a part of it."""

    image: np.ndarray  # of the part
    grey: np.ndarray  # of the part
    histogram: Histogram  # of the part
    part: tuple[int, int, int, int]  # left, top, right and bottom of it
    width: int  # of the whole picture, in pixels
    height: int
    like: Estimate | None  # another estimate of it, whose threshold and groups hold here
    tone: str | float  # curve of the camera
    in_white: bool = False  # whether ``grey`` is the darkest of the colour channels

    @property
    def area_px2(self) -> float:
        """Of the whole picture, in which chance may make rings."""
        return float(self.width * self.height)

    @cached_property
    def light(self) -> tuple[np.ndarray, float]:
        """The part in linear light, and from which of its levels on that is saturated."""
        step = self.histogram.native_step
        return linear(self.grey, step, self.tone), linear_level(SATURATED, step, self.tone)


def search(
    picture: Picture, camera: Camera, dock: Dock, settings: Settings, fall_back: bool
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and the stages that were reached."""
    like = None if picture.like is None else picture.like.threshold
    try:
        if like is not None and like.method == settings.method:  # and not that of the lights one by one
            threshold = like
        else:
            threshold = METHODS[settings.method](picture.histogram, settings.min_area_px, settings.level)
    except MethodError as error:
        return "method_failed", f"{str(error)[:1].upper()}{str(error)[1:]}.", {}
    first = _search_with(threshold, picture, camera, dock, settings)
    if settings.method != "hats" or not fall_back or first.is_exact():
        return first.status, first.message, first.stages
    best = _search_by_light(first, picture, camera, dock, settings)
    white = False
    own = "" if best is first or best.status != "ok" else " No one level shows the ring; each light was given its own."
    if best.status != "ok" or best.stages["ring"].focal_px is not None:
        second = _search_in_white(picture, camera, dock, settings)
        if second is not None and second.rank() > best.rank():
            best, own, white = second, _IN_WHITE, True
    return best.status, best.message + own, best.stages | {"in_white": white}


def _search_in_white(picture: Picture, camera: Camera, dock: Dock, settings: Settings) -> Found | None:
    """What the darkest channel shows, as a sure ring or not at all; None of a picture without colours."""
    grey = darkest_channel(picture.image)
    if grey is None:
        return None
    counted = picture.histogram.counted
    if counted is not None:
        grey[counted == 0] = 0
    white = replace(picture, grey=grey, histogram=histogram_of(grey, counted), like=None, in_white=True)
    threshold = METHODS[settings.method](white.histogram, settings.min_area_px, settings.level)
    found = _search_with(threshold, white, camera, dock, settings)
    if not found.is_exact():
        found = _search_by_light(found, white, camera, dock, settings)
    return found if found.status == "ok" and found.log_chance < LITTLE_CHANCE else None


def _search_by_light(first: Found, picture: Picture, camera: Camera, dock: Dock, settings: Settings) -> Found:
    """The best of what one level shows, and of what each light's own level, each scale and each outline do."""
    best, looks = first, [first]
    for other, least in _other_looks(picture, settings, dock, looks):
        # Of an unknown number, any few points of some scale make some ring.
        kind = "exact" if dock.lights is not None or least == math.inf else "of many"
        found = _search_with(other, picture, camera, dock, settings, kind, looks)
        looks.append(found)
        may_be_it = found.status != "ok" or found.log_chance < least
        if may_be_it and not best.knows_better(found):  # a builder's errors are no reason for a blurred look
            best = max(best, found, key=Found.rank)
        if best.is_exact(EXACT_OF_AXIS):
            break
    clear = [] if best.is_exact(EXACT_OF_AXIS) else list(_clear(looks))
    # A ring of another number shows in any channel.
    is_asked = bool(clear) and not picture.in_white and not best.is_exact(_ONE_MORE_OF_AXIS)
    other = _of_another_number(clear[0], picture, camera, dock, settings) if is_asked else None
    if other is not None and other.log_chance < best.log_chance:
        return other
    made = [_search_with(one, picture, camera, dock, settings, "handmade") for one in clear if best.status != "ok"]
    return max([best, *made], key=Found.rank)


def _of_another_number(
    threshold: Threshold, picture: Picture, camera: Camera, dock: Dock, settings: Settings
) -> Found | None:
    """A whole ring of even lights, beyond chance, of another number than the dock's; None where there is none."""
    if dock.lights is None or dock.angles_deg or dock.offsets_m:
        return None
    free = msgspec.structs.replace(dock, lights=None, colours=())
    found = _search_with(threshold, picture, camera, free, settings, "whole")
    if found.status != "ok" or found.log_chance >= NO_CHANCE:
        return None
    ring: Ring = found.stages["ring"]
    if ring.focal_px is not None or ring.lights == dock.lights or ring.lights != int(ring.on_ring.sum()):
        return None
    seen = f"{ring.lights} evenly spaced lights are in view; the dock has {dock.lights}: is that right?"
    stages = found.stages | {"ring": Ring(np.zeros_like(ring.on_ring), seen, lights=ring.lights)}
    return Found(
        "not_a_ring", seen, {name: stages[name] for name in ("threshold", "markers", "ring")}, found.log_chance
    )


def _clear(looks: Sequence[Found]) -> Iterator[Threshold]:
    """The thresholds of the first looks that show so few groups that these may be a dock's lights, each of others."""
    clear: list[Found] = []
    for look in looks:
        markers = look.stages.get("markers")
        if markers is None or len(clear) == _CLEAR or not MIN_POINTS <= len(markers) <= FIRST_POINTS:
            continue
        if not any(one.has_no_ring_in(markers) for one in clear):
            clear.append(look)
            yield look.stages["threshold"]


def _other_looks(
    picture: Picture, settings: Settings, dock: Dock, looks: Sequence[Found]
) -> Iterator[tuple[Threshold, float]]:
    """Thresholds but that of one level, and log of the chance above which a ring of each is none; ``looks`` grow.

    Outlines show lights that run together. Where there is a ring by then, its centres are better known; and along a
    hoop middles show a ring of some number. All clutter has edges, so that what they show must be beyond chance.
    What shows no light by any size has no discs that run together; and where a picture is white, lights are small.
    """
    histogram = picture.histogram
    yield hats_local(histogram, settings.min_area_px), math.inf
    for scale in at_scales(histogram, settings.min_area_px):
        yield scale, LITTLE_CHANCE
    is_sure = any(one.status == "ok" and one.log_chance < LITTLE_CHANCE for one in looks)
    if (
        dock.lights is not None
        and not picture.in_white
        and not is_sure
        and any(one.status != "no_lights" for one in looks)
    ):
        for outlined in by_outlines(histogram, settings.min_area_px):
            yield outlined, NO_CHANCE


def _search_with(
    threshold: Threshold,
    picture: Picture,
    camera: Camera,
    dock: Dock,
    settings: Settings,
    kind: Kind = "exact",
    looks: Sequence[Found] = (),
) -> Found:
    """What is found from one threshold on, of rings of a kind; ``looks`` came before it."""
    status, message, stages = _find_lights(picture, threshold, camera, dock, settings, kind, looks)
    if status != "ok":
        return Found(status, message, stages)
    return Found(*judge_ring(picture, camera, dock, stages))


def judge_ring(
    picture: Picture, camera: Camera, dock: Dock, stages: dict[str, Any]
) -> tuple[str, str, dict[str, Any], float]:
    """Status, message, stages and log of the chance of a ring; its threshold, markers and ring are in ``stages``."""
    ring = stages["ring"]
    if ring.focal_px is not None:  # the spacing would only tell how wrong the camera is
        dock = msgspec.structs.replace(dock, lights=None)
    elif dock.lights is None and ring.lights:
        dock = msgspec.structs.replace(dock, lights=ring.lights)
    try:
        ellipse, choice, log_chance, reason = _judged(ring, picture, stages["markers"], camera, dock)
        if choice.lights is None and (alone := spaced_alone(ring, stages["markers"], choice, camera, dock)) is not None:
            ring = stages["ring"] = alone
            ellipse, choice, log_chance, reason = _judged(ring, picture, stages["markers"], camera, dock)
    except NoEllipseError as error:
        if (lights := int(ring.on_ring.sum())) < MIN_POINTS:
            kept = {name: stages[name] for name in ("threshold", "markers")}
            found = few_in_words(stages["markers"], lights)
            return "too_few_markers", f"{found}, too few for an ellipse, and {error}.", kept, math.inf
        return "no_ellipse", f"No ellipse: {error}.", stages, math.inf
    if reason is not None:
        return "not_a_ring", reason, stages, log_chance
    stages |= {"ellipse": ellipse, "choice": choice, "detection": detection_of(log_chance, ring.alike)}
    return "ok", found_in_words(ring, choice, camera, dock), stages, log_chance


def _find_lights(
    picture: Picture,
    threshold: Threshold,
    camera: Camera,
    dock: Dock,
    settings: Settings,
    kind: Kind,
    looks: Sequence[Found],
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and the stages from the threshold to the ring."""
    like, ring = picture.like, None
    if like is not None and like.markers is not None and threshold is like.threshold:
        ring = _ring_of(like, camera, dock)
        markers = like.markers.unfitted if ring is None else like.markers
        stages: dict[str, Any] = {"threshold": threshold, "markers": markers}
    else:
        stages = {"threshold": threshold}
        light, _ = picture.light
        markers = stages["markers"] = find_markers(
            light, picture.histogram, threshold, settings.min_area_px, settings.centroid
        )
    count = len(markers)
    if count == 0 and markers.dropped:
        small = f"all {markers.dropped} groups at level {threshold.level} are below {settings.min_area_px} pixels"
        return "no_lights", f"No lights: {small}.", stages
    if count == 0:
        return "no_lights", f"No lights: {threshold.reason[:1].lower()}{threshold.reason[1:]}", stages
    if dock.lights is not None and min(4, dock.lights) <= count < MIN_POINTS:
        few = f"{count} groups, too few for an ellipse: their spacing must tell."
        stages["ring"] = Ring(np.ones(count, dtype=bool), few)
        return "ok", "", stages
    if count < MIN_POINTS:
        small = f" and {markers.dropped} below {settings.min_area_px} pixels" if markers.dropped else ""
        found = f"{few_in_words(markers, count)}{small} at level {threshold.level}"
        four = " Four do if the dock's number of lights is given: --lights 4." if count == 4 else ""
        return "too_few_markers", f"{found}; an ellipse needs {MIN_POINTS}.{four}", stages
    same = next((one for one in looks if one.has_no_ring_in(markers)), None)
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


def _ring_of(like: Estimate, camera: Camera, dock: Dock) -> Ring | None:
    """The ring of another estimate, if it is that of this camera and dock too, whatever the dock's diameter."""
    return like.ring if like.camera == camera and _LIGHTS_OF(like.dock) == _LIGHTS_OF(dock) else None


def _judged(
    ring: Ring, picture: Picture, markers: Markers, camera: Camera, dock: Dock
) -> tuple[Ellipse, Choice, float, str | None]:
    """Ellipse, poses, log of the chance and why a ring is no dock, by its lights' colours where the dock has any."""
    labels: list[str | None] | None = None
    if dock.colours:
        points_px = markers.points_px[ring.on_ring] - picture.part[:2]
        labels = tell_colours(picture.image, points_px, markers.areas_px[ring.on_ring])
    ellipse, choice, log_chance, reason = judged(ring, markers, camera, dock, picture.area_px2, labels)
    pose = choice.candidates[choice.selected]
    # Of another diameter the same lights were looked at before.
    is_known = picture.like is not None and picture.like.status == "ok" and ring is picture.like.ring
    if reason is None and not is_known:
        reason = why_no_lights(picture.light[0], picture.part[:2], ring, markers, pose, camera, dock)
    return ellipse, choice, log_chance, reason
