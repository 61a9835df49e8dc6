"""The flow chart: image, threshold, markers, ring, ellipse, poses, choice."""

import itertools
import math
import os
import time
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import (
    ImageError,
    as_picture,
    decode,
    orientation_of,
    orientation_sentence,
    read_picture_file,
    significant_bits,
    to_grey,
)
from dockpose.camera.tone import linear, linear_level
from dockpose.checks import check_is, shown
from dockpose.dock import Dock
from dockpose.estimate.drawing import picture_of
from dockpose.estimate.result import Estimate
from dockpose.estimate.rings import of_rings
from dockpose.lights.chance import ACCEPTED_AMONG_OTHERS
from dockpose.lights.colours import tell_colours
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError
from dockpose.lights.markers import Markers, find_markers
from dockpose.lights.masks import hide
from dockpose.lights.region import Region, crop, markers_in_whole, masks_within, part_of, ring_in, threshold_in_whole
from dockpose.lights.ring import Ring
from dockpose.pixels.bright import SATURATED
from dockpose.pose.detection import detection_of, few_in_words, found_in_words, judged
from dockpose.settings import Settings
from dockpose.thresholds import METHODS, Histogram, MethodError, Threshold, hats_local, histogram_of
from dockpose.thresholds.scales import at_scales

# Behind a port a ring's picture is an ellipse only as seen from somewhere; this far away it is one for the ring search.
LIKELY_RANGE_M = 1.0
# Lights so near their places, so many of them, and so sure not to be chance leave other thresholds little to better:
# half a pixel is more than noise does to a centre. Of a dock that is built less exactly another is looked at, too; one
# that shows it to a hundredth of the radius, half of what docks are built to, will do.
_EXACT_PX, _EXACT_OF_AXIS, _MOST_OF, _NO_CHANCE = 0.5, 0.01, 0.75, math.log(1e-6)
# What is accepted among others, over ten: about so many scales are looked at, each with points of its own. Four lights
# are hardly ever surer than that.
_LITTLE_CHANCE = math.log(ACCEPTED_AMONG_OTHERS / 10)
_LIGHTS_OF = attrgetter("lights", "angles_deg", "colours", "offsets_m")


@dataclass(frozen=True)
class _Picture:
    """What is searched: the picture or a part of it."""

    image: np.ndarray  # of the part
    grey: np.ndarray  # of the part
    histogram: Histogram  # of the part
    part: tuple[int, int, int, int]  # left, top, right and bottom of it
    width: int  # of the whole picture, in pixels
    like: Estimate | None  # another estimate of it, whose threshold and groups hold here
    tone: str | float  # curve of the camera

    @cached_property
    def light(self) -> tuple[np.ndarray, float]:
        """The part in linear light, and from which of its levels on that is saturated."""
        step = self.histogram.native_step
        return linear(self.grey, step, self.tone), linear_level(SATURATED, step, self.tone)


