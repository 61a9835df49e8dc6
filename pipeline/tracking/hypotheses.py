"""The two hypotheses about which pose is right, and what a frame says about them: a hidden Markov model's step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from dockpose.estimate import Estimate
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.pose.circle import CirclePose
from dockpose.tracking.chain import Chain, Command, Speeds

# A frame says no more than this, as log-odds: a light that is taken for another one makes any frame surer than it is.
MOST_ODDS = 2.0
WORTH_OF_MOTION = 0.5  # of what motion says: how vehicles move is hardly known
# A candidate continues a chain within so many squared standard deviations, or where the vehicle can have turned so far,
# and by this angle: seen nearly square on, noise tilts both candidates away from each other.
_MATCHED, _MATCHED_RAD = 16.0, math.radians(3.0)
_MOST_MOTION = 9.0  # squared standard deviations that count against a chain
_DOUBT = 5e-4  # left to either hypothesis, so that a wrong one heals within a few frames
# What both candidates may be off by in every frame, as where lights do not stand quite in their places.
_COMMON_SIGMA_RAD = math.radians(0.5)
_SURE_SIGMAS, _SURE_SHARE = 5.0, 0.02  # of a position's errors, and of the distance

Pair = tuple[CirclePose, CirclePose]


@dataclass(frozen=True)
class Hypotheses:
    """Both chains of poses after a frame, and the probability that the first is right.

    Attributes
    ----------
    chains : of the first and of the second hypothesis.
    first : probability of the first.
    seen : index of the frame's candidate that continues each chain; None where none does.
    age : frames since they began.
    gap_s : time since the dock was seen.
    """

    chains: tuple[Chain, Chain]
    first: float
    seen: tuple[int | None, int | None] = (0, 1)
    age: int = 1
    gap_s: float = 0.0

    @classmethod
    def begin(cls, found: Estimate, speeds: Speeds, worth: float) -> Hypotheses | None:
        """Start from the candidates of a frame; None where it shows no dock."""
        pair = candidates_of(found)
        if pair is None:
            return None
        first, second = (Chain.begin(pose, speeds) for pose in pair)
        return cls((first, second), _logistic(_log_odds(pair, worth)))

    @property
    def chosen(self) -> int:
        """The likelier chain."""
        return 0 if self.first >= 0.5 else 1

    @property
    def probability(self) -> float:
        """That the likelier chain is right."""
        return max(self.first, 1 - self.first)

    @property
    def is_ahead(self) -> bool:
        """Whether the likelier chain is still in front of the camera."""
        return bool(self.chains[self.chosen].position_m[2] > 0)

    def after(self, period_s: float, speeds: Speeds, command: Command | None = None) -> Hypotheses:
        """Both chains where they should be in the next frame, in which nothing is seen yet."""
        first, second = (chain.after(period_s, speeds, command) for chain in self.chains)
        return Hypotheses((first, second), self.first, (None, None), self.age + 1, self.gap_s + period_s)

    def is_near(self, pair: Pair, speeds: Speeds) -> bool:
        """Whether the dock can have come to a frame's candidates since it was seen, at the speed that is allowed."""
        return any(self._is_near(pose, speeds) for pose in pair)

    def _is_near(self, pose: CirclePose, speeds: Speeds) -> bool:
        distance = float(np.linalg.norm(pose.position_m))
        error = _SURE_SIGMAS * float(np.linalg.norm(pose.sigma_position_m or 0.0)) + _SURE_SHARE * distance
        apart = float(np.linalg.norm(pose.position_m - self.chains[self.chosen].position_m))
        return apart <= speeds.reach_m(distance, self.gap_s) + error

    def with_frame(self, found: Estimate, speeds: Speeds, worth: float) -> Hypotheses | None:
        """Take in the frame that these were predicted for.

        Parameters
        ----------
        found : what it shows.
        speeds : of the vehicle.
        worth : share of the frame's own evidence that counts.

        Returns
        -------
        The hypotheses after it; None where it shows no dock, or one that cannot be this. Where one chain is continued
        the other begins again at the twin of that, for a picture always has both.
        """
        pair = candidates_of(found)
        if pair is None or not self.is_near(pair, speeds):
            return None
        squares, off = _off(self.chains, pair)
        twins = (found.lights_on_ring or 0) >= MIN_POINTS  # of three or four lights the candidates need not be
        order, first = posterior(self.first, off, _log_odds(pair, worth) if twins else 0.0)
        near = (off <= _MATCHED) | (squares <= (speeds.radians * self.gap_s + _MATCHED_RAD) ** 2)
        if not near[(0, 1), order].any():
            return None
        chains = list(self.chains)
        seen: list[int | None] = [None, None]
        for number, candidate in enumerate(order):
            if near[number, candidate]:
                chains[number], seen[number] = chains[number].seen_as(pair[candidate]), candidate
            elif twins:
                chains[number], seen[number] = Chain.begin(pair[candidate], speeds), candidate
            else:
                chains[number] = Chain.begin(_twin(pair[order[1 - number]]), speeds)
        first = _mixed(first if twins else self.first, pair)
        return replace(self, chains=(chains[0], chains[1]), first=first, seen=(seen[0], seen[1]), gap_s=0.0)


