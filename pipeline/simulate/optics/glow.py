"""The light of all lamps on the sensor: near them for each pixel, farther out in one convolution on a coarse grid."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose.simulate.emitters import Emitters, emitters_of, energy_of
from dockpose.simulate.optics.psf import ANGLES, FREQUENCIES, PointSpread, point_spread, spread_of
from dockpose.simulate.optics.water import Water
from dockpose.simulate.scene import Scene, random_stream, truth_of
from numpy.fft import fftfreq, irfft2, rfft2

COARSE = 4  # pixels of the picture per cell of the coarse grid
_NEAR_PX = 24.0  # within it a lamp's glow is computed for each pixel: farther out it is smooth over a coarse cell
_MARGIN = 4  # lamps up to 1 / this of the picture's size outside it still shine in
_PIXEL_VARIANCE = 1 / 12  # of the pixel's own square aperture
_DISTANCE_STEP = 0.3  # in log distance; the shape of the glow is interpolated in between
_MOST_DISTANCES = 6  # for time
_SMALL_ANGLE_RAD = 1e-4  # of the derivative
_LEAST_ANGLE_RAD = 1e-6  # a thousandth of a pixel


@dataclass(frozen=True)
class _Lamp:
    """One emitter on the sensor."""

    centre_px: np.ndarray
    energy: float
    distance_m: float
    angle_of_px: np.ndarray
    spread: PointSpread
    direct: np.ndarray
    glow: np.ndarray
    radius_px: float
    rad_per_px: float


def light_of(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Direct light (H, W) and glow (H, W) of all that shines in a scene, in grey levels."""
    return light_on_sensor(scene, emitters_of(scene, truth_of(scene)), scene.water)


def light_on_sensor(scene: Scene, emitters: Emitters, water: Water) -> tuple[np.ndarray, np.ndarray]:
    """Direct light (H, W) and glow (H, W) of all emitters, in grey levels."""
    shape = (scene.camera.height, scene.camera.width)
    direct, glow = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    lamps = _lamps(scene, emitters, water)
    if not lamps:
        return direct, glow
    near_px = max(_NEAR_PX, 3 * max(lamp.radius_px for lamp in lamps))
    distances = _distances(lamps)
    near_rad, tails = near_px * float(np.median([lamp.rad_per_px for lamp in lamps])), []
    for distance_m in distances.tolist():  # glow (n,) of unit share on ``ANGLES``, smoothed within ``near_px``
        spread = point_spread(scene.psf, water, distance_m, np.random.default_rng(scene.seed))
        # Of a share of 0, as of clear water, there is no glow at any angle.
        tails.append(_smooth_within(spread.glow_per_sr / (spread.glow_share or 1.0), near_rad))
    for lamp in lamps:
        weights = _weights(distances, lamp.distance_m)
        tail = sum(weight * lamp.spread.glow_share * tails[index] for index, weight in weights)
        _add_near(direct, glow, lamp, np.asarray(tail), near_px, scene)
    glow += _far(scene, lamps, distances, tails, shape)
    return direct, glow


def _lamps(scene: Scene, emitters: Emitters, water: Water) -> list[_Lamp]:
    centres = scene.camera.project(emitters.points_m)
    angles = _angle_of_px(scene, emitters.points_m, centres)
    rng = random_stream(scene, "psf")
    # The glow of lamps farther outside of the picture is negligible.
    size, lamps = np.array([scene.camera.width, scene.camera.height]), []
    near = np.all(np.abs(centres - size / 2) < size * (0.5 + 1 / _MARGIN), axis=1)
    for index, energy in enumerate(energy_of(scene, emitters)):
        distance_m = float(np.linalg.norm(emitters.points_m[index]))
        spread = point_spread(scene.psf, water, distance_m, rng)
        if not near[index]:
            continue
        rad_per_px = math.sqrt(abs(np.linalg.det(angles[index])))
        radius_rad = emitters.radii_m[index] / distance_m
        optics = _lens_and_lamp(rad_per_px * math.hypot(scene.sensor.blur_px, math.sqrt(_PIXEL_VARIANCE)), radius_rad)
        lamps.append(
            _Lamp(
                centre_px=centres[index],
                energy=float(energy),
                distance_m=distance_m,
                angle_of_px=angles[index],
                spread=spread,
                direct=spread_of(spread.direct_share * optics),
                glow=np.maximum(spread_of(spread.glow_transfer * optics), 0.0),
                radius_px=radius_rad / rad_per_px,
                rad_per_px=rad_per_px,
            )
        )
    return lamps


