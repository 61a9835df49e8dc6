"""The one judgement of an estimated pose: that which was chosen, against the truth."""

from dataclasses import dataclass

import numpy as np
from dockpose import Estimate
from dockpose.pose.circle import CirclePose
from dockpose.study.judge import HOLD_SIGMAS, is_right, nearest, signed_errors

SURE = 0.95


@dataclass(frozen=True)
class Judgement:
    """What came of a picture that shows a dock."""

    found: bool
    right: bool = False  # the chosen pose, within 5 % of the range and 5 degrees
    either: bool = False  # or the other one
    nearer: bool = False  # whether the chosen one is the nearer of the two
    holds: tuple[bool, ...] = ()  # whether 95 % intervals of x, y, z and both angles hold, of the nearer one
    probability: float = 0.0
    detection: float = 0.0

    @property
    def undecided(self) -> bool:
        """Whether the two poses are left open."""
        return self.found and self.probability < SURE

    @property
    def sure(self) -> bool:
        """Whether it is given as right with 95 %."""
        return self.found and self.probability * self.detection >= SURE


def judge(found: Estimate, position_m: np.ndarray, normal: np.ndarray) -> Judgement:
    """Judge an estimate by the dock's true place (3,) and normal (3,)."""
    chosen, truth = found.selected, CirclePose(position_m, normal, np.zeros(2))
    if found.status != "ok" or chosen is None:
        return Judgement(found=False)
    best = nearest(found.candidates, normal)
    off, sigmas = np.abs(signed_errors(best, position_m, normal)), np.full(5, np.inf)
    if best.sigma_total_position_m is not None and best.sigma_total_theta_rad is not None:
        sigmas = np.array([*best.sigma_total_position_m, *np.degrees(best.sigma_total_theta_rad)])
    return Judgement(
        found=True,
        right=is_right(chosen, truth),
        either=any(is_right(pose, truth) for pose in found.candidates),
        nearer=best is chosen,
        holds=tuple((off < HOLD_SIGMAS * sigmas).tolist()),
        probability=chosen.probability or 0.0,
        detection=found.detection or 0.0,
    )
