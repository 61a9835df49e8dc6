"""The search for a dock in the pixels of one picture: by one level, then among all that stands out by itself."""

import math
from typing import Any

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate.found import EXACT_OF_AXIS, LITTLE_CHANCE, NO_CHANCE, Found
from dockpose.estimate.stages import Picture, look
from dockpose.estimate.views import View, faint_views, key_of, views
from dockpose.lights.chance import FIRST_POINTS
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.exact import Kind
from dockpose.lights.ring import Ring
from dockpose.lights.whole import TOLERANCE_OF_AXIS
from dockpose.settings import Settings
from dockpose.thresholds import METHODS, MethodError

_CLEAR = 3  # looks in which rings are sought that hands have built


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
    first = look(threshold, picture, camera, dock, settings)
    if settings.method != "hats" or not fall_back or first.is_exact():
        return first.status, first.message, first.stages
    best = _search_by_light(first, picture, camera, dock, settings)
    own = "" if best is first or best.status != "ok" else " No one level shows the ring; each light was given its own."
    if best.status == "ok" and best.stages.get("in_white"):
        own = " It shows where the picture is white, in the darkest of its colour channels."
    return best.status, best.message + own, best.stages


def _search_by_light(first: Found, picture: Picture, camera: Camera, dock: Dock, settings: Settings) -> Found:
    """The best of what one level shows, and of what lights do that each have their own."""
    best, plain = first, [first]
    tried = {key_of(first.stages["markers"])} if "markers" in first.stages else set[bytes]()
    for list_of in views(picture, settings, tried):
        for view in list_of:
            is_plain = not view.picture.in_white and not view.blur_px
            if not is_plain and best.is_beyond_chance:
                break
            found = _look_at(view, camera, dock, settings)
            plain += [found] * is_plain
            least = NO_CHANCE if view.blur_px else math.inf if is_plain and view.is_whole else LITTLE_CHANCE
            may_be_it = found.status != "ok" or found.log_chance < least
            if may_be_it and not best.has_better_centres_than(found):  # a builder's errors are no reason for another
                best = max(best, found, key=Found.rank)
            if best.is_exact(EXACT_OF_AXIS):
                return best
    clear = [one for one in plain if _is_clear(one)][:_CLEAR]
    other = _of_another_number(clear[0], best, picture, camera, dock, settings) if clear else None
    if other is not None:
        return other
    # Of a ring that hands have built, few lights happen to be in their places; all of them together are less by chance.
    begun = clear if best.status != "ok" else [best] if best.leaves_lights and _is_clear(best) else []
    made = [look(one, picture, camera, dock, settings, "handmade") for one in begun]
    likelier = [one for one in made if best.status != "ok" or one.log_chance < best.log_chance]
    best = max([best, *likelier], key=Found.rank)
    if best.status != "ok":
        faint = [_look_at(view, camera, dock, settings) for view in faint_views(picture, settings, tried)]
        best = max([best, *(one for one in faint if one.log_chance < NO_CHANCE)], key=Found.rank)
    return best


def _look_at(view: View, camera: Camera, dock: Dock, settings: Settings) -> Found:
    """What a view shows; of an unknown number, any few points of some size make some ring."""
    kind: Kind = "exact" if dock.lights is not None or (view.is_whole and not view.blur_px) else "of many"
    found = look(view.found, view.picture, camera, dock, settings, kind)
    found.stages["in_white"] = view.picture.in_white
    return found


def _of_another_number(
    clear: Found, best: Found, picture: Picture, camera: Camera, dock: Dock, settings: Settings
) -> Found | None:
    """A whole ring of even lights, beyond chance and the best ring, of another number than the dock's; else None."""
    if dock.lights is None or dock.angles_deg or dock.offsets_m:
        return None
    if best.rank()[2] and best.is_exact(TOLERANCE_OF_AXIS):  # it has no light near each of the dock's places
        return None
    free = msgspec.structs.replace(dock, lights=None)
    found = look(clear, picture, camera, free, settings, "whole")
    if found.status != "ok" or found.log_chance >= min(NO_CHANCE, best.log_chance):
        return None
    ring: Ring = found.stages["ring"]
    if ring.focal_px is not None or ring.lights == dock.lights or ring.lights != int(ring.on_ring.sum()):
        return None
    seen = f"{ring.lights} evenly spaced lights are in view; the dock has {dock.lights}: is that right?"
    stages = found.stages | {"ring": Ring(np.zeros_like(ring.on_ring), seen, lights=ring.lights)}
    return Found(
        "not_a_ring", seen, {name: stages[name] for name in ("threshold", "markers", "ring")}, found.log_chance
    )


def _is_clear(one: Found) -> bool:
    """Whether a look shows so few groups that these may be a dock's lights."""
    markers = one.stages.get("markers")
    return markers is not None and MIN_POINTS <= len(markers) <= FIRST_POINTS