def _angle_of_px(scene: Scene, points_m: np.ndarray, centres_px: np.ndarray) -> np.ndarray:
    """For each point the matrix (2, 2) from pixels around its image to angles in radians, through lens and port."""
    unit = points_m / np.linalg.norm(points_m, axis=1, keepdims=True)
    right = np.column_stack([unit[:, 2], np.zeros(len(unit)), -unit[:, 0]])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    down = np.cross(unit, right)
    distance = np.linalg.norm(points_m, axis=1, keepdims=True)
    steps = [
        (scene.camera.project(points_m + _SMALL_ANGLE_RAD * distance * side) - centres_px) / _SMALL_ANGLE_RAD
        for side in (right, down)
    ]
    px_of_angle = np.stack(steps, axis=2)
    px_of_angle[~np.isfinite(px_of_angle).all(axis=(1, 2))] = np.eye(2)
    return np.linalg.inv(px_of_angle)


def _lens_and_lamp(blur_rad: float, radius_rad: float) -> np.ndarray:
    """Transfer function of the lens' Gaussian blur and the lamp's disc."""
    from scipy.special import j1

    lens = np.exp(-2 * (math.pi * blur_rad * FREQUENCIES) ** 2)
    x = 2 * math.pi * radius_rad * FREQUENCIES
    return lens * np.where(x > 1e-6, 2 * j1(x) / np.maximum(x, 1e-300), 1.0)


def _distances(lamps: list[_Lamp]) -> np.ndarray:
    """Distances at which the shape of the glow is computed, from the nearest lamp's to the farthest's."""
    lengths = [lamp.distance_m for lamp in lamps]
    near, far = min(lengths), max(lengths)
    count = min(_MOST_DISTANCES, 2 + int(math.log(far / near) / _DISTANCE_STEP))
    return np.geomspace(near, far, count) if far > near else np.array([near])


def _weights(distances: np.ndarray, distance_m: float) -> list[tuple[int, float]]:
    """Which of the distances represent a lamp, and the weight of each."""
    if len(distances) == 1:
        return [(0, 1.0)]
    place = float(np.interp(math.log(distance_m), np.log(distances), np.arange(len(distances))))
    index = min(int(place), len(distances) - 2)
    return [(index, 1 - (place - index)), (index + 1, place - index)]


def _smooth_within(glow: np.ndarray, near_rad: float) -> np.ndarray:
    """Continue the glow from ``near_rad`` inwards by a parabola, with continuous value and slope."""
    step = 1.02
    value, next_value = np.interp([near_rad, step * near_rad], ANGLES, glow)
    slope = (next_value - value) / ((step - 1) * near_rad)
    inside = value + slope * near_rad / 2 * ((ANGLES / near_rad) ** 2 - 1)
    return np.where(near_rad > ANGLES, inside, glow)


def _seen_rotated(scene: Scene, x_rad: np.ndarray, y_rad: np.ndarray) -> tuple[np.ndarray, float]:
    """Angles on a glow rotated about an axis in the picture, and how much brighter it is (the paper's Figure 7)."""
    tilt, axis = math.radians(scene.psf.tilt_deg), math.radians(scene.psf.tilt_axis_deg)
    along = x_rad * math.cos(axis) + y_rad * math.sin(axis)
    across = -x_rad * math.sin(axis) + y_rad * math.cos(axis)
    depth = np.maximum(math.cos(tilt) - across * math.sin(tilt), 0.05)
    return np.hypot(along * math.cos(tilt) / depth, across / depth), 1 / math.cos(tilt)


