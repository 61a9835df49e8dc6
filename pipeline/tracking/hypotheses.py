"""The two hypotheses about which pose is right, updated by each frame: one step of a hidden Markov model."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from dockpose.estimate import Estimate
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.tracking.chain import Chain, Command, reach_m

# Cap on the log-odds from one frame: a misidentified light makes a frame more certain than it should be.
MOST_ODDS = 2.0
WORTH_OF_MOTION = 0.5  # weight of the evidence from motion: how vehicles move is hardly known
# Gate: a candidate continues a chain within this squared Mahalanobis distance, four standard deviations, or within the
# angle that the vehicle can have turned plus this one: nearly square on, noise tilts both candidates apart.
_GATE, _GATE_RAD = 16.0, math.radians(3.0)
_MOST_DISTANCE = 9.0  # squared Mahalanobis distance that counts against a chain: three standard deviations
_NO_DOCK = 20.0  # log-odds against a candidate on which the lights are too far off their places for a dock
# As near to their places as most docks are built: 2 % of the radius both ways, with half as much again for its tail.
_IN_PLACE_PX, _IN_PLACE_OF_AXIS = 2.0, 0.042
_DOUBT = 5e-4  # least probability of either hypothesis, so that a wrong choice is corrected within a few frames
# Error that both candidates may share in every frame, such as from lights slightly out of place.
_COMMON_SIGMA_RAD = math.radians(0.5)
_LEAST_SHARED = 0.1  # of the variance of a frame's residuals, what all frames have in common
_SURE_SIGMAS, _SURE_SHARE = 5.0, 0.02  # of a position's errors, and of the distance

Pair = tuple[CirclePose, CirclePose]


@dataclass(frozen=True)
class Hypotheses:
    """Both chains of poses after a frame, and the probability that the first is right."""

    chains: tuple[Chain, Chain]  # the first and the second hypothesis
    first: float  # probability of the first
    seen: tuple[int | None, int | None] = (0, 1)  # index of the frame's candidate that continues each chain
    age: int = 1  # frames since the track began
    gap_s: float = 0.0  # time since the dock was last seen
    told: float = 0.0  # log-odds of the first by what its frames told of the lights, bounded by what these share
    allowed: float = 0.0  # log-odds that they can have together, however many they are, see ``allowed_by``
    is_steered: bool = False  # whether it was told how the vehicle moved
    others: int = 0  # frames that fit another camera than its file's, less those after them that do not

    @classmethod
    def begin(cls, found: Estimate, settings: Settings, worth: float) -> Hypotheses | None:
        """Start from the candidates of a frame; None where it shows no dock."""
        pair = candidates_of(found)
        if pair is None:
            return None
        first, second = (Chain.begin(pose, settings) for pose in pair)
        allowed = allowed_by(found)
        told = grown(0.0, _log_odds(found, worth), allowed)
        return cls((first, second), _logistic(told), told=told, allowed=allowed, others=int(_is_of_another(found)))

    @property
    def chosen(self) -> int:
        """Index of the likelier chain."""
        return 0 if self.first >= 0.5 else 1

    @property
    def probability(self) -> float:
        """Probability that the likelier chain is right."""
        return max(self.first, 1 - self.first)

    def predict(self, period_s: float, settings: Settings, command: Command | None = None) -> Hypotheses:
        """Predict both chains for the next frame, in which nothing has been seen yet."""
        first, second = (chain.predict(period_s, settings, command) for chain in self.chains)
        age, gap_s, is_steered = self.age + 1, self.gap_s + period_s, self.is_steered or command is not None
        chains = first, second
        return replace(self, chains=chains, seen=(None, None), age=age, gap_s=gap_s, is_steered=is_steered)

    def is_within_reach(self, pair: Pair, settings: Settings) -> bool:
        """Whether the dock, at its top speed, can have reached a frame's candidates since it was last seen."""
        there = self.chains[self.chosen].position_m.tolist()
        for pose in pair:
            distance = math.hypot(*pose.position_m.tolist())
            error = _SURE_SIGMAS * math.hypot(*(pose.sigma_position_m or ())) + _SURE_SHARE * distance
            if math.dist(pose.position_m.tolist(), there) <= reach_m(settings, distance, self.gap_s) + error:
                return True
        return False

    def log_likelihood(self, found: Estimate) -> float:
        """How well a frame's ring lies where the dock is predicted: by its squared Mahalanobis distance and spread."""
        there = self.chains[self.chosen]
        likelihoods = []
        for pose in candidates_of(found) or ():
            least = _SURE_SHARE * float(np.linalg.norm(pose.position_m))
            variances = there.variances[0, :3] + np.square(pose.sigma_position_m or np.zeros(3)) + least**2
            squares = (pose.position_m - there.position_m) ** 2
            likelihoods.append(-0.5 * float((squares / variances + np.log(variances)).sum()))
        return max(likelihoods, default=-math.inf)

    def update(self, found: Estimate, settings: Settings, worth: float) -> Hypotheses | None:
        """Update with the frame that these were predicted for."""
        pair = candidates_of(found)
        if pair is None or not self.is_within_reach(pair, settings):
            return None
        squares, distances = _distances(self.chains, pair)
        twins = (found.lights_on_ring or 0) >= MIN_POINTS  # of three or four lights the candidates need not be
        is_another, own = _is_of_another(found), allowed_by(found)
        allowed, log_odds = max(self.allowed, own), 0.0
        # By another's camera motion is not seen, nor are lights in their places.
        motion = 0.0 if is_another else WORTH_OF_MOTION
        if twins and (is_another or not self.others):
            log_odds = _log_odds(found, worth)
            way = 1 if posterior(self.first, distances, log_odds, motion)[0] == (0, 1) else -1
            log_odds = way * (grown(self.told, way * log_odds, allowed) - self.told)
        # Nor has a side by it another frame's. How a vehicle moves is hardly known, unless that was told.
        most = _NO_DOCK if self.is_steered else max(own if is_another else allowed, MOST_ODDS)
        order, first = posterior(self.first, distances, log_odds, motion, max(_DOUBT, _logistic(-min(_NO_DOCK, most))))
        turned = math.radians(settings.max_turn_deg_per_s) * self.gap_s
        gated = (distances <= _GATE) | (squares <= (turned + _GATE_RAD) ** 2)
        if not gated[(0, 1), order].any():
            return None
        chains = list(self.chains)
        seen: list[int | None] = [None, None]
        for number, candidate in enumerate(order):
            index = candidate * (len(found.candidates) - 1)  # a single one stands for both
            if gated[number, candidate]:
                chains[number], seen[number] = chains[number].update(pair[candidate]), index
            elif twins:
                chains[number], seen[number] = Chain.begin(pair[candidate], settings), index
            else:
                chains[number] = Chain.begin(_twin(pair[order[1 - number]]), settings)
        first = _mixed(first if twins else self.first, pair)
        told = (self.told + (log_odds if order == (0, 1) else -log_odds)) * (1 - 2 * _mixed(0.0, pair))
        others = max(0, self.others + (1 if is_another else -1))
        chained, were = (chains[0], chains[1]), (seen[0], seen[1])
        return Hypotheses(chained, first, were, self.age, 0.0, told, allowed, self.is_steered, others)


