"""Table 1 of the paper: the choice between the two poses by the ring's eccentricity over two frames.

Ghosh et al. 2016 call it orientation duality. The vehicle squares up to the dock as seen in one of the two candidates.
If that one is right, the ring's image becomes rounder from the first frame to the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.pose.circle import CirclePose


@dataclass(frozen=True)
class Orientation:
    """What Table 1 remembers of a frame.

    Attributes
    ----------
    selected : int
        Index of the chosen candidate.
    normal : (3,) float array
        Normal of the chosen candidate.
    eccentricity : float
        Eccentricity of the ring's image.
    frame : int
        Counted from 1.
    """

    selected: int
    normal: np.ndarray
    eccentricity: float
    frame: int = 1


def choose_by_eccentricity(
    candidates: Sequence[CirclePose], eccentricity: float, before: Orientation | None = None, first: int = 0
) -> Orientation:
    """Choose one of two candidates as Table 1 of the paper does.

    Parameters
    ----------
    candidates : sequence of CirclePose
        The two poses of this frame.
    eccentricity : float
        Eccentricity of the ring's image in this frame.
    before : Orientation, optional
        The choice of the previous frame; None in the first frame.
    first : int
        Index of the candidate to square up to in the first frame; the paper takes either.

    Returns
    -------
    Orientation
        The choice; pass it in with the next frame. Between the first and the second frame the vehicle must square up to
        its ``normal``, or the second frame's decision is meaningless.

    Notes
    -----
    In the second frame, if the eccentricity fell (e1 - e2 > 0), the orientation that was squared up to was right;
    otherwise the other one is taken. From the third frame on, the candidate nearest to the previous choice is taken.
    The printed condition of the else branch is a difference of a quantity with itself, which is always 0; it is read
    here as frame 1 against frame 2, so that the else branch is the complement of the first. The paper does not say
    which candidate of the second frame is the one that was squared up to; here it is the nearest. Nothing corrects a
    choice after the second frame.
    """
    if before is None:
        return Orientation(first, candidates[first].normal, eccentricity)
    selected = max(range(len(candidates)), key=lambda k: float(candidates[k].normal @ before.normal))
    if before.frame == 1 and not before.eccentricity - eccentricity > 0:
        selected = len(candidates) - 1 - selected
    return Orientation(selected, candidates[selected].normal, eccentricity, before.frame + 1)
