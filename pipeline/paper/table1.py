"""Table 1 of the paper: the choice between the two poses by the ring's eccentricity over two frames."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.pose.circle import CirclePose


@dataclass(frozen=True)
class Orientation:
    """What Table 1 remembers of a frame: its choice, with the normals (3,) of both candidates."""

    selected: int  # index of the chosen candidate
    normal: np.ndarray
    other_normal: np.ndarray
    eccentricity: float  # of the ring's image
    frame: int  # counted from 1


def choose_by_eccentricity(
    candidates: Sequence[CirclePose], eccentricity: float, before: Orientation | None = None, first: int = 0
) -> Orientation:
    """Choose one of two candidates as Table 1 of the paper does; docs/paper.md says how its slip in print is read."""
    if before is None:
        return _oriented(candidates, first, eccentricity, 1)
    selected = max(range(len(candidates)), key=lambda k: float(candidates[k].normal @ before.normal))
    if before.frame == 1 and not before.eccentricity - eccentricity > 0:
        selected = len(candidates) - 1 - selected
    return _oriented(candidates, selected, eccentricity, before.frame + 1)


def choose_by_theta_x(
    candidates: Sequence[CirclePose], eccentricity: float, before: Orientation | None = None, first: int = 0
) -> Orientation:
    """Choose one of two candidates by the letter of Table 1: by theta_x alone, against the frame before."""
    if before is None:
        return _oriented(candidates, first, eccentricity, 1)
    normal = before.normal
    if before.frame == 1 and before.eccentricity < eccentricity:
        normal = before.other_normal
    theta_x = math.asin(max(-1.0, min(1.0, float(normal[1]))))
    selected = min(range(len(candidates)), key=lambda k: abs(candidates[k].theta_x_rad - theta_x))
    return _oriented(candidates, selected, eccentricity, before.frame + 1)


def _oriented(candidates: Sequence[CirclePose], selected: int, eccentricity: float, frame: int) -> Orientation:
    other = candidates[len(candidates) - 1 - selected].normal
    return Orientation(selected, candidates[selected].normal, other, eccentricity, frame)
