"""Lights that a person has set in the picture, and the bright spots that they were set at."""

import math
from typing import Any

import msgspec
import numpy as np
from dockpose.lights.markers import Markers, with_fitted_centres
from dockpose.lights.windows import Spots, reach_px_of, spots_in_windows
from dockpose.text import InputError, shown

EXACT_PX = 0.7  # standard error of x and of y where people set a light exactly
_APART_PX = 1.0  # of two lights at the least
_OFF_PX, _OFF_OF_GAP = 4.0, 0.3  # how far from a small spot it may be clicked, and from any, of the gap to the next
_HALVES_PX = (4.0, 8.0, 16.0, 32.0, 64.0)  # half the side of the largest spot that is looked for, one after another
_ABOVE = 1.5  # standard deviations by which a spot is higher than the highest of so many pixels of noise
_LEAST_HEIGHT = 0.5  # of a spot's, over that of the highest around it


class ByHand(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Lights that somebody has set in a picture: x and y of each in pixels, and whether spots are taken there."""

    lights_px: tuple[tuple[float, float], ...]
    snap: bool | tuple[bool, ...] = False  # of all or of each

    @classmethod
    def checked(cls, lights_px: object, snap: object, width: int, height: int) -> "ByHand":
        """Of arrays or lists; InputError that names the first light that cannot be one in a picture of that size."""
        try:
            points = np.array(lights_px, dtype=float)
        except (TypeError, ValueError):
            points = np.empty(1)
        if points.shape == (0,):  # of an empty list
            points = np.empty((0, 2))
        if points.ndim != 2 or points.shape[-1] != 2:
            raise InputError(f"lights_px is {shown(lights_px)}; it must be pairs of numbers x, y, one for each light")
        places: Any = points.tolist()
        for number, (x, y) in enumerate(places, 1):
            place = f"light {number} is at {x:g}, {y:g}"
            if not (math.isfinite(x) and math.isfinite(y)):
                raise InputError(f"{place}; x and y must be finite numbers")
            if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
                raise InputError(f"{place}, outside the picture, which has {width} x {height} pixels")
            near = np.flatnonzero(np.hypot(*(points[: number - 1] - (x, y)).T) < _APART_PX)
            if len(near):
                raise InputError(f"{place}, where light {near[0] + 1} is already")
        flags = np.asarray(snap)
        if flags.dtype != bool or flags.shape not in ((), (len(points),)):
            raise InputError(f"snap is {shown(snap)}; it must be true or false, or one of these for each light")
        return cls(tuple((x, y) for x, y in places), bool(flags) if flags.ndim == 0 else tuple(flags.tolist()))


def markers_at(
    by_hand: ByHand, light: np.ndarray, levels: np.ndarray, white: float, middle_px: tuple[float, float]
) -> Markers:
    """Lights as groups of pixels: where they were set, (N, 2), or, snapped, the bright spots there.

    ``light`` (H, W) is the picture, of ``levels`` (H, W) from 0 to 255, saturated from ``white`` on; ``middle_px`` is
    the lens's. Where no spot stands out of the noise, or two lights are in one, they stay where they were set.
    """
    points_px = np.array(by_hand.lights_px).reshape(-1, 2)
    spots, is_spot = _spots_at(light, points_px)
    around = np.rint(np.hstack([points_px - 1, points_px + 1]))
    limits = np.array(light.shape[::-1] * 2) - 1
    boxes = np.clip(np.where(is_spot[:, None], spots.boxes_px, around), 0, limits).astype(int)
    areas = np.rint(math.pi / 4 * (boxes[:, 2] - boxes[:, 0] + 1) * (boxes[:, 3] - boxes[:, 1] + 1)).astype(int)
    peaks = np.array([levels[top : bottom + 1, left : right + 1].max() for left, top, right, bottom in boxes.tolist()])
    apart = np.hypot(*(spots.points_px[:, None] - spots.points_px).transpose(2, 0, 1))
    is_shared = ((apart < _APART_PX) & is_spot).sum(axis=1) > 1
    is_taken = is_spot & ~is_shared & np.array(by_hand.snap)
    cut = is_taken & spots.cut
    exact = np.tile(EXACT_PX**2 * np.eye(2), (len(points_px), 1, 1))
    if not is_taken.any():
        return Markers(points_px, areas, peaks, boxes_px=boxes, cut=cut, covariances_px2=exact)
    centres = np.where(is_taken[:, None], spots.points_px, points_px)
    markers = Markers(centres, areas, peaks, boxes_px=boxes, cut=cut)
    fitted = with_fitted_centres(markers, is_taken, light, white, middle_px)
    if fitted.covariances_px2 is not None:
        fitted.covariances_px2[~is_taken] = exact[~is_taken]
    return fitted


def _spots_at(light: np.ndarray, points_px: np.ndarray) -> tuple[Spots, np.ndarray]:
    """The spots that were clicked, and whether (N,) there is one: clear of noise, and whole within half the gap.

    Of several, one within another, it is the smallest that is not much lower than the highest: smaller ones are the
    texture of a lamp. The larger a spot is, the farther from its brightest pixel it may have been clicked.
    """
    apart = np.hypot(*(points_px[:, None] - points_px).transpose(2, 0, 1)) + np.diag(np.full(len(points_px), np.inf))
    gaps = apart.min(axis=1, initial=np.inf)
    seen, heights = [], []
    for half_px in _HALVES_PX:
        halves = np.minimum(half_px, np.maximum(gaps / 2, _HALVES_PX[1]))
        off = np.ceil(np.clip(halves / 2, _OFF_PX, np.maximum(_OFF_PX, _OFF_OF_GAP * gaps)))
        spots = spots_in_windows(light, points_px, off, reach_px_of(halves))
        sides = (spots.boxes_px[:, 2:] - spots.boxes_px[:, :2]).max(axis=1) + 1
        box = spots.boxes_px
        is_at = ((box[:, :2] - _OFF_PX <= points_px) & (points_px <= box[:, 2:] + _OFF_PX)).all(axis=1)
        least = (np.sqrt(2 * np.log(math.pi * off**2)) + _ABOVE) * spots.noises
        is_spot = (spots.heights > least) & (sides <= 2 * halves) & is_at
        seen.append(spots)
        heights.append(np.where(is_spot, spots.heights, 0.0))
    highest = np.max(heights, axis=0)
    first = (np.array(heights) >= _LEAST_HEIGHT * highest).argmax(axis=0)
    chosen = (np.array(each)[first, np.arange(len(points_px))] for each in zip(*seen, strict=True))
    return Spots(*chosen), highest > 0
