"""Pictures of one lamp through point spread functions, and their histograms (Figures 5 to 7)."""

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.simulate import Lights, Pose, Scene
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.psf import ANGLES, PointSpread, Psf
from dockpose.simulate.optics.water import Water
from dockpose.simulate.parts import Background, Lamp
from dockpose.simulate.render import expose
from dockpose.thresholds import LEVELS
from dockpose.thresholds.histogram import SMOOTHING

# The published example of Hou et al.: theta0 = 0.03, w0 = 0.87, c r = 5.5; with c = 1 / m that is 5.5 m.
HOU_WATER, HOU_THETA0_RAD, HOU_DISTANCE_M = Water(0.13, 0.87), 0.03, 5.5
BRIGHTEST = 220.0  # grey levels of the brightest pixel, below saturation
SIDE_PX, FOCAL_PX = 161, 700.0
LAMP_RADIUS_PX = 15.0  # so that the lamp's image is much wider than the lens blurs it
_PEAK_WIDTH = 10  # levels on either side of a peak that belong to it


@dataclass(frozen=True)
class LampPicture:
    """The picture of one lamp."""

    image: np.ndarray  # (H, W): as the camera stores it, with noise
    direct: np.ndarray  # (H, W): unscattered light in grey levels, without noise
    glow: np.ndarray  # (H, W): scattered light

    @property
    def counts(self) -> np.ndarray:
        """Pixels of each level (256,)."""
        return np.bincount(self.image.ravel(), minlength=LEVELS)

    @property
    def is_lamp(self) -> np.ndarray:
        """Pixels (H, W) that see the lamp itself: with at least half as much direct light as any."""
        return self.direct >= self.direct.max() / 2

    @property
    def counts_of_lamp(self) -> np.ndarray:
        """Pixels of each level (256,) among those that see the lamp itself."""
        return np.bincount(self.image[self.is_lamp], minlength=LEVELS)

    @property
    def peak(self) -> int:
        """Level of the highest peak in the upper half of the levels that the picture has, lightly smoothed."""
        smooth = np.convolve(self.counts, SMOOTHING, mode="same")
        half = int(self.image.max()) // 2
        return half + int(smooth[half:].argmax())

    @property
    def share_of_lamp_in_peak(self) -> float:
        """Which share of the pixels in the peak see the lamp itself."""
        near = np.abs(self.image.astype(int) - self.peak) <= _PEAK_WIDTH
        return float(self.is_lamp[near].mean())

    @property
    def prominence(self) -> float:
        """Pixels in the peak over those in as many levels just below it; infinite where there are none."""
        width = 2 * _PEAK_WIDTH + 1
        start = self.peak - _PEAK_WIDTH
        below = int(self.counts[max(0, start - width) : start].sum())
        return int(self.counts[start : start + width].sum()) / below if below else math.inf

    @property
    def share_of_direct(self) -> float:
        """Share of direct light in all light of the pixels that see the lamp itself."""
        direct = float(self.direct[self.is_lamp].sum())
        return direct / (direct + float(self.glow[self.is_lamp].sum()))


def lamp_scene(psf: Psf, water: Water, distance_m: float, seed: int, tilt_deg: float = 0.0) -> Scene:
    """One lamp on a small camera's axis, 15 pixels in radius at any distance; a tilt turns the glow and dims it."""
    level, radius_m = math.cos(math.radians(tilt_deg)), LAMP_RADIUS_PX / FOCAL_PX * distance_m
    if tilt_deg:
        psf = msgspec.structs.replace(psf, tilt_deg=tilt_deg, tilt_axis_deg=90.0)
    return Scene(
        camera=Camera(FOCAL_PX, FOCAL_PX, (SIDE_PX - 1) / 2, (SIDE_PX - 1) / 2, SIDE_PX, SIDE_PX),
        dock=Dock(0.30, 3),
        pose=Pose(position_m=(0.0, 0.0, distance_m)),
        lights=Lights(missing=(0, 1, 2)),
        lamps=(Lamp(position_m=(0.0, 0.0, distance_m), level=level, radius_m=radius_m),),
        water=water,
        psf=psf,
        background=Background(level=8.0),
        seed=seed,
    )


def lamp_pictures(scenes: list[Scene]) -> list[LampPicture]:
    """Expose pictures of :func:`lamp_scene` alike; the brightest pixel of the first gets ``BRIGHTEST`` grey levels."""
    light = list(map(light_of, scenes))
    scale = (BRIGHTEST - scenes[0].background.level) / float((light[0][0] + light[0][1]).max())
    return [_exposed(scene, scale * direct, scale * glow) for scene, (direct, glow) in zip(scenes, light, strict=True)]


def side_by_side(one: LampPicture, other: LampPicture, scene: Scene) -> LampPicture:
    """Put two pictures into one, and expose it anew."""
    direct, glow = np.hstack([one.direct, other.direct]), np.hstack([one.glow, other.glow])
    camera = msgspec.structs.replace(scene.camera, width=direct.shape[1])
    return _exposed(msgspec.structs.replace(scene, camera=camera), direct, glow)


@dataclass(frozen=True)
class TwoPeaks:
    """The peaks of two lamps in one histogram."""

    bright: int  # level that the most pixels of the brighter lamp have, lightly smoothed
    dim: int  # of the other one
    dip: float  # least number of pixels between them over that at the lower peak: 1 where they are one, 0 if apart


def two_peaks(both: LampPicture) -> TwoPeaks:
    """Find the peaks of the lamps of :func:`side_by_side`, the left one brighter."""
    wide = np.convolve(SMOOTHING, SMOOTHING)
    levels = []
    for half in (slice(0, SIDE_PX), slice(SIDE_PX, None)):
        direct = both.direct[:, half]
        counts = np.bincount(both.image[:, half][direct >= direct.max() / 2], minlength=LEVELS)
        levels.append(int(np.convolve(counts, wide, mode="same").argmax()))
    smooth = np.convolve(both.counts, wide, mode="same")
    low, high = sorted(levels)
    dip = smooth[low : high + 1].min() / min(smooth[low], smooth[high])
    return TwoPeaks(levels[0], levels[1], float(dip))


def _exposed(scene: Scene, direct: np.ndarray, glow: np.ndarray) -> LampPicture:
    light = (scene.background.level + direct + glow).astype(np.float32)
    return LampPicture(expose(light, scene), direct, glow)


def glow_within(spread: PointSpread, angle_rad: float) -> float:
    """Share of the glow that arrives within an angle of the lamp: 2 pi int PSF theta dtheta, in the small angles."""
    inside = angle_rad >= ANGLES
    ring = 2 * math.pi * spread.glow_per_sr * ANGLES**2  # d(theta) = theta d(ln theta)
    return float(np.trapezoid(ring[inside], np.log(ANGLES[inside])) / np.trapezoid(ring, np.log(ANGLES)))


def lopsidedness(picture: LampPicture, offset_px: int) -> tuple[float, float]:
    """How far from symmetric the glow is at an offset from the lamp; 1 and 1 where it is symmetric."""
    middle = SIDE_PX // 2
    left, right = picture.glow[middle, [middle - offset_px, middle + offset_px]].tolist()
    above, below = picture.glow[[middle - offset_px, middle + offset_px], middle].tolist()
    return left / right, (left + right) / (above + below)
