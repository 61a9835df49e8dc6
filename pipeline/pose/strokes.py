"""Whether what lies on a ring are lights at all, or parts of lines: strips, spokes, hoops and strokes of letters."""

import math
import statistics
from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.growing import TOLERANCE_OF_AXIS
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import light_rays, on_planes

# A line's light goes on beside what seem to be lights of it; noise hides a twentieth of it.
_GOES_ON = 0.95
# Between both ends of a strip it is nearly as bright, and in every second gap darker by so much: of eight lights that
# run together the gaps hardly alternate by chance (2 in 70). Lamps that stand in pairs are nearer by half.
_STRIP, _GAP, _FEWEST_ENDS, _IN_PAIRS = 0.8, 0.1, 8, 2.0
_DARK = 0.5  # of a light, beside the end of a line and between lines: where its edge is
# Light is summed across the ring this share of a spacing either way, of the radius at the most, since lights may run
# together; and along it over a quarter, at five places.
_ACROSS, _ALONG = 0.75, np.linspace(-0.125, 0.125, 5)
_AROUND = np.exp(1j * math.pi / 4 * np.arange(8)).view(float).reshape(-1, 2)  # directions from a light
_OWN = np.mgrid[-4:5, -4:5].reshape(2, -1).T / 4  # places around a light's middle, in its radii
_OWN_LEAST_PX = 2.0  # of these: a thinner stroke is brighter where it meets the middle of a pixel
_OWN = _OWN[np.hypot(*_OWN.T) <= 1]
_INWARDS = np.array([1.0, 0.75, 0.5])  # radii at which a spoke is looked at; by the last spokes may run together
_NEIGHBOURS = 1.5  # times the median spacing, within which no light is missing between two


class _Seen(NamedTuple):
    """A ring's lights, in order around it, and where to look for what is beside them."""

    light: np.ndarray  # (H, W)
    at_rad: np.ndarray  # (N,): where each is on the ring
    gaps_rad: np.ndarray  # (N,): on to the next
    own_px: float  # radius of one
    in_part_px: Callable[[np.ndarray, np.ndarray], np.ndarray]  # pixels (..., 2) by angles and radii, that broadcast

    def light_in_discs(self, places_px: np.ndarray) -> np.ndarray:
        """Mean light (...) of as much as a light fills, around places (..., 2)."""
        return _light_at(self.light, places_px[..., None, :] + self.own_px * _OWN).mean(axis=-1)


def reason_not_lamps(
    light: np.ndarray,
    corner_px: Sequence[int],
    ring: Ring,
    markers: Markers,
    pose: CirclePose,
    camera: Camera,
    dock: Dock,
) -> str | None:
    """Return why a ring's lights, in light (H, W) of a part from a corner on, are parts of lines; None if they are not.

    So are peaks of noise along a hoop or a stroke of a letter, as far apart as the blur lets them, and ends of spokes.
    """
    x_m, y_m = on_plane(markers, pose, camera, dock)[ring.on_ring].T
    at_rad = np.arctan2(y_m, x_m)
    order = np.argsort(at_rad)
    at_rad = at_rad[order]
    gaps_rad = np.append(at_rad[1:], at_rad[0] + math.tau) - at_rad
    ring_m = pose.position_m + dock.lamp_depth_m * pose.rotation[:, 2]

    def in_part_px(at_rad: np.ndarray, radii: np.ndarray) -> np.ndarray:
        flat_m = dock.radius * np.stack([radii * np.cos(at_rad), radii * np.sin(at_rad)], axis=-1)
        places_m = ring_m + flat_m @ pose.rotation[:, :2].T
        return camera.project(places_m.reshape(-1, 3)).reshape(flat_m.shape) - corner_px

    area_px2 = statistics.median(markers.areas_px[ring.on_ring].tolist())
    own_px = max(_OWN_LEAST_PX, math.sqrt(area_px2 / math.pi))
    # Parts of lines are in no places; those of lights in theirs would be chance.
    is_inexact = (pose.rms_px or 0.0) > TOLERANCE_OF_AXIS * camera.fx * dock.radius / pose.position_m[2]
    near = gaps_rad < _NEIGHBOURS * statistics.median(gaps_rad.tolist())
    middles_px = markers.points_px[ring.on_ring][order] - corner_px
    seen = _Seen(light, at_rad, gaps_rad, own_px, in_part_px)
    if _goes_on_between(seen._replace(at_rad=at_rad[near], gaps_rad=gaps_rad[near])):
        what = "between them it is as bright: a hoop or strips, not lights"
    elif _goes_on_beside(seen, middles_px):
        what = "each goes on to one side of it: the ends of lines, not lights"
    elif _goes_to_the_middle(seen):
        what = "each goes on to the ring's middle: spokes, not lights"
    elif is_inexact and _goes_on_somewhere(light, middles_px, own_px):
        what = "each goes on beyond it: parts of lines, not lights"
    else:
        return None
    return f"{len(at_rad)} peaks lie on a ring, but {what}."


def _goes_on_between(seen: _Seen) -> bool:
    """Whether there is as much light (H, W) in the gaps (G,) from lights at angles (G,) on to the next as at these.

    Lights that run together are less wide between, and others less bright.
    """
    # Of each pair of neighbours the first, the middle and the second.
    gaps_rad, at_rad = seen.gaps_rad, seen.at_rad[:, None] + seen.gaps_rad[:, None] * [0.0, 0.5, 1.0]
    own = seen.light_in_discs(seen.in_part_px(at_rad, np.ones(3)))
    if not _as_bright_between(own, gaps_rad):  # nor are they above a background, which takes time to tell
        return False
    along_rad = at_rad[..., None] + gaps_rad[:, None, None] * _ALONG
    off = np.minimum(_ACROSS * gaps_rad, _ACROSS)[:, None, None]
    inner_px, outer_px = (seen.in_part_px(along_rad, 1 + side * off)[..., None, :] for side in (-1, 1))
    steps = round(float(np.nanmedian(np.linalg.norm(outer_px - inner_px, axis=-1)))) + 9
    share = np.linspace(0.0, 1.0, steps)[:, None]
    across = _light_at(seen.light, inner_px * (1 - share) + outer_px * share).mean(axis=2)
    background = np.minimum(across[..., 0].mean(axis=1), across[..., -1].mean(axis=1))[:, None]
    return all(_as_bright_between(one - background, gaps_rad) for one in (across.mean(axis=2), own))


