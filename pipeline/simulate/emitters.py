"""All points that send light to the camera: the dock's lights, other lamps, and their reflections."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from dockpose.simulate.optics.water import BANDS
from dockpose.simulate.parts import COLOURS, SIDES
from dockpose.simulate.scene import Scene, Truth, dock_rotation, random_stream

_WATER_INDEX = 1.333  # of refraction, fresh water at 20 degrees Celsius
_GLINTS = 5  # a rippled surface breaks a reflection into about this many glints
_AROUND, _SMALL = 12, 0.25  # points of a rim and of a dome's circles; their radius, as a share of the lamp's
_SURFACE = "surface"


class _Plane(NamedTuple):
    """What mirrors the lights: the water's surface or a wall, and how far it is from the camera."""

    side: str
    distance_m: float
    rough_deg: float
    share: float | None  # of the light that it mirrors; None as Fresnel has it


@dataclass(frozen=True)
class Emitters:
    """Points of light as the camera sees them."""

    points_m: np.ndarray  # (N, 3): positions in the camera frame
    levels: np.ndarray  # (N,): grey level at the centre of the point's image, 1 m ahead in clear water
    intensity: np.ndarray  # (N,): light sent towards the camera, as a share of that sent straight ahead
    radii_m: np.ndarray  # (N,): radii of the lamps
    colours: np.ndarray  # (N, 3): response of the blue, green and red bands to each


def emitters_of(scene: Scene, truth: Truth) -> Emitters:
    """Collect everything in a scene that shines and whose light can reach the camera."""
    extra, lamps = scene.dock.extra_lights_m, scene.lamps
    places_m = truth.position_m + np.array(extra).reshape(-1, 3) @ dock_rotation(scene).T
    points_m = np.concatenate([truth.lights_m, places_m])
    ones, white = np.ones(len(extra)), ("white",) * len(extra)
    brightness = np.array(scene.lights.brightness or np.ones(len(truth.lights_m))) * truth.lit
    lights = Emitters(
        points_m=points_m,
        levels=scene.lights.level * np.concatenate([brightness, ones]),
        intensity=_beam(points_m, truth.normal, scene.lights.beam_exponent),
        radii_m=scene.lights.radius_m * np.concatenate([scene.lights.size or np.ones(len(truth.lights_m)), ones]),
        colours=np.array([COLOURS[name] for name in (*scene.light_colours, *white)]).reshape(-1, len(BANDS)),
    )
    others = Emitters(
        points_m=np.array([lamp.position_m for lamp in lamps]).reshape(-1, 3),
        levels=np.array([lamp.level for lamp in lamps]),
        intensity=np.ones(len(lamps)),
        radii_m=np.array([lamp.radius_m for lamp in lamps]),
        colours=np.ones((len(lamps), len(BANDS))),
    )
    parts = [lights, others]
    planes = [_Plane(wall.side, wall.distance_m, wall.rough_deg, wall.share) for wall in scene.walls]
    if scene.mirror is not None:
        planes.insert(0, _Plane(_SURFACE, scene.mirror.height_m, scene.mirror.ripple_deg, None))
    for plane in planes:
        parts += [_mirrored(scene, plane, part, truth.normal if part is lights else None) for part in parts[:2]]
    if scene.lights.rim > 0 or scene.lights.dome > 0:
        parts.append(_fittings(scene, lights))
    joined = Emitters(*(np.concatenate([getattr(part, name) for part in parts]) for name in Emitters.__annotations__))
    reach = (joined.points_m[:, 2] > 0) & (joined.levels * joined.intensity > 0)
    return Emitters(*(getattr(joined, name)[reach] for name in Emitters.__annotations__))


def _beam(points_m: np.ndarray, normal: np.ndarray, exponent: float) -> np.ndarray:
    """Intensity towards the camera of lamps that face along the normal: cos^exponent, and nothing backwards."""
    cosine = -(points_m @ normal) / np.linalg.norm(points_m, axis=1)
    return np.where(cosine > 0, np.maximum(cosine, 0) ** exponent, 0.0)


