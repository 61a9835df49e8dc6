"""What of a frame the next is followed by: where a dock's lights are, how large and how bright."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from dockpose.estimate.flow import picture_in
from dockpose.estimate.result import Estimate
from dockpose.lights.windows import Spots, reach_px_of, spots_in_windows

_FARTHEST_PX = 1e5  # from the picture's corner, where a light behind the camera may seem to be
LEAST_LIGHTS = 4  # that are followed
_LARGEST_LIGHT_PX = 80.0  # half a light's side, beyond which its window does not grow, for time
CLEAR_NOISES = 8.0  # times the noise that a light is high, twice of what it may fall to, or the picture is blurred
_OF_SIDE = 0.25  # of a light's side: by so much, which makes it a sixth wider and takes most of the noise away
_ODD_SPAN = 5.0  # times as large or as small as the middle one of the ring, as no lamp of one kind is


@dataclass(frozen=True)
class Sighting:
    """What of a frame the next is followed by: all lights of its rings, those that were not seen too."""

    found: Estimate
    time_s: float | None
    points_px: np.ndarray  # (N, 2): where they are
    speeds_px: np.ndarray  # (N, 2): by how much they moved a second
    of_ring: np.ndarray  # (N,): 0 of the dock's ring, 1 and more of its rivals
    sizes_px: np.ndarray  # (N, 2): width and height of its group where it was searched
    sides_px: np.ndarray  # (N,): the longer of these, or that of what is above half of its height
    areas_px: np.ndarray  # (N,): pixels of it there
    spans_px: np.ndarray  # (N,): how large it was there as windows show it
    heights: np.ndarray  # (N,): above the water, as last seen
    growth: np.ndarray  # (N,): how many times as large it is as there, in area
    searched: int  # how many lights the dock's ring had there
    shapes: np.ndarray | None  # (N, 6) of which they were last; None where their centres could not be fitted there
    spreads_px2: np.ndarray | None  # (N, 2, 2): covariances there
    blur_px: float = 0.0  # of the picture in which they are measured, where noise hides them in the picture itself

    @cached_property
    def halves_px(self) -> np.ndarray:
        """Half the side (N,) of each light's group as it is now."""
        return np.clip(self.sides_px * np.sqrt(self.growth) / 2, 1.0, _LARGEST_LIGHT_PX)

    @cached_property
    def spacings_px(self) -> np.ndarray:
        """How far (N,) the nearest other light is."""
        apart = np.hypot(*(self.points_px[:, None] - self.points_px[None]).transpose(2, 0, 1))
        np.fill_diagonal(apart, np.inf)
        return apart.min(axis=1)


def begin(found: Estimate, image: np.ndarray, time_s: float | None) -> Sighting | None:
    """What a frame that was searched is followed by; None where it shows no dock, or too few lights of one."""
    ring, markers = found.ring, found.markers
    if found.status != "ok" or ring is None or markers is None:
        return None
    rings = [ring.on_ring, *ring.rivals]
    members = np.concatenate([np.flatnonzero(one) for one in rings])
    of_ring = np.repeat(np.arange(len(rings)), [int(one.sum()) for one in rings])
    count, searched = len(members), int(ring.on_ring.sum())
    if searched < LEAST_LIGHTS:
        return None
    points_px, boxes = markers.points_px[members], markers.boxes_px[members]
    sizes, areas = (boxes[:, 2:] - boxes[:, :2] + 1).astype(float), markers.areas_px[members].astype(float)
    picture = picture_in(image, found.camera, found.settings, min_channel=found.min_channel)
    sides = sizes.max(axis=1)
    light = picture.light[0]
    spots = _spots_of(light, points_px, sides)
    # The level of the search may be higher than half of a light's height.
    sides = np.fmax(sides, (spots.boxes_px[:, 2:] - spots.boxes_px[:, :2]).max(axis=1) + 1)
    spots, blur_px = _spots_of(light, points_px, sides), 0.0
    if np.mean(spots.heights >= CLEAR_NOISES * spots.noises) < 1 / 2:
        blur_px = _OF_SIDE * float(np.median(sides[:searched]))
        spots = _spots_of(blurred(light, blur_px), points_px, sides)
    absent_px = missing_px(found)
    more = len(absent_px)
    if not np.isfinite(spots.spans_px[:searched]).any():
        return None
    larger = spots.spans_px / np.nanmedian(spots.spans_px[:searched])
    is_odd = ~((larger < _ODD_SPAN) & (larger > 1 / _ODD_SPAN))  # specks that were taken for lights, or nothing at all

    def with_missing(values: np.ndarray) -> np.ndarray:
        typical = np.nanmedian(values[:searched], axis=0)
        values = np.where(is_odd.reshape(-1, *[1] * (values.ndim - 1)), typical, values)
        return np.concatenate([values, np.repeat(typical[None], more, axis=0)])

    return Sighting(
        found,
        time_s,
        np.concatenate([points_px, absent_px]),
        np.zeros((count + more, 2)),
        np.concatenate([of_ring, np.zeros(more, dtype=int)]),
        with_missing(sizes),
        with_missing(sides),
        with_missing(areas),
        with_missing(spots.spans_px),
        with_missing(spots.heights),
        np.ones(count + more),
        searched,
        _extended(markers.shapes, members, more),
        _extended(markers.covariances_px2, members, more),
        blur_px,
    )


def blurred(light: np.ndarray, blur_px: float) -> np.ndarray:
    """A picture (H, W) blurred by a standard deviation, which light outlasts and noise does not."""
    return light if blur_px == 0 else cv2.GaussianBlur(light, (0, 0), blur_px)


def _spots_of(light: np.ndarray, points_px: np.ndarray, sides_px: np.ndarray) -> Spots:
    """The spots of lights at points (N, 2), of such sides (N,)."""
    halves = np.clip(sides_px / 2, 1.0, _LARGEST_LIGHT_PX)
    return spots_in_windows(light, points_px, np.ceil(halves), reach_px_of(halves))


def missing_px(found: Estimate) -> np.ndarray:
    """Where (M, 2) the dock's lights must be that were not seen, by those that were."""
    ring, choice, markers, dock = found.ring, found.choice, found.markers, found.dock
    assert ring is not None
    assert choice is not None
    assert markers is not None
    if dock.lights is None and ring.lights:
        dock = dock.with_lights(ring.lights)
    nothing = np.empty((0, 2))
    if dock.lights is None or choice.lights is None:
        return nothing
    absent = np.flatnonzero(np.bincount(choice.lights, minlength=dock.lights) == 0)
    if len(absent) == 0:
        return nothing
    flat = dock.light_points()[:, :2]
    homography, _ = cv2.findHomography(flat[choice.lights], markers.points_px[ring.on_ring])
    if homography is None:
        return nothing
    seen = np.column_stack([flat[absent], np.ones(len(absent))]) @ homography.T
    places_px = seen[:, :2] / seen[:, 2:]
    return places_px[(np.abs(places_px) < _FARTHEST_PX).all(axis=1)]


def _extended(values: np.ndarray | None, members: np.ndarray, more: int) -> np.ndarray | None:
    """Of the members of markers, and 0 of as many more; None of none."""
    if values is None:
        return None
    return np.concatenate([np.nan_to_num(values[members]), np.zeros((more, *values.shape[1:]))])
