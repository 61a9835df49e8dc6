"""A stored result estimated again, and which of its numbers differ."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from app.reading import chosen_by_hand
from pipeline import Camera, Dock, Estimate, Settings, estimate

_COMPARED = ("status", "image", "threshold", "markers", "ellipse", "candidates", "selected", "selected_by")


def estimate_again(image: np.ndarray, line: dict[str, Any]) -> Estimate:
    """Estimate a picture with the camera, dock and settings of a JSON object of schema 1.

    What was chosen by hand is so again. Raises ValueError that names what the object lacks or holds wrongly.
    """
    parts = {}
    for name, kind in (("camera", Camera), ("dock", Dock), ("settings", Settings)):
        try:
            parts[name] = msgspec.convert(line[name], kind)
        except KeyError as error:
            raise ValueError(f"has no {name}") from error
        except msgspec.ValidationError as error:
            raise ValueError(f"{name}: {error}") from error
    found = estimate(image, **parts)
    if line.get("selected_by") != "hand":
        return found
    try:
        x, y, z = line["candidates"][line["selected"]]["normal"]
        return chosen_by_hand(found, (float(x), float(y), float(z)))
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ValueError("says that a pose was chosen by hand, but not which") from error


def differences(line: dict[str, Any], found: Estimate) -> list[tuple[str, Any, Any]]:
    """Name, stored value and new value of every number that is not the same to the last bit.

    Of lists that have another length only that is told. What the stored object does not know is not compared.
    """
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
    elif stored != new:
        yield name, stored, new