def estimate(
    image: np.ndarray | str | os.PathLike[str],
    camera: Camera,
    dock: Dock,
    settings: Settings | None = None,
    *,
    fall_back: bool = True,
    region: Region | None = None,
    like: Estimate | None = None,
) -> Estimate:
    """Find the dock in one picture.

    Parameters
    ----------
    image : array or path
        (H, W) grey, (H, W, 3) BGR or (H, W, 4) BGRA array of uint8 or uint16, or of floats from 0 to 1, which become 16
        bits; pixels that are masked, as of ``numpy.ma``, are not looked at. Or the path of a picture file, of which no
        tag of orientation is applied; the message names it.
    camera : Camera
        Its intrinsics; a picture that is the calibration's rescaled is taken, another size is refused.
    dock : Dock
        Its diameter, and its number of lights where known.
    settings : Settings, optional
        How to search; the defaults suit most scenes.
    fall_back : bool
        Let hats give each light a level of its own where no single level shows the ring. A comparison of the
        methods wants each as it is.
    region : Region or None
        Rectangle (x_px, y_px, width_px, height_px), clipped to the picture and begun at an even pixel, outside of
        which nothing is looked at; None searches the whole picture. What is found is in pixels of the whole picture.
    like : Estimate or None
        An estimate of this very picture, as with another camera or dock. Where settings, region and tone curve are the
        same, its threshold and its groups are taken over, which saves most of the time.

    Returns
    -------
    Estimate
        Whatever the picture shows: one without a dock has a status other than "ok" and says why.

    Raises
    ------
    ValueError
        if the file cannot be read, an argument is of another kind, the image is no such picture or does not belong to
        the camera, or the region has no pixel of it.

    Notes
    -----
    A region gives what a mask over all the rest gives, as far as that has one level for all lights, but for three
    things: a histogram of more than 80,000 pixels is sketched from every few rows, which are others in a part; the
    bits of a 16-bit picture are those that the part uses; and a light at the region's edge is weighed by what of it
    lies within. Other than in the whole picture, the background is that of the region alone, so that the level may
    differ, and the centres differ by what the neighbouring groups outside would take from them.
    """
    check_is("camera", camera, Camera)
    check_is("dock", dock, Dock)
    settings = settings or Settings()
    check_is("settings", settings, Settings)
    if dock.rings:
        return of_rings(estimate, image, camera, dock, settings, fall_back=fall_back, region=region, like=like)
    given, path, note = image, None, ""
    if isinstance(image, (str, os.PathLike)):
        path = Path(image)
        data = read_picture_file(path)
        image, note = decode(data, str(path)), orientation_sentence(orientation_of(data), str(path))
    elif not hasattr(image, "__array__"):
        raise ImageError(f"image is {shown(image)}; it must be an array of pixels, or the path of a picture file")
    start = time.perf_counter()
    whole: np.ndarray = np.asarray(image)
    hidden: np.ndarray | None = np.asarray(np.ma.getmaskarray(image)) if np.ma.is_masked(image) else None
    image, part = whole, None
    if whole.ndim >= 2 and region is not None:
        part = part_of(region, whole.shape[1], whole.shape[0])
        image, hidden = crop(whole, part), None if hidden is None else crop(hidden, part)
    # Compiled code is for arrays without gaps that may be written to, and would be compiled anew for others.
    image = as_picture(image)
    grey = np.require(to_grey(image), requirements=["C", "W"])
    part = part or part_of(None, *grey.shape[::-1])
    height, width = whole.shape[:2]
    scaled = camera.for_size(width, height)
    if hidden is not None:
        hidden = np.atleast_2d(hidden.reshape(*grey.shape, -1).any(axis=2))
    grey, counted = hide(grey, masks_within(settings.masks, part), hidden)
    if like is not None and (like.settings, like.region, like.camera.tone) != (settings, region, camera.tone):
        like = None
    picture = _Picture(image, grey, histogram_of(grey, counted), part, width, like, camera.tone)
    if counted is not None and not counted.any():
        status, message, stages = "no_lights", "No lights: the whole picture is masked.", {}
    else:
        status, message, stages = _search(picture, scaled, dock, settings, fall_back)
    if scaled is not camera:
        message += f" The camera's intrinsics were scaled from {camera.width} x {camera.height} to {width} x {height}."
    if note:
        message += f" {note[:1].upper()}{note[1:]}."
    elapsed_ms = 1000 * (time.perf_counter() - start)
    bits = significant_bits(grey)
    return Estimate(
        status,
        message,
        width,
        height,
        bits,
        scaled,
        dock,
        settings,
        **stages,
        elapsed_ms=elapsed_ms,
        region=region,
        picture=picture_of(given, path),
    )


