"""Whether a camera's exposure suits the lights: neither cut off at the top of the scale nor lost in the noise."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Literal

import numpy as np
from dockpose.camera.image import significant_bits
from dockpose.estimate import Estimate
from dockpose.sources.frames import Frame

Verdict = Literal["saturated", "drowned", "dark", "good", "unknown"]

# At least this share of a light's core at the top of the scale. Of a Gaussian spot whose peak would be k times the top,
# ln k / ln 2k of what lies above half of its visible height is cut off; that is 1/2 for k = 2, twice what can be seen.
CUT_SHARE = 0.5
# A light that stands out of the water by less than this many times the noise. No estimate of the centre of a Gaussian
# spot of height A in noise n is exacter than sqrt(2 / pi) n / A pixels (the Cramer-Rao bound, whatever its width):
# 0.1 px for 8.
LEAST_CONTRAST = 8.0
_MANY = 0.5  # of the lights, that are worth a word
_TOP_SHARE = 250 / 255  # of the scale, from which on a pixel is saturated, as JPEG leaves it
_STRONGLY = 3.0  # times the top of the scale, where halving does not do
_DARK_SHARE = 0.45  # of the scale: as bright as lights may be for twice the exposure not to cut them off
_MUCH_CUT, _DARK_PICTURE = 0.05, 0.25  # shares of a picture and of the scale, where no dock was found
_LEAST_FOOT_PX, _LEAST_REACH_PX, _MOST_REACH_PX = 2, 4, 40  # around a light
_QUANTISED = 1 / math.sqrt(12)  # noise of rounding to whole levels
_EVERY, _AGREEING = 5, 4  # frames between two looks, and looks in a row that agree


@dataclass(frozen=True)
class ExposureHint:
    """What to do about the exposure."""

    verdict: Verdict  # the last two: nothing is to be done, and no ring of lights was found that would tell
    sentence: str = ""  # what is wrong and what to do


def exposure_hint(image: np.ndarray, found: Estimate) -> ExposureHint:
    """Judge the exposure of a picture (H, W) or (H, W, 3) by the lights found, in colour by the brightest channel."""
    scale = (1 << (8 * image.dtype.itemsize if found.status != "ok" else significant_bits(image))) - 1
    top = _TOP_SHARE * scale
    if found.status != "ok" or found.ring is None or found.markers is None:
        return _without_dock(image, scale, top)
    looks = [_look(image, box, top) for box in found.markers.boxes_px[found.ring.on_ring]]
    cut_shares, contrasts, peaks = np.array(looks).T
    count, cut = len(looks), cut_shares[cut_shares >= CUT_SHARE]
    if len(cut) >= _MANY * count:
        share = float(np.median(cut))
        is_strong = share >= math.log(_STRONGLY) / math.log(2 * _STRONGLY)
        what = "take a quarter of the exposure" if is_strong else "halve the exposure"
        return ExposureHint("saturated", f"{len(cut)} of {count} lights are saturated: {what}.")
    lost = contrasts[contrasts < LEAST_CONTRAST]
    if len(lost) >= _MANY * count:
        longer = "double the exposure, or have brighter lamps"
        is_dark = peaks.max() < _DARK_SHARE * top / _TOP_SHARE
        what = longer if is_dark else "have brighter lamps, or less light on the water"
        where = f"{len(lost)} of {count} lights hardly stand out of the water, by {np.median(lost):.0f} times its noise"
        return ExposureHint("drowned", f"{where}: {what}.")
    return ExposureHint("good")


def _without_dock(image: np.ndarray, scale: int, top: float) -> ExposureHint:
    cut_share = np.count_nonzero(image >= top) / image.size
    if cut_share >= _MUCH_CUT:
        return ExposureHint("saturated", f"{100 * cut_share:.0f} % of the picture is saturated: halve the exposure.")
    brightest = int(image.max())
    if image.dtype == np.uint8 and brightest < _DARK_PICTURE * scale:
        longer = "if the dock is in view, double the exposure"
        return ExposureHint("dark", f"The picture is dark, its brightest level {brightest} of {scale}: {longer}.")
    return ExposureHint("unknown")


class ExposureWatch:
    """Judges the exposure over the frames of a live source; says the same only once."""

    def __init__(self) -> None:
        self._looks: deque[ExposureHint] = deque(maxlen=_AGREEING)
        self._frames = 0
        self._said: set[Verdict] = set()
        self.hint = ExposureHint("unknown")  # of the latest frames

    def see(self, frame: Frame, found: Estimate) -> str:
        """Look at a frame now and then; return a sentence where there is something new to say, else nothing."""
        self._frames += 1
        if self._frames % _EVERY != 1:
            return ""
        hint = exposure_hint(frame.picture(), found)
        if hint.verdict == "unknown":  # as while the dock is out of sight, which says nothing about the exposure
            return ""
        self._looks.append(hint)
        if len(self._looks) < _AGREEING or len({look.verdict for look in self._looks}) > 1:
            return ""
        self.hint = hint
        if not hint.sentence or hint.verdict in self._said:
            return ""
        self._said.add(hint.verdict)
        return hint.sentence


def _look(image: np.ndarray, box: np.ndarray, top: float) -> tuple[float, float, float]:
    """Share of a light's core at the top of the scale, its height above the water in times its noise, and its peak."""
    left, upper, right, lower = (int(side) for side in box)
    half = (max(right - left, lower - upper) + 2) // 2
    reach = min(max(_LEAST_REACH_PX, half), _MOST_REACH_PX)
    foot = min(max(_LEAST_FOOT_PX, half // 2), _MOST_REACH_PX)  # the box is that of the light's brightest part

    def part(by: int) -> np.ndarray:
        pixels = image[max(0, upper - by) : lower + by + 1, max(0, left - by) : right + by + 1]
        return (pixels if pixels.ndim == 2 else pixels.max(axis=2)).astype(np.float32)

    levels, core = part(reach), part(foot)
    edge = np.concatenate([levels[0], levels[-1], levels[:, 0], levels[:, -1]])
    water, peak = float(np.median(edge)), float(core.max())
    core = core[core >= (water + peak) / 2]
    # The brightest of the few pixels that share the top is so by about one deviation of the noise.
    contrast = (peak - water) / _noise(levels, (water + peak) / 2) - 1
    return float(np.mean(core >= top)), contrast, peak


def _noise(levels: np.ndarray, below: float) -> float:
    """Standard deviation of the water's levels, which slope but do not bend: from second differences along the rows."""
    bends = np.abs(levels[:, :-2] - 2 * levels[:, 1:-1] + levels[:, 2:])
    is_water = np.maximum(np.maximum(levels[:, :-2], levels[:, 1:-1]), levels[:, 2:]) < below
    bends = bends[is_water]
    # The median of absolute values of a Gaussian is 0.67 of its deviation, and that of such a difference sqrt(6) n. A
    # light's foot bends strongly, which a median bears; of whole levels it is coarse, so that the mean of the lower
    # three quarters is taken.
    if len(bends) == 0:
        return _QUANTISED
    bends = np.sort(bends)[: max(1, round(0.75 * len(bends)))]
    return max(float(bends.mean()) / (_LOWER_MEAN * math.sqrt(6)), _QUANTISED)


# Mean of the lower three quarters of a Gaussian's absolute values, in deviations: with q its upper quartile's bound,
# sqrt(2 / pi) (1 - exp(-q^2 / 2)) / 0.75.
_BOUND = 1.1503
_LOWER_MEAN = math.sqrt(2 / math.pi) * (1 - math.exp(-(_BOUND**2) / 2)) / 0.75
