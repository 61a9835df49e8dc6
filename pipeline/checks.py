"""Argument checks: each raises a ValueError that names the argument and its value."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def check_number(name: str, value: Any, *, above: float = -math.inf) -> None:
    """Raise a ValueError that names the argument unless ``value`` is a finite number above ``above``."""
    is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or not value > above:
        wanted = "a finite number" if above == -math.inf else f"a finite number above {above:g}"
        raise ValueError(f"{name} is {value!r}; it must be {wanted}")


def check_whole(name: str, value: Any, *, least: int) -> None:
    """Raise a ValueError that names the argument unless ``value`` is a whole number, at least ``least``."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
        raise ValueError(f"{name} is {value!r}; it must be a whole number of at least {least}")


def as_points(name: str, points: Any, columns: int) -> np.ndarray:
    """Return ``points`` as a float array of shape (N, columns), or raise a ValueError that names it."""
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name} has shape {array.shape}; it must be (N, {columns})")
    return array
