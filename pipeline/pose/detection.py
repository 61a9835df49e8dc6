"""Whether what was found is a dock at all: where its lights lie on the refined pose, against what chance would make."""

import math
from dataclasses import replace

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.chance import (
    ACCEPTED,
    ACCEPTED_AMONG_OTHERS,
    ALIKE,
    BUILT_WITHIN,
    MOST_LIGHTS,
    NO_STRINGS,
    log_background,
    log_chance_of_all,
    log_chance_of_spacing,
    log_tube,
    near_of,
    squares_apart_px2,
    strings_of,
)
from dockpose.lights.ellipse import MIN_POINTS, Ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.region import beside_middle
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.number import OTHERS, odds_of_lit
from dockpose.pose.side import other_focal_px, poses_by_side
from dockpose.pose.solve import find_poses
from dockpose.pose.strokes import on_plane


def accept_pose(
    ring: Ring, markers: Markers, camera: Camera, dock: Dock, area_px2: float
) -> tuple[Ellipse, Choice, float, str | None]:
    """Return a ring's ellipse, poses, log of its chance, and why it is no dock; NoEllipseError where it has no pose."""
    lights = markers.part(ring.on_ring)
    if dock.extra_lights_m:  # that one is seen makes no ring likelier to be chance
        beside = beside_middle(markers.points_px, lights.points_px.mean(axis=0), ~ring.on_ring, dock)
        ring, markers = replace(ring, on_ring=ring.on_ring[beside]), markers.part(beside)
    ellipse, choice = find_poses(lights.points_px, camera, dock, ring.ellipse, lights.covariances_px2)
    other = None if ring.focal_px is None or ring.lights is None else (ring.focal_px, ring.lights)
    if other is not None:  # the spacing would only tell how wrong the camera is
        dock = dock.with_lights(None)
        ellipse, choice = poses_by_side(lights.points_px, camera, dock, *other, ring.ellipse)
    number = dock.lights if other is not None else dock.lights or choice.number
    numbered = dock if number == dock.lights else dock.with_lights(number)
    log_chance = log_chance_of_ring(ring, markers, ellipse, choice, camera, numbered, area_px2)
    reason = why_no_dock(ring, markers, choice, camera, numbered, log_chance)
    if reason is None and other is None:
        other = other_focal_px(lights.points_px, camera, dock, ellipse, choice)
        if other is not None:
            dock = dock.with_lights(None)
            ellipse, choice = poses_by_side(lights.points_px, camera, dock, *other, ellipse)
    return ellipse, choice, log_chance, reason


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
    near = near_of(markers.points_px, brightness, members, ellipse.centre_px, ellipse.semi_axes_px[0])
    squares_px2 = count * (choice.candidates[0].rms_px or 0.0) ** 2
    apart_px2 = _squares_of_px2(ring, markers, ellipse, choice, camera, dock)
    strings = NO_STRINGS if choice.lights is None else strings_of(np.bincount(choice.lights, minlength=sides) > 0)
    tube = log_tube(count, sides, not (dock.angles_deg or dock.offsets_m), squares_px2, apart_px2)
    return tests + tube + log_background(count, sides, ellipse.semi_axes_px, area_px2, near, strings)


def _squares_of_px2(
    ring: Ring, markers: Markers, ellipse: Ellipse, choice: Choice, camera: Camera, dock: Dock
) -> tuple[float, float]:
    """Sums of squares of how far lights are off their places along the rim and across it; below 0 of uneven places."""
    if choice.lights is None or choice.focal_px is not None or dock.offsets_m:
        return ALIKE
    flat = on_plane(markers, choice.candidates[0], camera, dock)[ring.on_ring] / dock.radius
    lights = choice.lights
    angles_rad = dock.light_angles_rad()[lights] if dock.lights else 2 * math.pi * lights / len(lights)
    polar = np.column_stack([np.hypot(*flat.T) - 1, np.arctan2(flat[:, 1], flat[:, 0])])
    return squares_apart_px2(polar, angles_rad, ellipse.semi_axes_px)


def why_no_dock(
    ring: Ring, markers: Markers, choice: Choice, camera: Camera, dock: Dock, log_chance: float
) -> str | None:
    """Return why the lights of a ring are not the dock's, as a sentence; None where they are."""
    count = int(ring.on_ring.sum())
    pose = choice.candidates[choice.selected]
    rms_px, is_spaced = pose.rms_px or 0.0, is_spaced_as(count, choice, dock)
    may_be_chance = log_chance > math.log(ACCEPTED)
    is_whole = count == dock.lights == len(markers)
    if not is_spaced or (may_be_chance and is_whole):
        x_m, y_m = on_plane(markers, pose, camera, dock)[ring.on_ring].T
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


def evenly_spaced_part(ring: Ring, markers: Markers, choice: Choice, camera: Camera, dock: Dock) -> Ring | None:
    """Return a ring without groups between its lights' places, as some that run together are; None if it is none.

    The others must be spaced as chance hardly would, by one of the poses, which nothing told apart.
    """
    members, is_told = np.flatnonzero(ring.on_ring), choice.lights is not None or choice.focal_px is not None
    if is_told or dock.lights is None or dock.angles_deg or dock.offsets_m or len(members) > dock.lights:
        return None
    found = []
    for pose in choice.candidates:
        x_m, y_m = on_plane(markers, pose, camera, dock)[ring.on_ring].T
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


def detection_of(log_chance: float, ring: Ring, choice: Choice, camera: Camera, dock: Dock) -> float:
    """Return the probability that a ring is the dock: by how many chance would make, and how many others are alike.

    Of an unknown number other evenly spaced things are as likely as how many places are lit has it, or where lights
    are farther off their places than hands put them.
    """
    others, lit, pose = 0.0, int(ring.on_ring.sum()), choice.candidates[choice.selected]
    if dock.lights is None and ring.lights and lit <= ring.lights:
        others = min(1.0, OTHERS / odds_of_lit(lit, ring.lights))
        built_px = BUILT_WITHIN * camera.fx * dock.radius / float(pose.position_m[2])
        if choice.focal_px is None and (pose.rms_px or 0.0) > built_px:
            others = 1.0
    return 1 / (1 + ring.alike + others + math.exp(min(log_chance, 100.0)))


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
    if choice.extra_px is not None:
        words += f" Extra lights seen: {np.isfinite(choice.extra_px[:, 0]).sum()} of {len(choice.extra_px)}."
    if dock.offsets_m and on_ring < MIN_POINTS:
        words += f" With fewer than {MIN_POINTS} lights the dock file's offsets are not used."
    if choice.focal_px is not None:
        told = f"The spacing fits a focal length of about {choice.focal_px:.0f} px, not the camera's {camera.fx:.0f} px"
        words += f" {told}: check the camera file."
    return words
