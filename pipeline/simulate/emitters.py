"""All points that send light to the camera: the dock's lights, other lamps, and their reflections."""

import math
from dataclasses import dataclass

import numpy as np
from dockpose.simulate.optics.water import BANDS
from dockpose.simulate.parts import COLOURS, Mirror
from dockpose.simulate.scene import Scene, Truth, random_stream

_WATER_INDEX = 1.333  # of refraction, fresh water at 20 degrees Celsius
_GLINTS = 5  # a rippled surface breaks a reflection into about this many glints


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
    count, lamps = len(truth.lights_m), scene.lamps
    lights = Emitters(
        points_m=truth.lights_m,
        levels=scene.lights.level * (np.array(scene.lights.brightness or np.ones(count)) * truth.lit),
        intensity=_beam(truth.lights_m, truth.normal, scene.lights.beam_exponent),
        radii_m=scene.lights.radius_m * np.array(scene.lights.size or np.ones(count)),
        colours=np.array([COLOURS[name] for name in scene.light_colours]).reshape(count, len(BANDS)),
    )
    others = Emitters(
        points_m=np.array([lamp.position_m for lamp in lamps]).reshape(-1, 3),
        levels=np.array([lamp.level for lamp in lamps]),
        intensity=np.ones(len(lamps)),
        radii_m=np.array([lamp.radius_m for lamp in lamps]),
        colours=np.ones((len(lamps), len(BANDS))),
    )
    parts = [lights, others]
    if scene.mirror is not None:
        parts += [_mirrored(scene, scene.mirror, part, truth.normal if part is lights else None) for part in parts]
    joined = Emitters(*(np.concatenate([getattr(part, name) for part in parts]) for name in Emitters.__annotations__))
    reach = (joined.points_m[:, 2] > 0) & (joined.levels * joined.intensity > 0)
    return Emitters(*(getattr(joined, name)[reach] for name in Emitters.__annotations__))


def _beam(points_m: np.ndarray, normal: np.ndarray, exponent: float) -> np.ndarray:
    """Intensity towards the camera of lamps that face along the normal: cos^exponent, and nothing backwards."""
    cosine = -(points_m @ normal) / np.linalg.norm(points_m, axis=1)
    return np.where(cosine > 0, np.maximum(cosine, 0) ** exponent, 0.0)


def _mirrored(scene: Scene, mirror: Mirror, part: Emitters, normal: np.ndarray | None) -> Emitters:
    """Reflections in the surface: each light broken into glints, attenuated by Fresnel's equations."""
    below = part.points_m[:, 1] > -mirror.height_m
    points = part.points_m[below] * [1, -1, 1] - [0, 2 * mirror.height_m, 0]
    distance = np.linalg.norm(points, axis=1)
    share = _reflected(np.abs(points[:, 1]) / distance)
    intensity = part.intensity[below]
    if normal is not None:
        intensity = _beam(points, normal * [1, -1, 1], scene.lights.beam_exponent)
    rng = random_stream(scene, "mirror")
    # A tilt of the surface turns the ray by twice the angle, mostly up and down at grazing incidence.
    tilt = np.radians(2 * mirror.ripple_deg) * distance[:, None] / 2
    jitter = rng.normal(size=(len(points), _GLINTS, 3)) * [0.3, 1.0, 0.0] * tilt[:, :, None]
    return Emitters(
        points_m=(points[:, None] + jitter).reshape(-1, 3),
        levels=np.repeat(part.levels[below] * share / _GLINTS, _GLINTS),
        intensity=np.repeat(intensity, _GLINTS),
        radii_m=np.repeat(part.radii_m[below], _GLINTS),
        colours=np.repeat(part.colours[below], _GLINTS, axis=0),
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
    focal = math.sqrt(scene.camera.fx * scene.camera.fy)
    variance_px = scene.sensor.blur_px**2 + (focal * emitters.radii_m / 2) ** 2
    distance2 = (emitters.points_m**2).sum(axis=1)
    return emitters.levels * emitters.intensity * 2 * math.pi * variance_px / distance2
