"""Tone curves: from the grey levels that a camera stores to the light that fell on its sensor, and back."""

from functools import lru_cache

import numpy as np
from dockpose.checks import check_number
from dockpose.text import shown

TONES = ("linear", "srgb")
_LIGHT = 65535  # what white is in linear light
# IEC 61966-2-1: linear up to a level, a power beyond.
_SRGB_KNEE, _SRGB_SLOPE, _SRGB_OFFSET, _SRGB_POWER = 0.04045, 12.92, 0.055, 2.4
_LEAST_GAMMA, _MOST_GAMMA = 0.2, 5.0


def check_tone(tone: str | float) -> None:
    """Raise ValueError unless a tone curve is "linear", "srgb" or the exponent of a power."""
    if isinstance(tone, str):
        if tone not in TONES:
            raise ValueError(f"tone is {shown(tone)}; it must be linear, srgb or a gamma such as 2.2")
    else:
        check_number("tone", tone, least=_LEAST_GAMMA)
        if tone > _MOST_GAMMA:
            raise ValueError(f"tone is {shown(tone)}; it must be at most {_MOST_GAMMA:g}")


def decoded(levels: np.ndarray, tone: str | float) -> np.ndarray:
    """Light, 1 for white, of grey levels from 0 to 1."""
    if tone == "linear":
        return levels
    if tone == "srgb":
        power = ((levels + _SRGB_OFFSET) / (1 + _SRGB_OFFSET)) ** _SRGB_POWER
        return np.where(levels <= _SRGB_KNEE, levels / _SRGB_SLOPE, power)
    return levels ** float(tone)


def encoded(light: np.ndarray, tone: str | float) -> np.ndarray:
    """Grey levels from 0 to 1 as a camera stores them, of light, 1 for white; all that is brighter is white."""
    if tone == "linear":
        return light
    light = np.clip(light, 0, 1)
    if tone == "srgb":
        power = (1 + _SRGB_OFFSET) * light ** (1 / _SRGB_POWER) - _SRGB_OFFSET
        return np.where(light <= _SRGB_KNEE / _SRGB_SLOPE, _SRGB_SLOPE * light, power)
    return light ** (1 / float(tone))


def linear(grey: np.ndarray, native_step: int, tone: str | float) -> np.ndarray:
    """A grey picture (H, W) in linear light, uint16; as it is where its levels are that already."""
    return grey if tone == "linear" else _table(native_step, tone)[grey]


def linear_level(level: int, native_step: int, tone: str | float) -> float:
    """One of 256 levels, as it is in what ``linear`` gives."""
    native = level * native_step
    return float(native if tone == "linear" else _table(native_step, tone)[native])


@lru_cache(maxsize=8)
def _table(native_step: int, tone: str | float) -> np.ndarray:
    """Light (256 native_step,) of each native grey level."""
    levels = np.arange(256 * native_step) / (256 * native_step - 1)
    return np.rint(_LIGHT * decoded(levels, tone)).astype(np.uint16)
