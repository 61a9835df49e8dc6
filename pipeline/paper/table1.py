"""Table 1 of the paper: the choice between the two poses by the ring's eccentricity over two frames.

Ghosh et al. 2016 call it orientation duality. The vehicle squares up to the dock as seen in one of the two candidates.
If that one is right, the ring's image becomes rounder from the first frame to the second.
"""

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
    """Choose one of two candidates as Table 1 of the paper does.

    In the second frame, if the eccentricity fell (e1 - e2 > 0), the orientation that was squared up to was right;
    otherwise the other one is taken. From the third frame on, the candidate nearest to the previous choice is taken.
    The printed condition of the else branch is a difference of a quantity with itself, which is always 0; it is read
    here as frame 1 against frame 2, so that the else branch is the complement of the first. The paper does not say
    which candidate of the second frame is the one that was squared up to; here it is the nearest. Nothing corrects a
    choice after the second frame.
    """
    if before is None:
        return _oriented(candidates, first, eccentricity, 1)
    selected = max(range(len(candidates)), key=lambda k: float(candidates[k].normal @ before.normal))
    if before.frame == 1 and not before.eccentricity - eccentricity > 0:
        selected = len(candidates) - 1 - selected
    return _oriented(candidates, selected, eccentricity, before.frame + 1)


def choose_by_theta_x(
    candidates: Sequence[CirclePose], eccentricity: float, before: Orientation | None = None, first: int = 0
) -> Orientation:
    """Choose one of two candidates by the letter of Table 1 of the paper.

    Printed is: of the two solutions of frame 1 the chosen one is kept unless e1 < e2, in which case the other one is
    taken; the solution of frame 2 is the one whose theta_x is nearest to it; and so on with each further frame. Read by
    the letter this differs from :func:`choose_by_eccentricity` in three ways. Only theta_x is compared, so that two
    candidates that differ in theta_y alone are the same. Where the eccentricity did not change at all, the first
    choice is kept. And the angles that frame 2 is compared with are those of frame 1, although the vehicle has turned
    in between. The condition of the else branch is printed as the difference of a quantity with itself; it is read here
    as e1 - e2 < 0, without which the other solution would never be taken.
    """
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
