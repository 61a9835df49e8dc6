"""Whether what was found is a dock at all: where its lights lie on the refined pose, against what chance would make."""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.chance import (
    ACCEPTED,
    ACCEPTED_AMONG_OTHERS,
    MOST_LIGHTS,
    cables_of,
    log_chance_rings,
    neighbours,
)
from dockpose.lights.conics import log_chance_of_spacing
from dockpose.lights.ellipse import MIN_POINTS, Ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.lights.whole import log_chance_of_all
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import light_rays, on_planes
from dockpose.pose.solve import find_poses

# A line's light goes on beside what seem to be lights of it; noise hides a twentieth of it.
_GOES_ON = 0.95
# Between both ends of a strip it is nearly as bright, and in every second gap darker by so much: of eight lights that
# run together the gaps hardly alternate by chance (2 in 70). Lamps that stand in pairs are nearer by half.
_STRIP, _GAP, _FEWEST_ENDS, _IN_PAIRS = 0.8, 0.1, 8, 2.0
_DARK = 0.5  # of a light, beside the end of a line and between lines: where its edge is
# Light is summed across the ring this share of a spacing either way, of the radius at the most, since lights may run
# together; and along it over a quarter, at five places.
_ACROSS, _ALONG = 0.75, np.linspace(-0.125, 0.125, 5)
_OWN = np.mgrid[-4:5, -4:5].reshape(2, -1).T / 4  # places around a light's middle, in its radii
_OWN_LEAST_PX = 2.0  # of these: a thinner stroke is brighter where it meets the middle of a pixel
_OWN = _OWN[np.hypot(*_OWN.T) <= 1]
_NEIGHBOURS = 1.5  # times the median spacing, within which no light is missing between two


def judged(
    ring: Ring,
    markers: Markers,
    camera: Camera,
    dock: Dock,
    area_px2: float,
    labels: Sequence[str | None] | None = None,
) -> tuple[Ellipse, Choice, float, str | None]:
    """Return a ring's ellipse, poses, log of its chance, and why it is no dock; NoEllipseError where it has no pose."""
    lights = markers.part(ring.on_ring)
    ellipse, choice = find_poses(lights.points_px, camera, dock, labels, ring.ellipse, lights.covariances_px2)
    log_chance = log_chance_of_ring(ring, markers, ellipse, choice, camera, dock, area_px2)
    return ellipse, choice, log_chance, why_no_dock(ring, markers, ellipse, choice, camera, dock, log_chance)


def log_chance_of_ring(
    ring: Ring, markers: Markers, ellipse: Ellipse, choice: Choice, camera: Camera, dock: Dock, area_px2: float
) -> float:
    """Return the logarithm of the expected number of chance rings in the picture as good as a pose's."""
    count = int(ring.on_ring.sum())
    if count < 4:
        return -math.inf
    sides = dock.lights or ring.lights
    if sides is None or count > sides:
        return log_chance_of_all(ellipse, count, count / area_px2)  # lights anywhere on an ellipse
    tests = math.log(MOST_LIGHTS) if dock.lights is None else 0.0
    members, brightness = np.flatnonzero(ring.on_ring), markers.areas_px * markers.peaks.astype(float)
    near = neighbours(markers.points_px, brightness, members, ellipse.centre_px, ellipse.semi_axes_px[0])
    rms_px = choice.candidates[0].rms_px or 0.0
    return tests + log_chance_rings(
        count,
        sides,
        even=not (dock.angles_deg or dock.offsets_m),
        squares_px2=count * rms_px**2,
        apart_px2=_squares_apart_px2(ring, markers, ellipse, choice, camera, dock),
        semi_axes_px=ellipse.semi_axes_px,
        near=near,
        area_px2=area_px2,
        cables=() if choice.lights is None else cables_of(np.bincount(choice.lights, minlength=sides) > 0),
    )


def _squares_apart_px2(
    ring: Ring, markers: Markers, ellipse: Ellipse, choice: Choice, camera: Camera, dock: Dock
) -> tuple[float, float] | None:
    """Sums of the squares of how far lights are off their places along the rim and across it, if these are even."""
    if choice.lights is None or dock.offsets_m:
        return None
    x_m, y_m = _on_plane(markers, choice.candidates[0], camera, dock)[ring.on_ring].T
    off_rad = np.arctan2(y_m, x_m) - _angles_rad(dock, choice.lights)
    off_rad = np.angle(np.exp(1j * off_rad) * np.exp(-1j * off_rad).mean())
    scale_px = math.sqrt(math.prod(ellipse.semi_axes_px))
    across = np.hypot(x_m, y_m) / dock.radius - 1
    return scale_px**2 * float(off_rad @ off_rad), scale_px**2 * float(across @ across)


def _angles_rad(dock: Dock, lights: np.ndarray) -> np.ndarray:
    """Angles (N,) of lights of a dock around it."""
    return dock.light_angles_rad()[lights] if dock.lights else 2 * math.pi * lights / len(lights)