def candidates_of(found: Estimate) -> Pair | None:
    """Both candidates of a frame; one that came alone is its own twin. None where it shows no dock."""
    if found.status != "ok" or not found.candidates:
        return None
    return found.candidates[0], found.candidates[-1]


def posterior(first: float, off: np.ndarray, log_odds: float) -> tuple[tuple[int, int], float]:
    """Which candidate continues each chain, and the probability that the first chain is right, after a frame.

    Parameters
    ----------
    first : the probability before it.
    off : (2, 2) squared standard deviations from each chain to each candidate.
    log_odds : of the first candidate, by the frame alone.

    Notes
    -----
    The forward step of a hidden Markov model whose state is the candidate that is right. How well a chain is continued
    at all is its likelihood by motion, tempered. How its probability divides between the two candidates is not: a
    candidate that is out of the question for a chain takes nothing from it, and only where both nearly coincide do the
    chains mix. The chains go on to the candidates that most of the probability went to.
    """
    # The nearer candidate of each chain has 1, so that nothing vanishes.
    nearest = off.min(axis=1, keepdims=True)
    fit = np.exp(-0.5 * (off - nearest))
    fit /= fit.sum(axis=1, keepdims=True)
    moved = np.exp(-0.5 * WORTH_OF_MOTION * np.minimum(nearest, _MOST_MOTION))
    weights = np.array([[first], [1 - first]]) * moved * fit * [_logistic(log_odds), _logistic(-log_odds)]
    order = (0, 1) if np.trace(weights) >= weights.sum() / 2 else (1, 0)
    share = float(weights[:, order[0]].sum() / weights.sum())
    return order, min(1 - _DOUBT, max(_DOUBT, share))


def _mixed(first: float, pair: Pair) -> float:
    """The probability, where errors that both candidates share may bring the truth nearer to the other one."""
    gap = math.dist(pair[0].normal.tolist(), pair[1].normal.tolist())
    beyond = 0.5 * math.erfc(gap / (math.sqrt(8) * _COMMON_SIGMA_RAD))
    return first * (1 - beyond) + (1 - first) * beyond


def _off(chains: tuple[Chain, Chain], pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Squared angles (2, 2) from each chain to each candidate, and in terms of the same deviation for all."""
    off = [[chain.off(pose) for pose in pair] for chain in chains]
    spread = sum(variance for row in off for _, variance in row) / 4 + _COMMON_SIGMA_RAD**2
    squares = np.array([[square for square, _ in row] for row in off])
    return squares, squares / spread


def _twin(pose: CirclePose) -> CirclePose:
    """About the other pose of the same picture: its normal is the mirror image about the line of sight."""
    sight = pose.position_m / np.linalg.norm(pose.position_m)
    return replace(pose, normal=2 * float(pose.normal @ sight) * sight - pose.normal)


def _log_odds(pair: Pair, worth: float) -> float:
    """Log-odds of the first candidate by its frame alone, tempered."""
    first, second = (max(pose.probability or 0.0, 1e-300) for pose in pair)
    return min(MOST_ODDS, max(-MOST_ODDS, worth * math.log(first / second)))


def _logistic(log_odds: float) -> float:
    return 1 / (1 + math.exp(-log_odds))
