"""The colour of each light in a colour picture, although water absorbs red before blue."""

import numpy as np

_BANDS = ("blue", "green", "red")
_CAST = 3.0  # a light is coloured if one band exceeds both others by this factor, relative to a white light
_FAINT = 0.25  # of a white light: the least that a coloured one shows in its own band
_LEAST_SIGNAL = 8.0  # of 255: the colour of a light dimmer than this in every band is unknown
_LEAST_BAND = 3.0  # of 255: a band in which the lights are dimmer than this was absorbed by the water
_RIM_PX = 3  # margin around a light that takes in its flanks and some water


def tell_colours(image: np.ndarray, points_px: np.ndarray, areas_px: np.ndarray) -> list[str | None]:
    """Name the colour of each light (N, 2) of a picture (H, W, 3); None where unknown."""
    labels: list[str | None] = [None] * len(points_px)
    if image.ndim != 3 or image.shape[2] < 3 or not labels:
        return labels
    scale = 255 / np.iinfo(image.dtype).max
    bands = np.array([scale * _light_of(image, point, area) for point, area in zip(points_px, areas_px, strict=True)])
    lit = bands.max(axis=1) > _LEAST_SIGNAL
    if not lit.any():
        return labels
    balance = np.median(bands[lit], axis=0)
    for index in np.flatnonzero(lit):
        labels[int(index)] = _name(bands[index], balance)
    return labels


def _light_of(image: np.ndarray, point_px: np.ndarray, area_px: int) -> np.ndarray:
    """Mean light (3,), blue, green and red, of a group above the water around it."""
    half = int(np.ceil(np.sqrt(area_px / np.pi))) + _RIM_PX
    x, y = np.rint(point_px).astype(int)
    y0, x0 = max(0, y - half), max(0, x - half)
    window = image[y0 : y + half + 1, x0 : x + half + 1, :3].astype(float)
    if window.size == 0:
        return np.zeros(3)
    edge = np.concatenate([window[0], window[-1], window[:, 0], window[:, -1]])
    above = window - np.median(edge, axis=0)
    bright = above.max(axis=2)
    core = bright >= 0.25 * bright.max()
    return above[core].mean(axis=0)


def _name(light: np.ndarray, balance: np.ndarray) -> str | None:
    """Colour name of a light with bands (3,), compared with a white one, whose bands are ``balance``."""
    bands = {
        name: max(0.0, float(value)) / float(white)
        for name, value, white in zip(_BANDS, light, balance, strict=True)
        if white >= _LEAST_BAND
    }
    if len(bands) < 2:
        return None
    brightest = max(bands, key=lambda name: bands[name])
    rest = [value for name, value in bands.items() if name != brightest]
    if bands[brightest] < _FAINT:
        return None
    if bands[brightest] >= _CAST * max(rest):
        return brightest
    return "white" if min(rest) > bands[brightest] / _CAST else None
