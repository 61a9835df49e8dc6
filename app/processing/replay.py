"""Estimating a stored result again, and finding which of its numbers differ."""

import math
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.processing.analysis import nearest_pose, select_pose

ROUNDING = 1e-11  # relative, and absolute below 1
_FROM_OUTSIDE = ("hand", "tracking")  # choices that a picture alone does not determine
_COMPARED = ("status", "image", "threshold", "markers", "ellipse", "candidates", "selected", "selected_by")


def estimate_again(image: np.ndarray, line: dict[str, Any]) -> Estimate:
    """Estimate as a line of schema 1 says, with its choice by hand or track. ValueError names what it lacks."""
    parts = {}
    for name, kind in (("camera", Camera), ("dock", Dock), ("settings", Settings)):
        try:
            parts[name] = msgspec.convert(line[name], kind)
        except KeyError as error:
            raise ValueError(f"has no {name}") from error
        except msgspec.ValidationError as error:
            raise ValueError(f"{name}: {error}") from error
    found = estimate(image, **parts)
    chosen_by = line.get("selected_by")
    if chosen_by not in _FROM_OUTSIDE:
        return found
    try:
        x, y, z = line["candidates"][line["selected"]]["normal"]
        index = nearest_pose(found, (float(x), float(y), float(z)))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ValueError(f"says that a pose was chosen by {chosen_by}, but not which") from error
    return select_pose(found, index, chosen_by)


def differences(line: dict[str, Any], found: Estimate) -> list[tuple[str, Any, Any]]:
    """Name, stored and new value of what differs by more than rounding; of lists of different length, the lengths."""
    new = msgspec.json.decode(msgspec.json.encode(found.to_dict()))
    return [entry for name in _COMPARED if name in line for entry in _different(name, line[name], new.get(name))]


def _different(name: str, stored: Any, new: Any) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(stored, dict) and isinstance(new, dict):
        for key in stored:
            yield from _different(f"{name}.{key}", stored[key], new.get(key))
    elif isinstance(stored, list) and isinstance(new, list):
        if len(stored) != len(new):
            yield f"number of {name}", len(stored), len(new)
            return
        for index, (one, other) in enumerate(zip(stored, new, strict=True)):
            yield from _different(f"{name}[{index}]", one, other)
    elif stored != new and not (isinstance(stored, float) and isinstance(new, float) and _is_rounding(stored, new)):
        yield name, stored, new


def _is_rounding(stored: float, new: float) -> bool:
    return math.isclose(stored, new, rel_tol=ROUNDING, abs_tol=ROUNDING)