def candidates_of(found: Estimate) -> Pair | None:
    """Both candidates of a frame; a single candidate is used for both. None where the frame shows no dock."""
    if found.status != "ok" or not found.candidates:
        return None
    return found.candidates[0], found.candidates[-1]


def allowed_by(found: Estimate) -> float:
    """Log-odds that any number of frames like this one can have together, by their lights.

    Noise averages out over frames; lamps out of their places, and what a camera file is off, stay. Of residuals that
    is the share of the variance beyond what the picture's noise does to centres.
    """
    pair = candidates_of(found)
    if pair is None:
        return 0.0
    first, second = (max(pose.probability or 0.0, 1e-300) for pose in pair)
    markers, ring, count, shared = found.markers, found.ring, found.lights_on_ring or 0, 1.0
    squares_px2 = count * (pair[0].rms_px or 0.0) ** 2
    if markers is not None and ring is not None and markers.covariances_px2 is not None and squares_px2 > 0:
        (xx, xy), (_, yy) = markers.covariances_px2[ring.on_ring].transpose(1, 2, 0)
        own_px2 = 2 / float(((xx + yy) / (xx * yy - xy * xy)).mean())  # as the fit weighs them
        if math.isfinite(own_px2):
            shared = 1 - own_px2 * max(1, 2 * count - 6) / squares_px2
    return abs(math.log(first / second)) / max(_LEAST_SHARED, shared)