def _search(
    picture: _Picture, camera: Camera, dock: Dock, settings: Settings, fall_back: bool
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
    best = first
    local = hats_local(picture.histogram, settings.min_area_px)
    for other in itertools.chain([local], at_scales(picture.histogram, settings.min_area_px)):
        # Of an unknown number, any few points of some scale make some ring.
        of_few = dock.lights is not None or other is local
        found = _search_with(other, picture, camera, dock, settings, of_few=of_few)
        if other is local or found.status != "ok" or found.log_chance < _LITTLE_CHANCE:
            best = max(best, found, key=_Found.rank)
        if best.is_exact(_EXACT_OF_AXIS):
            break
    own = "" if best is first or best.status != "ok" else " No one level shows the ring; each light was given its own."
    return best.status, best.message + own, best.stages


@dataclass(frozen=True)
class _Found:
    """How far the search came with one threshold."""

    status: str
    message: str
    stages: dict[str, Any]
    log_chance: float = math.inf  # of the ring, if there is one

    def is_exact(self, of_axis: float = 0.0) -> bool:
        """Whether nearly all lights are there, where they should be, within a share of the major semi-axis."""
        if self.status != "ok":
            return False
        ring, ellipse, choice = (self.stages[name] for name in ("ring", "ellipse", "choice"))
        count, rms_px = int(ring.on_ring.sum()), choice.candidates[choice.selected].rms_px or 0.0
        least = min(MIN_POINTS, ring.lights or MIN_POINTS)
        if self.log_chance > (_NO_CHANCE if least == MIN_POINTS else _LITTLE_CHANCE):
            return False
        complete = count >= max(least, _MOST_OF * (ring.lights or count))
        return complete and rms_px <= max(_EXACT_PX, of_axis * ellipse.semi_axes_px[0])

    def rank(self) -> tuple[bool, bool, bool, float]:
        """A ring of five lights or more before one of fewer, any before none, and the least likely to be chance.

        Of thresholds that show none, one is best that shows all lights, if not where they should be.
        """
        ring, found = self.stages.get("ring"), self.status == "ok"
        lights = 0 if ring is None else int(ring.on_ring.sum())
        is_whole = ring is not None and ring.lights is not None and lights >= max(ring.lights, MIN_POINTS)
        return found and lights >= MIN_POINTS, found, is_whole, -self.log_chance


def _search_with(
    threshold: Threshold, picture: _Picture, camera: Camera, dock: Dock, settings: Settings, *, of_few: bool = True
) -> _Found:
    """What is found from one threshold on; a ring of few lights only if asked for."""
    status, message, stages = _find_lights(picture, threshold, camera, dock, settings, of_few)
    if status != "ok":
        return _Found(status, message, stages)
    ring = stages["ring"]
    if ring.focal_px is not None:  # the spacing would only tell how wrong the camera is
        dock = msgspec.structs.replace(dock, lights=None)
    elif dock.lights is None and ring.lights:
        dock = msgspec.structs.replace(dock, lights=ring.lights)
    try:
        labels = _labels(picture, stages["markers"], ring, dock)
        area_px2 = float(picture.grey.size)
        ellipse, choice, log_chance, reason = judged(ring, stages["markers"], camera, dock, area_px2, labels)
    except NoEllipseError as error:
        if (lights := int(ring.on_ring.sum())) < MIN_POINTS:
            kept = {name: stages[name] for name in ("threshold", "markers")}
            found = few_in_words(stages["markers"], lights)
            return _Found("too_few_markers", f"{found}, too few for an ellipse, and {error}.", kept)
        return _Found("no_ellipse", f"No ellipse: {error}.", stages)
    if reason is not None:
        return _Found("not_a_ring", reason, stages, log_chance)
    stages |= {"ellipse": ellipse, "choice": choice, "detection": detection_of(log_chance, ring.alike)}
    return _Found("ok", found_in_words(ring, choice, camera, dock), stages, log_chance)


def _find_lights(
    picture: _Picture, threshold: Threshold, camera: Camera, dock: Dock, settings: Settings, of_few: bool
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and the stages from the threshold to the ring."""
    like = picture.like
    if like is not None and like.markers is not None and threshold is like.threshold:
        markers = like.markers
        stages: dict[str, Any] = {"threshold": threshold, "markers": markers}
    else:
        stages = {"threshold": threshold_in_whole(threshold, picture.part, picture.width)}
        light, white = picture.light
        markers = find_markers(light, picture.histogram, threshold, settings.min_area_px, settings.centroid, white)
        markers = stages["markers"] = markers_in_whole(markers, picture.part)
    if len(markers) == 0 and markers.dropped:
        small = f"all {markers.dropped} groups at level {threshold.level} are below {settings.min_area_px} pixels"
        return "no_lights", f"No lights: {small}.", stages
    if len(markers) == 0:
        return "no_lights", f"No lights: {threshold.reason[:1].lower()}{threshold.reason[1:]}", stages
    if dock.lights is not None and min(4, dock.lights) <= len(markers) < MIN_POINTS:
        few = f"{len(markers)} groups, too few for an ellipse: their spacing must tell."
        stages["ring"] = Ring(np.ones(len(markers), dtype=bool), few)
        return "ok", "", stages
    if len(markers) < MIN_POINTS:
        small = f" and {markers.dropped} below {settings.min_area_px} pixels" if markers.dropped else ""
        found = f"{few_in_words(markers, len(markers))}{small} at level {threshold.level}"
        four = " Four do if the dock's number of lights is given: --lights 4." if len(markers) == 4 else ""
        return "too_few_markers", f"{found}; an ellipse needs {MIN_POINTS}.{four}", stages
    ring = None if like is None or markers is not like.markers else _ring_of(like, camera, dock)
    if ring is None:
        points_px = camera.virtual_pixels(markers.points_px, LIKELY_RANGE_M)
        ring = ring_in(points_px, markers, camera, dock, picture.part, of_few=of_few)
    stages["ring"] = ring
    if not ring.found:
        return "not_a_ring", ring.reason, stages
    return "ok", "", stages


def _ring_of(like: Estimate, camera: Camera, dock: Dock) -> Ring | None:
    """The ring of another estimate, if it is that of this camera and dock too, whatever the dock's diameter."""
    return like.ring if like.camera == camera and _LIGHTS_OF(like.dock) == _LIGHTS_OF(dock) else None


def _labels(picture: _Picture, markers: Markers, ring: Ring, dock: Dock) -> list[str | None] | None:
    """Colours of the lights on the ring, where the dock's have any."""
    if not dock.colours:
        return None
    points_px = markers.points_px[ring.on_ring] - picture.part[:2]
    return tell_colours(picture.image, points_px, markers.areas_px[ring.on_ring])