def _goes_on_beside(seen: _Seen, middles_px: np.ndarray) -> bool:
    """Whether lights at places (N, 2) are ends of lines: as bright on one side, in or out of the ring, else dark.

    Beside a lamp or a strip it is dark on both sides, or bright on both where only its middle was taken for the light.
    Between lines it is dark as well: a plate or a rim that is lit up to the lamps is as bright there.
    """
    off = np.minimum(_ACROSS * seen.gaps_rad, _ACROSS)
    ends_px = seen.in_part_px(seen.at_rad[:, None], 1 + off[:, None] * [-1.0, 1.0])
    across_px = ends_px[:, 1] - ends_px[:, 0]
    step_px = 2 * seen.own_px * across_px / np.linalg.norm(across_px, axis=1, keepdims=True)
    places_px = middles_px[:, None] + step_px[:, None] * [[-1.0], [0.0], [1.0]]
    lights = seen.light_in_discs(places_px)
    if max(_beside(lights)) <= _GOES_ON:  # nor is it above a background, which takes time to tell
        return False
    background = seen.light_in_discs(ends_px).min(axis=1)
    lights -= background[:, None]
    shares = _beside(lights)
    if max(shares) <= _GOES_ON or min(shares) >= _DARK:
        return False
    step = 2 * off * np.linalg.norm(step_px, axis=1) / np.linalg.norm(across_px, axis=1)
    next_px = seen.in_part_px(seen.at_rad + seen.gaps_rad / 2, 1 + step * (1 if shares[1] > shares[0] else -1))
    lights[:, 0] = seen.light_in_discs(next_px) - background
    return _beside(lights)[0] < _DARK


def _goes_to_the_middle(seen: _Seen) -> bool:
    """Whether lines lead from lights at angles (N,) half way to the ring's middle, and it is dark between these."""
    lines = seen.light_in_discs(seen.in_part_px(seen.at_rad[:, None], _INWARDS))
    if np.median(lines / np.maximum(lines[:, :1], 1e-9), axis=0).min() <= _STRIP:
        return False  # nor is it above a background, which takes time to tell
    between = seen.light_in_discs(seen.in_part_px((seen.at_rad + seen.gaps_rad / 2)[:, None], _INWARDS))
    background = between[:, :1]
    on_line, beside = ((one - background) / np.maximum(lines[:, :1] - background, 1e-9) for one in (lines, between))
    return bool(np.median(on_line, axis=0).min() > _STRIP and np.median(beside[:, 1]) < _DARK)


def _goes_on_somewhere(light: np.ndarray, middles_px: np.ndarray, own_px: float) -> bool:
    """Whether most places (N, 2) are as bright on beyond them in some direction, above the darkest."""
    around = own_px * 2 * np.vstack([np.zeros(2), _AROUND])
    lights = _light_at(light, middles_px[:, None, None] + around[:, None] + own_px * _OWN).mean(axis=2)
    darkest = lights.min(axis=1)
    above = (lights[:, 1:].max(axis=1) - darkest) / np.maximum(lights[:, 0] - darkest, 1e-9)
    return statistics.median(above.tolist()) > _STRIP


def _beside(lights: np.ndarray) -> tuple[float, float]:
    """Medians of light (N, 3) before and after lights, over that at them."""
    before, _, after = lights.T / np.maximum(lights[:, 1], 1e-9)
    return statistics.median(before.tolist()), statistics.median(after.tolist())


def _as_bright_between(lights: np.ndarray, gaps_rad: np.ndarray) -> bool:
    """Whether the middles of most pairs, of light (G, 3) at the first, the middle and the second, are as bright.

    Or nearly, of every second pair: so are both ends of a strip.
    """
    first, between, second = lights.T
    shares = 2 * between / np.maximum(first + second, 1e-9)
    if statistics.median(shares.tolist()) > _GOES_ON:
        return True
    if len(shares) % 2 or len(shares) < _FEWEST_ENDS or gaps_rad.max() > _IN_PAIRS * gaps_rad.min():
        return False
    dark, bright = sorted((shares[::2], shares[1::2]), key=lambda half: statistics.median(half.tolist()))
    return bool(bright.min() > max(_STRIP, dark.max() + _GAP))


def _light_at(light: np.ndarray, places_px: np.ndarray) -> np.ndarray:
    """Light (...) of a picture at places (..., K, 2) between its pixels, and beyond its edge that of the edge."""
    x, y = np.fmax(places_px, -1.0).astype(np.float32).reshape(-1, *places_px.shape[-2:]).transpose(2, 0, 1)
    seen = cv2.remap(light, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return seen.reshape(places_px.shape[:-1]).astype(float)


def on_plane(markers: Markers, pose: CirclePose, camera: Camera, dock: Dock) -> np.ndarray:
    """Where (N, 2) in metres all groups lie on the plane of a dock's lights by a pose."""
    rays = light_rays(markers.points_px, camera, float(pose.position_m[2]))
    ring_m = pose.position_m + dock.lamp_depth_m * pose.rotation[:, 2]
    return on_planes(rays, pose.rotation[None], ring_m[None])[0]
