"""What is looked at together: lists of a picture's lights, and of each those that are alike in size."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from dockpose.camera.image import darkest_channel
from dockpose.estimate.found import Found
from dockpose.estimate.stages import Picture
from dockpose.lights.markers import Markers, find_markers
from dockpose.lights.polygon import MAX_POINTS
from dockpose.settings import Settings
from dockpose.thresholds import METHODS, Histogram, Threshold, histogram_of
from dockpose.thresholds.local import CLEAR_NOISE, RISE_NOISE, each_light

# Standard deviations of blurs, each twice the one before: a lamp that noise or texture breaks up is one light in one.
_BLURS_PX = (1.0, 2.0, 4.0)
# A peak of five standard deviations of the noise is less than one in a picture of a million pixels; of so many only, a
# few hundred are, and a light is what forms a ring with others. Above the water it stands as much more as of others.
_FAINT_NOISE = 3.5
_FAINT = _FAINT_NOISE, _FAINT_NOISE * CLEAR_NOISE / RISE_NOISE
_FEWEST = 4  # lights that make a ring
_SMALLEST_PX2 = 2.0  # from which on areas are told apart


class View(NamedTuple):
    """Lights that are looked at together."""

    picture: Picture  # in whose light they are measured
    threshold: Threshold
    lights: Markers
    blur_px: float  # standard deviation, 0 of none
    is_whole: bool  # whether they are all of their list

    @property
    def found(self) -> Found:
        """The stages so far."""
        return Found("", "", {"threshold": self.threshold, "markers": self.lights})


def views(picture: Picture, settings: Settings, tried: set[bytes]) -> Iterator[Iterator[View]]:
    """Views, each of other lights, list by list: of the grey picture, its darkest channel, and ever more blurred.

    None has lights that were looked at together before, whose keys, as of ``key_of``, are in ``tried``.
    """
    yield _views_of(_list_of(picture, settings), tried)
    white = _in_white(picture)
    if white is not None:
        level = METHODS["hats"](white.histogram, settings.min_area_px, None)
        yield iter([_view(white, level, white.histogram, settings)])
        yield _views_of(_list_of(white, settings), tried)
    for blur_px in _BLURS_PX:
        yield _views_of(_list_of(picture, settings, blur_px), tried)


def faint_views(picture: Picture, settings: Settings, tried: set[bytes]) -> Iterator[View]:
    """All lights of ever more blurred pictures, with those that hardly stand out of the noise; as ``views``."""
    every = (_list_of(picture, settings, blur_px, *_FAINT) for blur_px in _BLURS_PX)
    return (view for view in every if key_of(view.lights) not in tried)


def _in_white(picture: Picture) -> Picture | None:
    """The picture in the darkest of its channels, which shows lights on white; None of one without colours."""
    grey, counted = darkest_channel(picture.image), picture.histogram.counted
    if grey is None:
        return None
    if counted is not None:
        grey[counted == 0] = 0
    return replace(picture, grey=grey, histogram=histogram_of(grey, counted), like=None, in_white=True)


def _list_of(picture: Picture, settings: Settings, blur_px: float = 0.0, *noises: float) -> View:
    """All lights that a picture shows when it is blurred."""
    histogram = picture.histogram
    if blur_px:
        histogram = histogram_of(cv2.GaussianBlur(picture.grey, (0, 0), blur_px), histogram.counted)
    threshold = each_light(histogram, settings.min_area_px, *(noises or (RISE_NOISE, CLEAR_NOISE)))
    return _view(picture, threshold, histogram, settings, blur_px)


def _view(
    picture: Picture, threshold: Threshold, histogram: Histogram, settings: Settings, blur_px: float = 0.0
) -> View:
    """All that a threshold of a histogram keeps, measured in the picture's own light."""
    lights = find_markers(picture.light[0], histogram, threshold, settings.min_area_px, settings.centroid)
    return View(picture, threshold, lights, blur_px, is_whole=True)


def _views_of(every: View, tried: set[bytes]) -> Iterator[View]:
    """A list, and two octaves of area of it at a time, since a ring's lights are alike; none that was tried before."""
    areas_px2 = every.lights.areas_px.astype(float)
    masks, low_px2 = [np.ones(len(areas_px2), dtype=bool)], _SMALLEST_PX2
    while low_px2 < 2 * areas_px2.max(initial=0.0):
        masks.append((areas_px2 >= low_px2) & (areas_px2 < 4 * low_px2))
        low_px2 *= 2
    for mask in masks:
        lights = every.lights.part(mask)
        if len(lights) > MAX_POINTS:
            brightness = lights.areas_px * lights.peaks.astype(float)
            lights = lights.part(np.sort(np.argsort(-brightness, kind="stable")[:MAX_POINTS]))
        key = key_of(lights)
        if len(lights) >= _FEWEST and key not in tried:
            tried.add(key)
            yield every._replace(lights=lights, is_whole=bool(mask.all()))


def key_of(lights: Markers) -> bytes:
    """What tells sets of lights apart: their centres to a pixel, in whichever order."""
    return np.sort(np.rint(lights.points_px) @ [1, 1j]).tobytes()
