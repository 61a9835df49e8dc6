"""Argument checks: each raises a ValueError that names the argument and its value."""

import math
import re
from collections.abc import Collection
from functools import lru_cache
from typing import Any, TypeVar

import msgspec
import numpy as np
from dockpose.text import shown

T = TypeVar("T")
# What no camera, dock, tank or picture exceeds, by what a name ends with; beyond, numbers would overflow somewhere.
_MOST = (
    *(("_per_m", 1e4), ("_m_per_s", 1e3), ("_deg_per_s", 1e4), ("_cutoff_deg", 90.0), ("_deg", 1e5), ("_rad", 1e4)),
    *(("_hz", 1e5), ("_s", 1e8), ("_px", 1e6), ("_gap_m", 100.0), ("glass_m", 10.0), ("_m", 1e5), ("_index", 10.0)),
    *(("diameter", 1e4), ("fx", 1e8), ("fy", 1e8), ("cx", 1e8), ("cy", 1e8), ("distortion", 1e6)),
    *(("width", 1e6), ("height", 1e6), ("count", 1e5), ("frames", 1e8), ("lights", 1e3)),
)
# What no number of a camera or a tank exceeds or falls below, so that products stay finite.
_MOST_OF_ALL, _LEAST_ABOVE_0 = 1e15, 1e-9


def check_number(name: str, value: Any, *, above: float = -math.inf, least: float = -math.inf) -> None:
    """Raise a ValueError that names the argument unless ``value`` is finite, plausible, and in these limits."""
    try:
        is_finite = isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        is_finite = False
    if not is_finite or not value > above:
        wanted = "a finite number" if above == -math.inf else f"a finite number above {above:g}"
        raise ValueError(f"{name} is {shown(value)}; it must be {wanted}")
    if above == 0 and value < _LEAST_ABOVE_0:
        raise ValueError(f"{name} is {shown(value)}; it must be at least {_LEAST_ABOVE_0:g}")
    most = _most(name)
    if abs(value) > most:
        within = f"at most {most:g}" if above >= 0 else f"within -{most:g} to {most:g}"
        raise ValueError(f"{name} is {shown(value)}; it must be {within}")
    if value < least:
        raise ValueError(f"{name} is {shown(value)}; it must be at least {least:g}")


def make_plain(struct: msgspec.Struct) -> None:
    """Replace, in place, numpy's numbers and arrays among a struct's fields by Python's numbers and tuples."""
    for name in struct.__struct_fields__:
        value = getattr(struct, name)
        if isinstance(value, (np.generic, np.ndarray, list, tuple)):
            msgspec.structs.force_setattr(struct, name, _plain(value))


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (np.ndarray, list, tuple)):
        return tuple(map(_plain, value))
    return value


@lru_cache(maxsize=256)
def _most(name: str) -> float:
    """The largest plausible value of what has that name, such as "position_m x" or "distortion[2]"."""
    stem = re.sub(r"( [xyz]|\[\d+\])$", "", name)
    return next((most for end, most in _MOST if stem.endswith(end)), _MOST_OF_ALL)


def check_whole(name: str, value: Any, *, least: int) -> None:
    """Raise a ValueError that names the argument unless ``value`` is a whole number, at least ``least``."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < least:
        raise ValueError(f"{name} is {shown(value)}; it must be a whole number of at least {least}")
    if value > _most(name):
        raise ValueError(f"{name} is {shown(value)}; it must be at most {_most(name):g}")


def check_is(name: str, value: Any, kind: type[T]) -> T:
    """Return ``value``; raise a ValueError that names the argument unless it is of that class."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} is {shown(value)}; it must be a {kind.__name__}")
    return value


def check_one_of(name: str, value: Any, allowed: Collection[Any]) -> None:
    """Raise a ValueError that names the argument and what it may be, unless ``value`` is one of these."""
    if value not in allowed:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(map(str, allowed))}")


def check_turn(name: str, value: Any) -> int:
    """Return by how much a picture is turned clockwise: 0, 90, 180 or 270 degrees; ValueError for anything else."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value not in (0, 90, 180, 270):
        raise ValueError(f"{name} is {shown(value)}; it must be 0, 90, 180 or 270, clockwise")
    return int(value)


def as_points(name: str, points: Any, columns: int) -> np.ndarray:
    """Return ``points`` as a float array of shape (N, columns), or raise a ValueError that names it."""
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name} has shape {array.shape}; it must be (N, {columns})")
    return array
