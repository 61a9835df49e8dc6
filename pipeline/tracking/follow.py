"""From one frame to the next: a dock's lights measured where they must be, rather than searched."""

from __future__ import annotations

import math
import statistics
import time
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.estimate import geometry
from dockpose.estimate.by_hand import judge_set
from dockpose.estimate.flow import notes_on, picture_in
from dockpose.estimate.stages import Picture, judge_ring
from dockpose.lights.markers import Markers, grey_centres, with_fitted_centres
from dockpose.lights.windows import Spots, reach_px_of, spots_in_windows
from dockpose.settings import Settings
from dockpose.tracking.association import mapped, moved, shifted
from dockpose.tracking.chain import reach_m
from dockpose.tracking.sighting import LEAST_LIGHTS, Sighting, blurred, missing_px

_NOMINAL_PERIOD_S = 0.1  # between frames whose times are unknown
_LEAST_PERIOD_S = 1e-3  # two frames may bear one time
_SHAKEN_PX = 16.0  # by which the picture may jump from frame to frame
_FARTHEST_PX = 100.0  # that lights are sought from where they must be, for time
_LEAST_WINDOW_PX = 3.0
_OF_SPACING = 0.45  # how far into the gap to the next light a window goes
_WITHIN_PX, _WITHIN_OF_RING = 1.5, 0.025  # by how much a light may be off the map of all, of the ring's radius
_FAR_PX, _FAR_OF_RING = 6.0, 0.1  # from where a light must be that it is sought, at first and after a shift of all
_MOST_NEAR = 0.75  # share of the lights that were seen which one map must fit, or a shift is tried
_LEAST_SHARE = 0.5  # of the lights of the ring that was searched
# A light is hidden where its height is so small a share of what it must be by the others, and is not measured where its
# size differs by so many times or noise may have made it.
_LEAST_HEIGHT, _MOST_SPAN, _LEAST_NOISES = 0.3, 3.0, 4.0
_DIMMEST = 0.15  # of their former height, that all lights together may fall to from frame to frame


def follow(image: np.ndarray, last: Sighting, camera: Camera, time_s: float | None) -> Sighting | str:
    """Measure the next frame's lights, and judge them as those of a searched picture; or say why they are lost."""
    start, settings = time.perf_counter(), last.found.settings
    elapsed_s = period_s(last.time_s, time_s)
    reach_px, step_px = _moves_px(last, settings, elapsed_s), elapsed_s * last.speeds_px
    expected_px = last.points_px + (step_px if np.abs(step_px).max() < reach_px else 0.0)
    halves = last.halves_px
    margin = reach_px + 3 * float(halves.max()) + 8
    extra_px = [geometry.extra_expected(pose, last.found) for pose in last.found.candidates]
    corners = np.concatenate([last.points_px, expected_px, *extra_px])
    corners = corners[np.isfinite(corners).all(axis=1)]
    (left, top), (right, bottom) = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    height, width = image.shape[:2]
    if min(right, width) - max(left, 0) < 8 or min(bottom, height) - max(top, 0) < 8:
        return "the dock has left the picture"
    picture = picture_in(
        image, last.found.camera, settings, (left, top, right - left, bottom - top), last.found.min_channel
    )
    light, corner = blurred(picture.light[0], last.blur_px), np.array(picture.part[:2])
    ring = last.of_ring == 0
    within_px = max(_WITHIN_PX, _WITHIN_OF_RING * _radius_px(last))
    found = _associated(light, corner, expected_px, reach_px, within_px, last)
    if found is None:
        return "no map takes its lights to those of this frame"
    by, near, coarse = found
    places_px = moved(by, last.points_px)
    again = _spots(light, places_px, last, within_px)
    spots = again.chosen(near, coarse)
    off_px = np.linalg.norm(spots.points_px - places_px, axis=1)
    seen = _plausible(spots, last) & (off_px < within_px) & ~spots.cut
    seen = _alike(spots, last, seen)
    lights = int((seen & ring).sum())
    if lights < max(LEAST_LIGHTS, math.ceil(_LEAST_SHARE * last.searched)):
        return f"only {lights} of its lights are seen"
    growth = np.where(seen, spots.spans_px / last.spans_px, np.nan)
    growth = np.where(seen, growth, statistics.median(growth[seen & ring].tolist()))
    next_px = places_px + corner
    return _judged(picture, light, last, camera, seen, spots, growth, next_px, elapsed_s, time_s, start)