def why_no_dock(
    ring: Ring, markers: Markers, ellipse: Ellipse, choice: Choice, camera: Camera, dock: Dock, log_chance: float
) -> str | None:
    """Return why the lights of a ring are not the dock's, as a sentence; None where they are."""
    count = int(ring.on_ring.sum())
    pose = choice.candidates[choice.selected]
    rms_px, is_spaced = pose.rms_px or 0.0, is_spaced_as(count, choice, dock)
    may_be_chance = log_chance > math.log(ACCEPTED)
    is_whole = count == dock.lights == len(markers)
    if not is_spaced or (may_be_chance and is_whole):
        x_m, y_m = _on_plane(markers, pose, camera, dock)[ring.on_ring].T
        angles = np.degrees(np.arctan2(y_m, x_m))
        where = f"{rms_px:.1f} px off the dock's" if is_spaced else "not spaced as the dock's lights are"
        return _off_in_words(np.sort(angles), dock, where)
    if may_be_chance:
        others = len(markers) - count
        among = f"among {others} other{'' if others == 1 else 's'} " if others else ""
        return f"{count} groups {among}lie on a ring, but so inexactly, {rms_px:.1f} px, that it may be chance."
    return None


def is_spaced_as(count: int, choice: Choice, dock: Dock) -> bool:
    """Whether so many lights are spaced as the dock's, as far as that tells."""
    # Of few lights the poses' fit says nothing on their spacing; where they coincide it need not.
    return dock.lights is None or choice.selected_by != "none" or (choice.coincide and count < MIN_POINTS)