def _add_near(
    direct: np.ndarray, glow: np.ndarray, lamp: _Lamp, tail: np.ndarray, near_px: float, scene: Scene
) -> None:
    """Add a lamp's direct light, and the part of its glow that the coarse grid lacks, around its image."""
    reach = math.ceil(1.3 * near_px)
    column, row = np.rint(lamp.centre_px).astype(int)
    height, width = direct.shape
    rows = np.arange(max(0, row - reach), min(height, row + reach + 1))
    columns = np.arange(max(0, column - reach), min(width, column + reach + 1))
    window = np.ix_(rows, columns)
    dx, dy = np.meshgrid(columns - lamp.centre_px[0], rows - lamp.centre_px[1])
    x_rad = lamp.angle_of_px[0, 0] * dx + lamp.angle_of_px[0, 1] * dy
    y_rad = lamp.angle_of_px[1, 0] * dx + lamp.angle_of_px[1, 1] * dy
    scale = lamp.energy * lamp.rad_per_px**2
    direct[window] += scale * _at(lamp.direct, np.hypot(x_rad, y_rad))
    rotated, brighter = _seen_rotated(scene, x_rad, y_rad)
    inside = rotated < near_px * lamp.rad_per_px
    glow[window] += np.where(inside, scale * brighter * _at(lamp.glow - tail, rotated), 0)


def _at(values: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Interpolate values on ``ANGLES`` at other angles; the first few, where the transform starts, are left out."""
    place = (np.log(np.maximum(angles_rad, _LEAST_ANGLE_RAD)) - math.log(ANGLES[0])) / math.log(ANGLES[1] / ANGLES[0])
    index = np.minimum(place.astype(np.intp), len(ANGLES) - 2)
    share = place - index
    return values[index] * (1 - share) + values[index + 1] * share


def _far(
    scene: Scene, lamps: list[_Lamp], distances: np.ndarray, tails: list[np.ndarray], shape: tuple[int, int]
) -> np.ndarray:
    """The smooth part of all glow together, convolved on the coarse grid."""
    height, width = (math.ceil(size / COARSE) for size in shape)
    margin_y, margin_x = height // _MARGIN + 1, width // _MARGIN + 1
    # Wrap-around is harmless as long as no offset between a lamp and a pixel exceeds half the grid.
    size = (_fast_length(2 * (height + margin_y)), _fast_length(2 * (width + margin_x)))
    angle_of_px = np.median([lamp.angle_of_px for lamp in lamps], axis=0)
    y, x = np.meshgrid(*(COARSE * count * fftfreq(count) for count in size), indexing="ij")
    x_rad = angle_of_px[0, 0] * x + angle_of_px[0, 1] * y
    y_rad = angle_of_px[1, 0] * x + angle_of_px[1, 1] * y
    rotated, brighter = _seen_rotated(scene, x_rad, y_rad)
    coarse = np.zeros((height, width))
    for index, tail in enumerate(tails):
        places = np.zeros(size)
        for lamp in lamps:
            weight = dict(_weights(distances, lamp.distance_m)).get(index, 0.0)
            _place(places, lamp, weight, (margin_x, margin_y), (width, height))
        if places.any() and tail.any():
            spectrum = rfft2(places) * rfft2(brighter * _at(tail, rotated))  # with a lamp in the first corner
            coarse += irfft2(spectrum, size)[margin_y : margin_y + height, margin_x : margin_x + width]
    smooth = cv2.resize(coarse.astype(np.float32), (width * COARSE, height * COARSE), interpolation=cv2.INTER_CUBIC)
    return np.maximum(smooth[: shape[0], : shape[1]], 0)


def _fast_length(least: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(least, real=True))  # pyright: ignore[reportArgumentType] (its stub says None)


def _place(places: np.ndarray, lamp: _Lamp, weight: float, margin: tuple[int, int], picture: tuple[int, int]) -> None:
    """Put a lamp's glow on the coarse grid, shared among four neighbours so that its centroid is exact."""
    x, y = (lamp.centre_px - (COARSE - 1) / 2) / COARSE + margin
    column, row = math.floor(x), math.floor(y)
    if not (0 <= row < picture[1] + 2 * margin[1] - 1 and 0 <= column < picture[0] + 2 * margin[0] - 1):
        return
    amount = weight * lamp.energy * lamp.spread.glow_share * lamp.rad_per_px**2
    shares = np.outer([1 - (y - row), y - row], [1 - (x - column), x - column])
    places[row : row + 2, column : column + 2] += amount * shares