def _associated(
    light: np.ndarray, corner_px: np.ndarray, expected_px: np.ndarray, reach_px: float, within_px: float, last: Sighting
) -> tuple[np.ndarray, np.ndarray, Spots] | None:
    """The map (2, 3) from the last frame's places to those in a part of this, the lights (N,) that it fits, and spots.

    Windows where the lights must be do, unless they show too few: then all are shifted to where most stand out.
    """
    ring, half_px = last.of_ring == 0, float(last.halves_px[last.of_ring == 0].min())
    far_px, found = max(_FAR_PX, _FAR_OF_RING * _radius_px(last)), None
    for is_shifted in (False, True):
        guess_px = expected_px - corner_px
        if is_shifted:
            guesses = [guess_px[ring], last.points_px[ring] - corner_px]
            near_px = shifted(light, guesses, last.heights[ring], reach_px, max(1, round(half_px / 2)))
            guess_px = last.points_px - corner_px + (near_px - guesses[1]).mean(axis=0)
            guess_px[ring] = near_px
        spots = _spots(light, guess_px, last, far_px)
        places_px = np.where(_plausible(spots, last)[:, None], spots.points_px, np.nan)
        if (one := mapped(last.points_px[ring], places_px[ring], within_px)) is not None:
            near = np.zeros(len(ring), dtype=bool)
            near[ring] = one[1]
            if found is None or near.sum() > found[1].sum():
                found = one[0], near, spots
            if near.sum() >= _MOST_NEAR * (last.found.lights_on_ring or 0):
                break
    return found


def period_s(before_s: float | None, now_s: float | None) -> float:
    """Time between two frames."""
    if before_s is None or now_s is None:
        return _NOMINAL_PERIOD_S
    return max(_LEAST_PERIOD_S, now_s - before_s)


def _judged(
    picture: Picture,
    light: np.ndarray,
    last: Sighting,
    camera: Camera,
    seen: np.ndarray,
    spots: Spots,
    growth: np.ndarray,
    next_px: np.ndarray,
    elapsed_s: float,
    time_s: float | None,
    start: float,
) -> Sighting | str:
    """The sighting of a frame with these lights, or why they are no dock."""
    before = last.found
    assert before.ring is not None
    assert before.threshold is not None
    chosen = np.flatnonzero(seen)
    half = (last.sizes_px * np.sqrt(growth)[:, None])[chosen] / 2
    middle = spots.points_px[chosen]
    boxes = np.rint(np.hstack([middle - half, middle + half])).astype(int)
    height, width = light.shape
    boxes = np.clip(boxes, 0, [width - 1, height - 1] * 2)
    if before.settings.centroid == "grey":
        middle = grey_centres(light, boxes, middle)
    corner = picture.part[:2]
    levels = picture.histogram.levels
    peaks = [levels[top : bottom + 1, left : right + 1].max() for left, top, right, bottom in boxes.tolist()]
    markers = Markers(
        middle + corner,
        np.maximum(1, np.rint(last.areas_px * growth)[chosen]).astype(int),
        np.array(peaks),
        boxes_px=boxes + (*corner, *corner),
        cut=np.zeros(len(chosen), dtype=bool),
    )
    on_ring = [last.of_ring[chosen] == number for number in range(int(last.of_ring.max()) + 1)]
    shapes = last.shapes
    if shapes is not None and last.spreads_px2 is not None:
        markers, shapes = _fitted(picture, markers, last, on_ring[0], chosen, growth)
    rivals = tuple(one for one in on_ring[1:] if one.sum() >= LEAST_LIGHTS)
    ring = replace(
        before.ring,
        on_ring=on_ring[0],
        reason=f"{on_ring[0].sum()} lights were followed from the frame before.",
        ellipse=None,
        rivals=rivals,
        alike=min(before.ring.alike, len(rivals)),
        focal_px=None if before.choice is None else before.choice.focal_px,
    )
    threshold = before.threshold if before.threshold.groups is None else replace(before.threshold, groups=None)
    stages: dict[str, Any] = {"threshold": threshold, "markers": markers, "ring": ring}
    if before.detection is None:
        status, message, stages = judge_set(picture, before.camera, before.dock, stages, "followed")
    else:
        status, message, stages, _ = judge_ring(picture, before.camera, before.dock, stages)
    if status != "ok":
        return message
    if before.detection is not None:
        stages["detection"] = min(stages["detection"], before.detection)
    found = replace(
        before,
        status=status,
        message=message + notes_on(camera, before.camera),
        **stages,
        found_by="following",
        by_hand=None,
        elapsed_ms=1000 * (time.perf_counter() - start),
        picture=None,
    )
    speeds_px = (next_px - last.points_px) / elapsed_s
    next_px = next_px.copy()
    next_px[chosen] = stages["markers"].points_px
    next_px = _with_missing(next_px, missing_px(found), ~seen & (last.of_ring == 0))
    return replace(
        last,
        found=found,
        time_s=time_s,
        points_px=next_px,
        speeds_px=speeds_px,
        heights=np.where(
            seen, spots.heights, last.heights * statistics.median((spots.heights[seen] / last.heights[seen]).tolist())
        ),
        growth=growth,
        shapes=shapes,
    )


