"""The poses of lights that a person has set: no search, and nobody asks whether they are a dock."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate.stages import Picture, weighed_by_extra_lights
from dockpose.lights.by_hand import ByHand, markers_at
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.detection import accept_pose, found_in_words, is_spaced_as
from dockpose.pose.few_lights import FEWEST
from dockpose.pose.solve import find_poses
from dockpose.settings import Settings
from dockpose.text import InputError
from dockpose.thresholds import METHODS

_NUMBERS = 6  # of a pose with its roll; so many lights and more tell, without one of them, where it must be
_NO_CHANCE = 1e-3  # that so much is gained by leaving out one light of many that are where they should be
_LEAST_OFF_PX = 1.0  # that a light is said to be


def at_lights(
    picture: Picture, camera: Camera, dock: Dock, settings: Settings, by_hand: ByHand
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and stages of lights that somebody has set. Raises MethodError as the search does."""
    threshold = METHODS[settings.method](picture.histogram, settings.min_area_px, settings.level)
    light, white = picture.light
    markers = markers_at(by_hand, light, picture.histogram.levels, white, (camera.cx, camera.cy))
    ring = Ring(np.ones(len(markers), dtype=bool), f"{len(markers)} lights were set by hand.")
    begun = {"threshold": threshold, "markers": markers, "ring": ring}
    status, message, stages = judge_set(picture, camera, dock, begun, "set by hand")
    if status == "ok" and (odd := odd_light(markers, camera, dock, stages["choice"])) is not None:
        message += f" Light {odd[0] + 1} is {odd[1]:.1f} px from where the others have it."
    return status, message, stages | {"found_by": "hand", "by_hand": by_hand}


def spot_at(picture: Picture, camera: Camera, point_px: tuple[float, float], others_px: np.ndarray) -> Markers:
    """The one light, of a group of pixels, that would be taken to be at a point in pixels, beside others (N, 2)."""
    light, white = picture.light
    by_hand = ByHand((point_px, *map(tuple, others_px.tolist())), snap=True)
    markers = markers_at(by_hand, light, picture.histogram.levels, white, (camera.cx, camera.cy))
    return markers.part(np.arange(len(markers)) == 0)


def judge_set(
    picture: Picture, camera: Camera, dock: Dock, stages: dict[str, Any], seen: str
) -> tuple[str, str, dict[str, Any]]:
    """Status, message and stages of lights of which a person says that they are the dock's, and how they are seen."""
    ring: Ring = stages["ring"]
    markers: Markers = stages["markers"].part(ring.on_ring)
    count = len(markers)
    lights = f"{count} light{'' if count == 1 else 's'} {seen}"
    fewest = MIN_POINTS if dock.lights is None else FEWEST
    if count < fewest:
        fewer = f", or {FEWEST} where the number of the dock's lights is known" if dock.lights is None else ""
        return "too_few_markers", f"{lights}; a pose needs {fewest}{fewer}.", stages
    if dock.lights is not None and count > dock.lights:
        raise InputError(f"{lights}; the dock has {dock.lights}")
    alone = Ring(np.ones(count, dtype=bool), ring.reason, lights=ring.lights)
    try:
        ellipse, choice, _, reason = accept_pose(alone, markers, camera, dock, picture.area_px2)
    except NoEllipseError as error:
        return "no_ellipse", f"{lights}; no ellipse: {error}.", stages
    choice = weighed_by_extra_lights(choice, alone, markers, picture, camera, dock)
    words = found_in_words(alone, choice, camera, dock).replace(f"{count} lights on the ring", lights, 1)
    if reason is not None and not is_spaced_as(count, choice, dock):
        words += f" {reason}"
    ring = replace(ring, lights=choice.number or ring.lights)
    return "ok", words, stages | {"ring": ring, "ellipse": ellipse, "choice": choice, "detection": None}


def odd_light(markers: Markers, camera: Camera, dock: Dock, choice: Choice) -> tuple[int, float] | None:
    """The one light without which the others fit far better, and by how many pixels it is off; None where none is.

    An F-test of two numbers more, the light's own shift (Seber and Lee 2003, section 10.6), for the best of all lights.
    """
    from scipy.special import fdtrc  # takes a third of a second to import, which few pictures need

    count = len(markers)
    if count <= _NUMBERS:
        return None
    squares_px2, freedom = _squares_px2(choice, count), 2 * (count - 1) - _NUMBERS
    left_px2 = np.full(count, math.inf)
    for light in range(count):
        rest = markers.part(np.arange(count) != light)
        try:
            without = find_poses(rest.points_px, camera, dock, covariances_px2=rest.covariances_px2)[1]
        except NoEllipseError:
            continue
        left_px2[light] = _squares_px2(without, count - 1)
    odd = int(left_px2.argmin())
    gained_px2 = squares_px2 - left_px2[odd]
    if gained_px2 < _LEAST_OFF_PX**2:
        return None
    chance = count * fdtrc(2, freedom, gained_px2 / 2 / (max(left_px2[odd], 1e-12) / freedom))
    off_px = math.sqrt(gained_px2 * count / (count - _NUMBERS / 2))  # what of the shift the others cannot follow
    return (odd, off_px) if chance < _NO_CHANCE else None


def _squares_px2(choice: Choice, count: int) -> float:
    """Sum of squares of how far so many lights are off their places by the chosen pose."""
    return count * (choice.candidates[choice.selected].rms_px or 0.0) ** 2
