"""What came of an estimate of a dock that is there, as tests and benches count it."""

from dataclasses import dataclass

import numpy as np
from dockpose.estimate import Estimate
from dockpose.pose.circle import CirclePose
from dockpose.study.judge import HOLD_SIGMAS, nearest, signed_errors, verdicts

SURE = 0.95  # probability from which a pose, and with ``detection`` a dock, is given as right


@dataclass(frozen=True)
class Judgement:
    """What came of a picture that shows a dock: of the chosen pose, unless it says otherwise."""

    found: bool
    right: bool = False  # within ``RIGHT_SHARE`` of the range and ``RIGHT_DEG``
    either: bool = False  # whether it or the other one is right
    nearer: bool = False  # whether it is the nearer of the two in attitude
    near: bool = False  # whether its position alone is right
    holds: tuple[bool, ...] = ()  # whether 95 % intervals of x, y, z and both angles hold, all told, of the nearer one
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

    @property
    def outcome(self) -> str:
        """In a word: "refused", "right", "sure" and wrong, "undecided" while the other one is right, or "wrong"."""
        if not self.found or self.right:
            return "right" if self.right else "refused"
        return "sure" if self.sure else "undecided" if self.either else "wrong"


def judged(found: Estimate, position_m: np.ndarray, normal: np.ndarray) -> Judgement:
    """Judge an estimate by the dock's true position (3,) and normal (3,)."""
    chosen = found.selected
    if found.status != "ok" or chosen is None:
        return Judgement(found=False)
    best = nearest(found.candidates, normal)
    sigmas = np.array([*(best.sigma_total_position_m or [0.0] * 3), *(best.sigma_total_theta_rad or [0.0] * 2)])
    off = np.abs(signed_errors(best, position_m, normal)) * [1, 1, 1, *np.radians([1, 1])]
    of = verdicts(found, chosen, CirclePose(position_m, normal, np.zeros(2)))
    return Judgement(
        found=True,
        right=of["chosen_right"],
        either=of["either_right"],
        nearer=of["chosen_nearer"],
        near=of["position_right"],
        holds=tuple((off < HOLD_SIGMAS * sigmas).tolist()),
        probability=chosen.probability or 0.0,
        detection=found.detection or 0.0,
    )
