"""The search for a dock in the pixels of one picture: by one level, by each light's own, by size, and in white."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import darkest_channel
from dockpose.dock import Dock
from dockpose.estimate.attempt import EXACT_OF_AXIS, LITTLE_CHANCE, NO_CHANCE, Attempt
from dockpose.estimate.stages import Picture, detect_once
from dockpose.lights.chance import FIRST_POINTS
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.growing import TOLERANCE_OF_AXIS
from dockpose.lights.polygon import BY_CORNERS
from dockpose.lights.ring import Ring
from dockpose.settings import Settings
from dockpose.thresholds import METHODS, Threshold, hats_local, histogram_of
from dockpose.thresholds.outlines import by_outlines
from dockpose.thresholds.scales import at_scales

_CLEAR = 3  # looks in which rings are sought that hands have built
_COLOURED, _NEARLY = 4, 0.8  # colours hide white lights: pixels nearly as bright, for each white one of these
_OWN = " No one level shows the ring; each light was given its own."
_OWN_BETTER = " By a level for each light the ring is surer than by one level for all."
_MIN_CHANNEL = " It shows where the picture is white, in the darkest of its colour channels."


def search(
    picture: Picture, camera: Camera, dock: Dock, settings: Settings, fall_back: bool
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and the stages that were reached. Raises MethodError where the threshold's method fails."""
    threshold = None if picture.previous is None else picture.previous.threshold
    if threshold is None or threshold.method != settings.method:  # as that of the lights one by one
        threshold = METHODS[settings.method](picture.histogram, settings.min_area_px, settings.level)
    first = detect_once(threshold, picture, camera, dock, settings)
    if settings.method != "hats" or not fall_back or first.is_exact():
        return first.status, first.message, first.stages
    looks, white = [first], False
    best = _search_by_light(looks, picture, camera, dock, settings)
    own = "" if best is first or best.status != "ok" else _OWN_BETTER if first.status == "ok" else _OWN
    if best.suggests_count:
        return best.status, best.message, best.stages
    if best.status != "ok" or best.stages["ring"].focal_px is not None:
        second = _search_in_white(looks, picture, camera, dock, settings)
        if second is not None and second.rank() > best.rank():
            best, own, white = second, _MIN_CHANNEL, True
    if best.status != "ok":
        best = max([best, *_faint(picture, camera, dock, settings)], key=Attempt.rank)
    return best.status, best.message + own, best.stages | {"min_channel": white}


def _search_in_white(
    looks: Sequence[Attempt], picture: Picture, camera: Camera, dock: Dock, settings: Settings
) -> Attempt | None:
    """What the darkest channel shows, as a sure ring or not at all; None of a picture without colours.

    It is searched where other looks hint at a ring, where white lights stand before colours that are as bright, and for
    more lights than their corners tell, whose glow runs together.
    """
    grey = darkest_channel(picture.image)
    if grey is None:
        return None
    counted = picture.histogram.counted
    if counted is not None:
        grey[counted == 0] = 0
    white = replace(picture, grey=grey, histogram=histogram_of(grey, counted), previous=None, min_channel=True)
    threshold = METHODS[settings.method](white.histogram, settings.min_area_px, settings.level)
    least = _NEARLY * threshold.level * white.histogram.native_step
    as_bright, of_white = (np.count_nonzero(each >= least) for each in (picture.grey, grey))
    is_before_colours = as_bright > _COLOURED * of_white and of_white >= MIN_POINTS * settings.min_area_px
    is_hinted_at = any(one.hints_at_ring for one in looks) or (dock.lights or 0) >= BY_CORNERS.stop
    if not (is_before_colours or is_hinted_at):
        return None
    found = detect_once(threshold, white, camera, dock, settings)
    if not found.is_exact():
        found = _search_by_light([found], white, camera, dock, settings)
    return found if found.status == "ok" and found.log_chance < LITTLE_CHANCE else None


