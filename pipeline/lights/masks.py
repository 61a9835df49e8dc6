"""Masks: what counts neither in the histogram nor as lights, given by people or found because it stays put."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.checks import check_number
from dockpose.lights.growing import distances
from dockpose.lights.markers import Markers
from dockpose.lights.motion import MOVED_PX, Motion, Paths

# x_px, y_px of the upper left corner, width_px, height_px: (10, 20, 30, 5) hides columns 10 to 39 of rows 20 to 24.
Mask = tuple[float, float, float, float]
_PARTS = ("x_px", "y_px", "width_px", "height_px")

LEAST_FRAMES = 8  # frames in which a group must stay put before it is masked
_FRAMES_OF_DOCK = 3 * LEAST_FRAMES  # what was taken for the dock must be left behind for so long
_STILL_PX = 0.5  # noise alone moves by less what stays put
_SIMILAR_AREA = 2.0  # the larger over the smaller
# The picture counts as moving if this many groups, as many as a ring needs, are this far from every group some frames
# ago. Fragments of letters, which noise splits differently in each frame, are nearer than that.
_LEAST_MOVED, _MOVED_PX, _FRAMES_AGO = 5, 2.0, 50
_AROUND_DOCK = 1.2  # of the ring's largest radius: a group this near may be a light that was left out
_MARGIN_PX = 3  # around a group: letters have soft edges
_UNION = 1.5  # masks side by side are merged if the result is at most this many times their total area


def check_masks(masks: Any) -> None:
    """Check that each mask is four finite numbers with a positive size; it may lie outside the picture."""
    for index, mask in enumerate(masks):
        if not isinstance(mask, Sequence) or isinstance(mask, str) or len(mask) != len(_PARTS):
            raise ValueError(f"masks[{index}] is {mask!r}; it must be four numbers: {', '.join(_PARTS)}")
        for name, value in zip(_PARTS, mask, strict=True):
            check_number(f"masks[{index}] {name}", value, above=-math.inf if name in ("x_px", "y_px") else 0)


def hidden_pixels(shape: tuple[int, int], masks: Sequence[Mask]) -> np.ndarray:
    """Pixels (H, W) bool, of a picture of that shape, whose centres lie in a mask."""
    hidden = np.zeros(shape, dtype=bool)
    for x, y, width, height in masks:
        hidden[_span(y, height, shape[0]), _span(x, width, shape[1])] = True
    return hidden


def hide(
    grey: np.ndarray, masks: Sequence[Mask], also: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """A picture (H, W) without masked pixels and ``also`` (H, W), and which count: 255, masked 0; None where all do."""
    if not masks and also is None:
        return grey, None
    hidden = hidden_pixels(grey.shape, masks)
    if also is not None:
        hidden |= also
    return np.where(hidden, grey.dtype.type(0), grey), np.where(hidden, 0, 255).astype(np.uint8)


def _span(start: float, length: float, size: int) -> slice:
    """Slice of the pixels of one axis whose centres, at whole numbers, lie within ``length`` of ``start``."""
    first, last = (math.ceil(min(max(edge, 0), size)) for edge in (start, start + length))
    return slice(first, last)


@dataclass
class _Track:
    """A group that stays where it was first seen."""

    point_px: tuple[float, float]
    area_px: float
    last_frame: int
    frames: int = 0  # in which it stayed put while the dock was elsewhere
    against: int = 0  # in which the rest of the picture moved past it
    is_dock: bool = False


class StillGroups:
    """Finds and masks what stays put while the picture moves, such as burnt-in text, but no lights of the dock."""

    def __init__(self) -> None:
        self.masks: tuple[Mask, ...] = ()
        self._tracks: list[_Track] = []
        self._frame = 0
        self._past: deque[np.ndarray] = deque(maxlen=_FRAMES_AGO)
        self._paths = Paths()

    def see(self, markers: Markers | None, on_ring: np.ndarray | None) -> tuple[Mask, ...]:
        """Take in the next frame and which of its groups (N,) are on the ring; return the masks that are new."""
        self._frame += 1
        if markers is None or len(markers) == 0:
            return ()
        tracks, points_px = self._follow(markers), markers.points_px
        self._past.append(points_px)
        if on_ring is None or not on_ring.any():
            on_ring = np.zeros(len(markers), dtype=bool)
        motion = self._paths.see(points_px)
        burnt_in = _left_behind(tracks, points_px, on_ring, motion)
        still = burnt_in | self._beside_dock(tracks, points_px, on_ring)
        if not still.any() and len(self.masks) < 2:
            return ()
        lights_px = points_px[on_ring & ~still]
        if motion is not None:
            lights_px = np.vstack([lights_px, motion.points_px])
        before = self.masks
        self.masks = _united([*before, *_around(markers.boxes_px[still])], lights_px)
        return tuple(mask for mask in self.masks if mask not in before)

    def _beside_dock(self, tracks: list[_Track], points_px: np.ndarray, on_ring: np.ndarray) -> np.ndarray:
        """Which groups (N,) bool stayed put, apart from the dock, while other things moved."""
        if not on_ring.any():
            return on_ring
        apart = ~_near_ring(points_px, on_ring)
        for track, is_light, is_apart in zip(tracks, on_ring.tolist(), apart.tolist(), strict=True):
            track.is_dock |= is_light
            track.frames += is_apart
        still = np.array([not track.is_dock and track.frames >= LEAST_FRAMES for track in tracks]) & apart
        if still.any() and not _has_moved(self._past[0], points_px):
            still[:] = False
        return still

    def _follow(self, markers: Markers) -> list[_Track]:
        """The track of each group; a group without one starts a new track."""
        self._tracks = [track for track in self._tracks if self._frame - track.last_frame <= LEAST_FRAMES]
        known = list(self._tracks)
        followed = []
        for number, point, area in zip(
            _nearest(known, markers.points_px), markers.points_px.tolist(), markers.areas_px.tolist(), strict=True
        ):
            if number is None:
                track = _Track((point[0], point[1]), area, self._frame)
                self._tracks.append(track)
            else:
                track = known[number]
                track.last_frame = self._frame
                if not 1 / _SIMILAR_AREA <= area / track.area_px <= _SIMILAR_AREA:
                    track.area_px, track.frames, track.against = area, 0, 0
            followed.append(track)
        return followed


def _left_behind(tracks: list[_Track], points_px: np.ndarray, on_ring: np.ndarray, motion: Motion | None) -> np.ndarray:
    """Which groups (N,) bool stayed put for long although all else moved as one, and would have moved there too."""
    if motion is None:
        return np.zeros(len(tracks), dtype=bool)
    left = motion.moves_px(points_px) > MOVED_PX
    enough = len(motion.points_px) >= int(on_ring.sum())
    for track, was_left in zip(tracks, left.tolist(), strict=True):
        track.against += was_left
    least = [LEAST_FRAMES if not track.is_dock else _FRAMES_OF_DOCK if enough else math.inf for track in tracks]
    return left & ([track.against for track in tracks] >= np.array(least))


def _nearest(tracks: list[_Track], points_px: np.ndarray) -> list[int | None]:
    """Index of the track to which each point (N, 2) belongs; None where there is none."""
    if not tracks:
        return [None] * len(points_px)
    distance, nearest = _closest(points_px, np.array([track.point_px for track in tracks]))
    return [
        number if apart < _STILL_PX else None for apart, number in zip(distance.tolist(), nearest.tolist(), strict=True)
    ]


def _has_moved(before_px: np.ndarray, now_px: np.ndarray) -> bool:
    """Whether enough of the points (N, 2) are far from all those (M, 2) that were found before."""
    distance, _ = _closest(now_px, before_px)
    return int(np.count_nonzero(distance > _MOVED_PX)) >= _LEAST_MOVED


def _closest(points_px: np.ndarray, others_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (N,) from each point (N, 2) to the nearest of some others (M, 2), and the index (N,) of that one."""
    apart = distances(points_px, others_px)
    return apart.min(axis=1), apart.argmin(axis=1)