def _mirrored(scene: Scene, plane: _Plane, part: Emitters, normal: np.ndarray | None) -> Emitters:
    """Reflections in the surface or a wall: each light broken into glints, and attenuated."""
    axis, towards = (1, -1.0) if plane.side == _SURFACE else SIDES[plane.side]
    flip = np.where(np.arange(3) == axis, -1.0, 1.0)
    within = towards * part.points_m[:, axis] < plane.distance_m
    points = part.points_m[within] * flip
    points[:, axis] += 2 * towards * plane.distance_m
    distance = np.linalg.norm(points, axis=1)
    share = _reflected(np.abs(points[:, axis]) / distance) if plane.share is None else plane.share
    intensity = part.intensity[within]
    if normal is not None:
        intensity = _beam(points, normal * flip, scene.lights.beam_exponent)
    rng = random_stream(scene, "mirror" if plane.side == _SURFACE else plane.side)
    # A tilt of the surface turns the ray by twice the angle, mostly to and fro at grazing incidence.
    tilt = np.radians(2 * plane.rough_deg) * distance[:, None] / 2
    spread = np.array([1.0, 0.3, 0.0]) if axis == 0 else np.array([0.3, 1.0, 0.0])
    jitter = rng.normal(size=(len(points), _GLINTS, 3)) * spread * tilt[:, :, None]
    return Emitters(
        points_m=(points[:, None] + jitter).reshape(-1, 3),
        levels=np.repeat(part.levels[within] * share / _GLINTS, _GLINTS),
        intensity=np.repeat(intensity, _GLINTS),
        radii_m=np.repeat(part.radii_m[within], _GLINTS),
        colours=np.repeat(part.colours[within], _GLINTS, axis=0),
    )


def _fittings(scene: Scene, lights: Emitters) -> Emitters:
    """Rims around the lamps, and domes over them: circles of small lights, a dome's half way up and its top."""
    around = 2 * np.pi * np.arange(_AROUND) / _AROUND
    circle = np.column_stack([np.cos(around), np.sin(around), 0 * around])
    half_way = circle * math.sqrt(0.5) - [0, 0, math.sqrt(0.5)]
    places = np.concatenate([circle, half_way, [[0.0, 0.0, -1.0]]]) @ dock_rotation(scene).T
    shares = np.repeat([scene.lights.rim / _AROUND, scene.lights.dome / (_AROUND + 1)], [_AROUND, _AROUND + 1])
    points = lights.points_m[:, None] + lights.radii_m[:, None, None] * places
    small_m = _SMALL * lights.radii_m
    shrunk = _variance_px2(scene, lights.radii_m) / _variance_px2(scene, small_m)  # so that the shares are of light
    return Emitters(
        points_m=points.reshape(-1, 3),
        levels=np.outer(lights.levels * shrunk, shares).ravel(),
        intensity=np.repeat(lights.intensity, len(places)),
        radii_m=np.repeat(small_m, len(places)),
        colours=np.repeat(lights.colours, len(places), axis=0),
    )


def _reflected(cosine: np.ndarray) -> np.ndarray:
    """Share of unpolarised light that a water surface reflects from below, by the cosine of incidence (Fresnel)."""
    sine_out = _WATER_INDEX * np.sqrt(1 - cosine**2)
    cosine_out = np.sqrt(np.maximum(0.0, 1 - sine_out**2))
    across = (_WATER_INDEX * cosine - cosine_out) / (_WATER_INDEX * cosine + cosine_out)
    along = (_WATER_INDEX * cosine_out - cosine) / (_WATER_INDEX * cosine_out + cosine)
    return np.where(sine_out >= 1, 1.0, (across**2 + along**2) / 2)


def energy_of(scene: Scene, emitters: Emitters) -> np.ndarray:
    """Light (N,) through clear water, in grey levels times pixels; levels are of images 1 m ahead."""
    distance2 = (emitters.points_m**2).sum(axis=1)
    return emitters.levels * emitters.intensity * 2 * math.pi * _variance_px2(scene, emitters.radii_m) / distance2


def _variance_px2(scene: Scene, radii_m: np.ndarray) -> np.ndarray:
    """Variance (N,) of the images of lamps 1 m ahead, with the blur of the lens."""
    return scene.sensor.blur_px**2 + scene.camera.fx * scene.camera.fy * (radii_m / 2) ** 2