def _fitted(
    picture: Picture, markers: Markers, last: Sighting, on_ring: np.ndarray, chosen: np.ndarray, growth: np.ndarray
) -> tuple[Markers, np.ndarray]:
    """Markers with centres fitted from the last shapes on, and the shapes; what was not a disc then is not one now."""
    assert last.shapes is not None
    assert last.spreads_px2 is not None
    larger = np.sqrt(growth / last.growth)[chosen]
    shapes = last.shapes[chosen]
    shapes[:, 1:3] *= larger[:, None]
    is_new = np.abs(last.spreads_px2[chosen]).sum(axis=(1, 2)) == 0
    is_disc = on_ring & ((shapes[:, 0] > 0) | is_new)
    middle_px = last.found.camera.cx, last.found.camera.cy
    fitted = with_fitted_centres(
        replace(markers, shapes=shapes), is_disc, *picture.light, middle_px, (picture.part[0], picture.part[1])
    )
    if fitted.covariances_px2 is None or fitted.shapes is None:
        return markers, last.shapes
    spreads = last.spreads_px2[chosen] * growth[chosen, None, None]
    of_others = on_ring & ~is_disc
    covariances = np.where(of_others[:, None, None], spreads, fitted.covariances_px2)
    shapes = last.shapes.copy()
    shapes[chosen[is_disc]] = np.where(fitted.shapes[is_disc, :1] > 0, fitted.shapes[is_disc], shapes[chosen[is_disc]])
    return replace(fitted, covariances_px2=covariances), shapes


def _spots(light: np.ndarray, places_px: np.ndarray, last: Sighting, within_px: float) -> Spots:
    """The spots within some pixels of places (N, 2), and nearer to them than to the next light."""
    far = np.clip(np.minimum(within_px, _OF_SPACING * last.spacings_px), _LEAST_WINDOW_PX, None)
    spots = spots_in_windows(light, places_px, np.ceil(far), reach_px_of(last.halves_px))
    if last.blur_px == 0:
        return spots
    # Neighbours in a blurred picture differ less than noise of that standard deviation would: they have it in common.
    alike = math.exp(-1 / (4 * last.blur_px**2))
    return spots._replace(noises=spots.noises / math.sqrt(1 - alike))


def _plausible(spots: Spots, last: Sighting) -> np.ndarray:
    """Which spots (N,) may be lights: clear of noise, and not much larger or smaller than those were."""
    larger = spots.spans_px / (last.spans_px * last.growth)
    is_sized = (larger < _MOST_SPAN**2) & (larger > 1 / _MOST_SPAN**2)
    bright = spots.heights > np.maximum(_LEAST_NOISES * spots.noises, _DIMMEST * _LEAST_HEIGHT * last.heights)
    return np.isfinite(spots.heights) & is_sized & bright


def _alike(spots: Spots, last: Sighting, seen: np.ndarray) -> np.ndarray:
    """Which of the spots (N,) that are seen changed as the most: of the others something hides a part."""
    if not seen.any():
        return seen
    brighter = spots.heights / last.heights
    larger = spots.spans_px / (last.spans_px * last.growth)
    share, size = statistics.median(brighter[seen].tolist()), statistics.median(larger[seen].tolist())
    if share < _DIMMEST:
        return np.zeros_like(seen)
    return seen & (brighter > _LEAST_HEIGHT * share) & (larger < _MOST_SPAN * size) & (larger > size / _MOST_SPAN)


def _with_missing(points_px: np.ndarray, missing_px: np.ndarray, unseen: np.ndarray) -> np.ndarray:
    """Points (N, 2), those that are flagged (N,) at the nearest of the places where lights are missing."""
    if len(missing_px) and unseen.any():
        apart = np.hypot(*(points_px[unseen][:, None] - missing_px[None]).transpose(2, 0, 1))
        points_px[unseen] = missing_px[apart.argmin(axis=1)]
    return points_px


def _radius_px(last: Sighting) -> float:
    """Major semi-axis of the dock's ring."""
    return 0.0 if last.found.ellipse is None else last.found.ellipse.semi_axes_px[0]


def _moves_px(last: Sighting, settings: Settings, elapsed_s: float) -> float:
    """How far the lights may be from where they must be."""
    pose, camera = last.found.selected, last.found.camera
    assert pose is not None
    distance = float(np.linalg.norm(pose.position_m))
    return min(_FARTHEST_PX, _SHAKEN_PX + reach_m(settings, distance, elapsed_s) / distance * max(camera.fx, camera.fy))