def why_no_lights(
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
    x_m, y_m = _on_plane(markers, pose, camera, dock)[ring.on_ring].T
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
    near = gaps_rad < _NEIGHBOURS * statistics.median(gaps_rad.tolist())
    middles_px = markers.points_px[ring.on_ring][order] - corner_px
    if _goes_on_between(light, at_rad[near], gaps_rad[near], own_px, in_part_px):
        what = "between them it is as bright: a hoop or strips, not lights"
    elif _goes_on_beside(light, middles_px, at_rad, gaps_rad, own_px, in_part_px):
        what = "each goes on to one side of it: the ends of lines, not lights"
    else:
        return None
    return f"{len(at_rad)} peaks lie on a ring, but {what}."


def _goes_on_between(
    light: np.ndarray,
    at_rad: np.ndarray,
    gaps_rad: np.ndarray,
    own_px: float,
    in_part_px: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> bool:
    """Whether there is as much light (H, W) in the gaps (G,) from lights at angles (G,) on to the next as at these.

    Lights that run together are less wide between, and others less bright.
    """
    # Of each pair of neighbours the first, the middle and the second.
    at_rad = at_rad[:, None] + gaps_rad[:, None] * [0.0, 0.5, 1.0]
    own = _light_at(light, in_part_px(at_rad, np.ones(3))[..., None, :] + own_px * _OWN).mean(axis=2)
    if not _as_bright_between(own, gaps_rad):  # nor are they above a background, which takes time to tell
        return False
    along_rad = at_rad[..., None] + gaps_rad[:, None, None] * _ALONG
    off = np.minimum(_ACROSS * gaps_rad, _ACROSS)[:, None, None]
    inner_px, outer_px = (in_part_px(along_rad, 1 + side * off)[..., None, :] for side in (-1, 1))
    steps = round(float(np.nanmedian(np.linalg.norm(outer_px - inner_px, axis=-1)))) + 9
    share = np.linspace(0.0, 1.0, steps)[:, None]
    across = _light_at(light, inner_px * (1 - share) + outer_px * share).mean(axis=2)
    background = np.minimum(across[..., 0].mean(axis=1), across[..., -1].mean(axis=1))[:, None]
    return all(_as_bright_between(one - background, gaps_rad) for one in (across.mean(axis=2), own))


def _goes_on_beside(
    light: np.ndarray,
    middles_px: np.ndarray,
    at_rad: np.ndarray,
    gaps_rad: np.ndarray,
    own_px: float,
    in_part_px: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> bool:
    """Whether lights at places (N, 2) are ends of lines: as bright on one side, in or out of the ring, else dark.

    Beside a lamp or a strip it is dark on both sides, or bright on both where only its middle was taken for the light.
    Between lines it is dark as well: a plate or a rim that is lit up to the lamps is as bright there.
    """
    off = np.minimum(_ACROSS * gaps_rad, _ACROSS)
    ends_px = in_part_px(at_rad[:, None], 1 + off[:, None] * [-1.0, 1.0])
    across_px = ends_px[:, 1] - ends_px[:, 0]
    step_px = 2 * own_px * across_px / np.linalg.norm(across_px, axis=1, keepdims=True)
    places_px = middles_px[:, None] + step_px[:, None] * [[-1.0], [0.0], [1.0]]
    lights = _light_at(light, places_px[:, :, None] + own_px * _OWN).mean(axis=2)
    if max(_beside(lights)) <= _GOES_ON:  # nor is it above a background, which takes time to tell
        return False
    background = _light_at(light, ends_px[:, :, None] + own_px * _OWN).mean(axis=2).min(axis=1)
    lights -= background[:, None]
    shares = _beside(lights)
    if max(shares) <= _GOES_ON or min(shares) >= _DARK:
        return False
    step = 2 * off * np.linalg.norm(step_px, axis=1) / np.linalg.norm(across_px, axis=1)
    next_px = in_part_px(at_rad + gaps_rad / 2, 1 + step * (1 if shares[1] > shares[0] else -1))
    lights[:, 0] = _light_at(light, next_px[:, None] + own_px * _OWN).mean(axis=1) - background
    return _beside(lights)[0] < _DARK


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


def spaced_alone(ring: Ring, markers: Markers, choice: Choice, camera: Camera, dock: Dock) -> Ring | None:
    """Return a ring without groups between its lights' places, as some that run together are; None if it is none.

    The others must be spaced as chance hardly would, by one of the poses, which nothing told apart.
    """
    members = np.flatnonzero(ring.on_ring)
    if dock.lights is None or dock.angles_deg or dock.offsets_m or len(members) > dock.lights:
        return None
    found = []
    for pose in choice.candidates:
        x_m, y_m = _on_plane(markers, pose, camera, dock)[ring.on_ring].T
        angles = np.arctan2(y_m, x_m)
        chance, corner_of, fit = log_chance_of_spacing(angles, dock.lights, 0.0)
        if len(np.unique(corner_of[fit])) == fit.sum() >= MIN_POINTS:
            found.append((chance, fit))
    chance, fit = min(found, key=lambda each: each[0], default=(math.inf, np.ones(len(members), dtype=bool)))
    # Lights of another number are even too, and some of them always near these places.
    if chance > math.log(ACCEPTED_AMONG_OTHERS / MOST_LIGHTS) or fit.all():
        return None
    on_ring = np.zeros(len(markers), dtype=bool)
    on_ring[members[fit]] = True
    others = len(members) - int(fit.sum())
    return replace(ring, on_ring=on_ring, ellipse=None, reason=f"{ring.reason} {others} of them lie between places.")


def _on_plane(markers: Markers, pose: CirclePose, camera: Camera, dock: Dock) -> np.ndarray:
    """Where (N, 2) in metres all groups lie on the plane of a dock's lights by a pose."""
    rays = light_rays(markers.points_px, camera, float(pose.position_m[2]))
    ring_m = pose.position_m + dock.lamp_depth_m * pose.rotation[:, 2]
    return on_planes(rays, pose.rotation[None], ring_m[None])[0]


def _off_in_words(angles_deg: np.ndarray, dock: Dock, where: str) -> str:
    """Say how far lights at ascending angles (N,) are off their places, and what to do about it."""
    count = len(angles_deg)
    lie = f"{count} groups lie on an ellipse, but {where}"
    if dock.angles_deg or dock.lights != count:
        return f"{lie}: other lights, another dock, or another camera."
    step = 360 / count
    off = angles_deg - angles_deg[0] - step * np.arange(count)
    off -= (off.max() + off.min()) / 2
    seen = ", ".join(f"{angle:.0f}" for angle in angles_deg - angles_deg[0])
    return (
        f"{lie}: they are seen at {seen} degrees, up to {np.abs(off).max():.0f} off even spacing. If this is the dock, "
        "measure angles_deg or run learn-dock; else the camera file is another's."
    )


def detection_of(log_chance: float, alike: int) -> float:
    """Return the probability that a ring is the dock: by how many chance would make, and how many others are alike."""
    return 1 / (1 + alike + math.exp(min(log_chance, 100.0)))


def few_in_words(markers: Markers, lights: int) -> str:
    """Return how many groups were seen, and how many of them lie on a ring."""
    if lights < markers.seen:
        return f"Only {lights} of the {markers.seen} groups of bright pixels lie on a ring"
    return f"Only {lights} group{'' if lights == 1 else 's'} of bright pixels"


def found_in_words(ring: Ring, choice: Choice, camera: Camera, dock: Dock) -> str:
    """Return a sentence on the dock that was found: its lights, how far it is, how sure the chosen pose is."""
    pose, on_ring = choice.candidates[choice.selected], int(ring.on_ring.sum())
    words = f"{on_ring} lights on the ring; the dock is {100 * pose.position_m[2]:.1f} cm ahead"
    if ring.rivals:
        words += f"; {len(ring.rivals)} more ring{'s are' if len(ring.rivals) > 1 else ' is'} in view"
    percent = f"{100 * (pose.probability or 0):.0f} %"
    if choice.coincide:
        words += ", seen square on, where both poses are the same within their errors."
    elif choice.selected_by == "none":
        words += ". The lights' spacing does not tell which of the two poses is right."
    elif not choice.decided:
        words += f". Undecided between the two poses; the likelier one has {percent}."
    else:
        words += f", the likelier pose at {percent}."
    if dock.offsets_m and on_ring < MIN_POINTS:
        words += f" With fewer than {MIN_POINTS} lights the dock file's offsets are not used."
    if ring.focal_px is not None:
        told = f"The spacing fits a focal length of about {ring.focal_px:.0f} px, not the camera's {camera.fx:.0f} px"
        words += f" {told}: check the camera file."
    return words