def _near_ring(points_px: np.ndarray, on_ring: np.ndarray) -> np.ndarray:
    """Which points (N,) lie on, inside or just outside the ring."""
    off = points_px - points_px[on_ring].sum(axis=0) / np.count_nonzero(on_ring)
    distance = np.hypot(off[:, 0], off[:, 1])
    return distance <= _AROUND_DOCK * distance[on_ring].max()


def _around(boxes_px: np.ndarray) -> list[Mask]:
    """Masks around boxes (N, 4: left, top, right, bottom)."""
    corner, size = boxes_px[:, :2] - _MARGIN_PX, boxes_px[:, 2:] - boxes_px[:, :2] + 1 + 2 * _MARGIN_PX
    return [(x, y, width, height) for x, y, width, height in np.hstack([corner, size]).astype(float).tolist()]


def _united(masks: list[Mask], lights_px: np.ndarray) -> tuple[Mask, ...]:
    """Merge masks that belong together, such as letters of a line, unless that would hide a light (N, 2)."""
    united: list[Mask] = []
    for first in dict.fromkeys(masks):
        mask, place = first, 0
        while place < len(united):
            union = _union(mask, united[place])
            if union is None or any(_is_inside(union, x, y) for x, y in lights_px.tolist()):
                place += 1
            else:
                del united[place]
                mask, place = union, 0
        united.append(mask)
    return tuple(united)


def _union(first: Mask, second: Mask) -> Mask | None:
    """The rectangle around two masks that are side by side; None where they are not, or where it is much larger."""
    left, top = max(first[0], second[0]), max(first[1], second[1])
    right, bottom = min(first[0] + first[2], second[0] + second[2]), min(first[1] + first[3], second[1] + second[3])
    if left - right > max(first[3], second[3]) or top > bottom:
        return None
    x, y = min(first[0], second[0]), min(first[1], second[1])
    width = max(first[0] + first[2], second[0] + second[2]) - x
    height = max(first[1] + first[3], second[1] + second[3]) - y
    together = first[2] * first[3] + second[2] * second[3]
    return (x, y, width, height) if width * height <= _UNION * together else None


def _is_inside(mask: Mask, x_px: float, y_px: float) -> bool:
    return mask[0] <= x_px <= mask[0] + mask[2] and mask[1] <= y_px <= mask[1] + mask[3]