def grown(told: float, log_odds: float, allowed: float) -> float:
    """Log-odds of earlier frames with those of one more, where errors that they share allow but so much.

    The variance of what tells the poses apart is that of the noise, which falls with each frame, and that of what they
    share. Log-odds go as one over it: 1 / sum of those by noise + 1 / allowed. What speaks against counts in full until
    neither is likelier, and what is more of it is bounded as well.
    """
    if told * log_odds < 0:
        return told + log_odds if abs(log_odds) <= abs(told) else grown(0.0, told + log_odds, allowed)
    by_noise = abs(told) * allowed / max(allowed - abs(told), 1e-12) + abs(log_odds)
    return math.copysign(by_noise * allowed / max(by_noise + allowed, 1e-12), told + log_odds)


def _is_of_another(found: Estimate) -> bool:
    """Whether a frame's lights fit another camera than its file's."""
    return found.choice is not None and found.choice.focal_px is not None


def posterior(
    first: float, distances: np.ndarray, log_odds: float, motion: float = WORTH_OF_MOTION, doubt: float = _DOUBT
) -> tuple[tuple[int, int], float]:
    """Which candidate continues each chain, by distances (2, 2), and how probable the first is, see docs/method.md."""
    weights = []  # with which each chain goes on to the first and to the second candidate
    for probability, squares in zip((first, 1 - first), distances.tolist(), strict=True):
        nearest = min(squares)  # so that nothing underflows
        fits = [math.exp(-0.5 * (square - nearest)) for square in squares]
        moved = probability * math.exp(-0.5 * motion * min(nearest, _MOST_DISTANCE)) / sum(fits)
        weights.append((moved * fits[0] * _logistic(log_odds), moved * fits[1] * _logistic(-log_odds)))
    (kept, crossed), (crossed_back, kept_too) = weights
    total = kept + crossed + crossed_back + kept_too
    order, ours = ((0, 1), kept + crossed_back) if kept + kept_too >= total / 2 else ((1, 0), crossed + kept_too)
    return order, min(1 - doubt, max(doubt, ours / total))


def _mixed(first: float, pair: Pair) -> float:
    """The probability, given that errors shared by both candidates may bring the truth nearer to the other one."""
    gap = math.dist(pair[0].normal.tolist(), pair[1].normal.tolist())
    beyond = 0.5 * math.erfc(gap / (math.sqrt(8) * _COMMON_SIGMA_RAD))
    return first * (1 - beyond) + (1 - first) * beyond


def _distances(chains: tuple[Chain, Chain], pair: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Squared angles (2, 2) and squared Mahalanobis distances (2, 2), by one variance, of chains from candidates."""
    innovations = np.array([[chain.innovation(pose) for pose in pair] for chain in chains])
    squares, variances = np.moveaxis(innovations, -1, 0)
    return squares, squares / (variances.mean() + _COMMON_SIGMA_RAD**2)


def _twin(pose: CirclePose) -> CirclePose:
    """The approximate other pose of the same picture: its normal is mirrored about the line of sight."""
    sight = pose.position_m / np.linalg.norm(pose.position_m)
    return replace(pose, normal=2 * float(pose.normal @ sight) * sight - pose.normal)


def _log_odds(found: Estimate, worth: float) -> float:
    """Log-odds of the first candidate by its frame alone: tempered and capped, unless only one can be a dock."""
    one, other = (_can_be_dock(found, index) for index in (0, -1))
    if one != other:
        return _NO_DOCK if one else -_NO_DOCK
    first, second = (max(found.candidates[index].probability or 0.0, 1e-300) for index in (0, -1))
    return min(MOST_ODDS, max(-MOST_ODDS, worth * math.log(first / second)))


def _can_be_dock(found: Estimate, index: int) -> bool:
    """Whether the lights lie near enough to their places on a candidate."""
    if found.ellipse is None:
        return True
    most_px = max(_IN_PLACE_PX, _IN_PLACE_OF_AXIS * found.ellipse.semi_axes_px[0])
    return found.dock.lights is None or (found.candidates[index].rms_px or 0.0) <= most_px


def _logistic(log_odds: float) -> float:
    return 1 / (1 + math.exp(-log_odds))
