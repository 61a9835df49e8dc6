"""Regions of a picture that are not looked at: their pixels count neither in the histogram nor as lights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from pipeline.checks import check_number

# x_px, y_px of the upper left corner, width_px, height_px: (10, 20, 30, 5) hides columns 10 to 39 of rows 20 to 24.
Mask = tuple[float, float, float, float]
_PARTS = ("x_px", "y_px", "width_px", "height_px")


def check_masks(masks: Any) -> None:
    """Raise a ValueError that names the mask and the value unless each is four finite numbers with a positive size.

    A mask may reach beyond the picture or lie outside it.
    """
    for index, mask in enumerate(masks):
        if not isinstance(mask, Sequence) or isinstance(mask, str) or len(mask) != len(_PARTS):
            raise ValueError(f"masks[{index}] is {mask!r}; it must be four numbers: {', '.join(_PARTS)}")
        for name, value in zip(_PARTS, mask, strict=True):
            if name in ("width_px", "height_px"):
                check_number(f"masks[{index}] {name}", value, above=0)
            else:
                check_number(f"masks[{index}] {name}", value)


def hidden_pixels(shape: tuple[int, int], masks: Sequence[Mask]) -> np.ndarray:
    """Which pixels (H, W) bool of a picture of that shape have their centre in a mask."""
    hidden = np.zeros(shape, dtype=bool)
    for x, y, width, height in masks:
        hidden[_span(y, height, shape[0]), _span(x, width, shape[1])] = True
    return hidden


def hide(grey: np.ndarray, masks: Sequence[Mask]) -> tuple[np.ndarray, np.ndarray | None]:
    """Blacken what is masked.

    Parameters
    ----------
    grey : (H, W) uint8 or uint16 picture.
    masks : what to hide.

    Returns
    -------
    A blackened copy and which of its pixels count, (H, W) uint8 of 0 and 255; without masks the picture itself and
    None.
    """
    if not masks:
        return grey, None
    hidden = hidden_pixels(grey.shape, masks)
    blackened = grey.copy()
    blackened[hidden] = 0
    return blackened, np.where(hidden, 0, 255).astype(np.uint8)


def _span(start: float, length: float, size: int) -> slice:
    """Pixels of one axis whose centres, at whole numbers, lie within ``length`` from ``start`` on."""
    first, last = (math.ceil(min(max(edge, 0), size)) for edge in (start, start + length))
    return slice(first, last)