def _faint(picture: Picture, camera: Camera, dock: Dock, settings: Settings) -> Iterator[Attempt]:
    """Rings beyond chance of lights that hardly stand out of the noise, at each scale."""
    kind = "of many" if dock.lights is None else "exact"
    for scale in at_scales(picture.histogram, settings.min_area_px, faint=True):
        found = detect_once(scale, picture, camera, dock, settings, kind)
        if found.status == "ok" and found.log_chance < NO_CHANCE:
            yield found


def _search_by_light(looks: list[Attempt], picture: Picture, camera: Camera, dock: Dock, settings: Settings) -> Attempt:
    """The best of what one level shows, first of ``looks``, and of all other ways to tell lights, which are added."""
    best = looks[0]
    for other, least in _other_looks(picture, settings, dock, looks):
        # Of an unknown number, any few points of some scale make some ring.
        kind = "exact" if dock.lights is not None or least == math.inf else "of many"
        found = detect_once(other, picture, camera, dock, settings, kind, looks)
        looks.append(found)
        may_be_it = found.status != "ok" or found.log_chance < least
        if may_be_it and not best.has_better_centres_than(found):  # a builder's errors are no reason for a blurred look
            best = max(best, found, key=Attempt.rank)
        if best.is_exact(EXACT_OF_AXIS):
            break
    clear = [] if best.is_exact(EXACT_OF_AXIS) else list(_clear(looks))
    # A ring of another number shows in any channel, and has no light near each of the dock's places.
    is_asked = bool(clear) and not picture.min_channel and not (best.rank()[2] and best.is_exact(TOLERANCE_OF_AXIS))
    other = _of_another_number(clear[0], picture, camera, dock, settings) if is_asked else None
    if other is not None and other.log_chance < best.log_chance:
        return other
    # Of a ring that hands have built, few lights happen to be in their places; all of them together are less by chance.
    begun = clear if best.status != "ok" else _clear([best]) if best.has_unexplained_groups else ()
    made = [detect_once(one, picture, camera, dock, settings, "handmade") for one in begun]
    likelier = [one for one in made if best.status != "ok" or one.log_chance < best.log_chance]
    return max([best, *likelier], key=Attempt.rank)


def _of_another_number(
    clear: Attempt, picture: Picture, camera: Camera, dock: Dock, settings: Settings
) -> Attempt | None:
    """A whole ring of even lights, beyond chance, of another number than the dock's; None where there is none."""
    if dock.lights is None or dock.angles_deg or dock.offsets_m:
        return None
    free = dock.with_lights(None)
    found = detect_once(clear, picture, camera, free, settings, "whole")
    if found.status != "ok" or found.log_chance >= NO_CHANCE:
        return None
    ring: Ring = found.stages["ring"]
    if ring.focal_px is not None or ring.lights == dock.lights or ring.lights != int(ring.on_ring.sum()):
        return None
    seen = f"{ring.lights} evenly spaced lights are in view; the dock has {dock.lights}: is that right?"
    none = Ring(np.zeros_like(ring.on_ring), seen, lights=ring.lights)
    stages = {name: found.stages[name] for name in ("threshold", "markers")} | {"ring": none}
    return Attempt("not_a_ring", seen, stages, found.log_chance)


def _clear(looks: Sequence[Attempt]) -> Iterator[Attempt]:
    """The first looks that show so few groups that these may be a dock's lights, each of others."""
    clear: list[Attempt] = []
    for one in looks:
        markers = one.stages.get("markers")
        if markers is None or len(clear) == _CLEAR or not MIN_POINTS <= len(markers) <= FIRST_POINTS:
            continue
        if not any(other.has_no_ring_in(markers) for other in clear):
            clear.append(one)
            yield one


def _other_looks(
    picture: Picture, settings: Settings, dock: Dock, looks: Sequence[Attempt]
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
        and not picture.min_channel
        and not is_sure
        and any(one.status != "no_lights" for one in looks)
    ):
        for outlined in by_outlines(histogram, settings.min_area_px):
            yield outlined, NO_CHANCE
