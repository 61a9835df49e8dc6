"""The choice between the two poses as Table 1 of the paper prints it: by the ring's eccentricity over two frames.

Ghosh et al. 2016 call it orientation duality. The vehicle squares up to the dock as one of the two candidates has it.
If that one is right, the ring's picture becomes rounder from the first frame to the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.pose.circle import CirclePose


@dataclass(frozen=True)
class Orientation:
    """What Table 1 keeps of a frame.

    Attributes
    ----------
    selected : index of the chosen candidate.
    normal : (3,) of the chosen candidate.
    eccentricity : of the ring's picture.
    frame : counted from 1.
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
    candidates : the two poses of this frame.
    eccentricity : of the ring's picture in this frame.
    before : what was chosen in the frame before; None in the first frame.
    first : index of the candidate to square up to in the first frame; the paper takes either.

    Returns
    -------
    The choice; hand it in with the next frame. Between the first frame and the second the vehicle must square up to
    ``normal``, or what the second decides means nothing.

    Notes
    -----
    In the second frame, if the eccentricity fell (e1 - e2 > 0), the orientation that was squared up to was right;
    otherwise the other one is taken. From the third frame on, the candidate nearest to the choice before. The printed
    condition of the else branch holds a difference of a thing with itself, which is never other than 0; as in DESIGN.md
    it is read as frame 1 against frame 2, so that the else branch is all that the first branch is not. Which candidate
    of the second frame is the one that was squared up to, is not said; here it is the nearest. Nothing corrects a
    choice after the second frame.
    """
    if before is None:
        return Orientation(first, candidates[first].normal, eccentricity)
    selected = max(range(len(candidates)), key=lambda k: float(candidates[k].normal @ before.normal))
    if before.frame == 1 and not before.eccentricity - eccentricity > 0:
        selected = len(candidates) - 1 - selected
    return Orientation(selected, candidates[selected].normal, eccentricity, before.frame + 1)
