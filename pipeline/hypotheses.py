"""The two hypotheses about which pose is right, and what a frame says about them: a hidden Markov model's step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pipeline.chain import Chain, Command, Speeds
from pipeline.circle_pose import CirclePose
from pipeline.ellipse import MIN_POINTS
from pipeline.estimate import Estimate

# A frame says no more than this, as log-odds: a light that is taken for another one makes any frame surer than it is.
MOST_ODDS = 3.0
WORTH_OF_MOTION = 0.5  # of what motion says: how vehicles move is hardly known
_MATCHED = 16.0  # squared standard deviations within which a candidate continues a chain
_MOST_MOTION = 9.0  # squared standard deviations that count against a chain
_DOUBT = 1e-3  # left to either hypothesis, so that a wrong one heals within a few frames
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
        The hypotheses after it; None where it shows no dock, or one that cannot be this.
        """
        pair = candidates_of(found)
        if pair is None or not self.is_near(pair, speeds):
            return None
        off = _off(self.chains, pair)
        straight = off[0, 0] + off[1, 1] <= off[0, 1] + off[1, 0]
        order = (0, 1) if straight else (1, 0)
        if off[(0, 1), order].min() > _MATCHED:
            return None
        chains = list(self.chains)
        seen: list[int | None] = [None, None]
        for number, candidate in enumerate(order):
            if off[number, candidate] <= _MATCHED:
                chains[number], seen[number] = chains[number].seen_as(pair[candidate]), candidate
        first = self.first
        # Of three or four lights the candidates need not be each other's twins.
        if (found.lights_on_ring or 0) >= MIN_POINTS:
            first = posterior(first, off, order, _log_odds(pair, worth))
        return replace(self, chains=(chains[0], chains[1]), first=first, seen=(seen[0], seen[1]), gap_s=0.0)


def candidates_of(found: Estimate) -> Pair | None:
    """Both candidates of a frame; one that came alone is its own twin. None where it shows no dock."""
    if found.status != "ok" or not found.candidates:
        return None
    return found.candidates[0], found.candidates[-1]


def posterior(first: float, off: np.ndarray, order: tuple[int, int], log_odds: float) -> float:
    """Probability that the first chain is right, after a frame.

    Parameters
    ----------
    first : the same before it.
    off : (2, 2) squared standard deviations from each chain to each candidate.
    order : the candidate that continues each chain.
    log_odds : of the first candidate, by the frame alone.

    Notes
    -----
    The forward step of a hidden Markov model whose state is the chain that is right. How well a chain is continued at
    all is its likelihood by motion, tempered. How its probability divides between the two candidates is not: a
    candidate that is out of the question for a chain takes nothing from it, and only where both nearly coincide do the
    chains mix.
    """
    # The nearer candidate of each chain has 1, so that nothing vanishes.
    fit = np.exp(-0.5 * (off - off.min(axis=1, keepdims=True)))
    fit /= fit.sum(axis=1, keepdims=True)
    moved = np.exp(-0.5 * WORTH_OF_MOTION * np.minimum(off[(0, 1), order], _MOST_MOTION))
    carried = (np.array([first, 1 - first]) * moved) @ fit
    weights = carried * [_logistic(log_odds), _logistic(-log_odds)]
    return min(1 - _DOUBT, max(_DOUBT, float(weights[order[0]] / weights.sum())))


def _off(chains: tuple[Chain, Chain], pair: Pair) -> np.ndarray:
    """Squared standard deviations (2, 2) from each chain to each candidate, all in terms of the same deviation."""
    off = [[chain.off(pose) for pose in pair] for chain in chains]
    spread = sum(variance for row in off for _, variance in row) / 4
    return np.array([[square for square, _ in row] for row in off]) / spread


def _log_odds(pair: Pair, worth: float) -> float:
    """Log-odds of the first candidate by its frame alone, tempered."""
    first, second = (max(pose.probability or 0.0, 1e-300) for pose in pair)
    return min(MOST_ODDS, max(-MOST_ODDS, worth * math.log(first / second)))


def _logistic(log_odds: float) -> float:
    return 1 / (1 + math.exp(-log_odds))
