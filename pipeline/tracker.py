"""Which of the two poses is right, over frames: a filter that carries both until one is known to be it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.camera import Camera
from pipeline.chain import Chain, Command, Speeds
from pipeline.circle_pose import CirclePose
from pipeline.dock import Dock
from pipeline.ellipse import MIN_POINTS, Ellipse
from pipeline.estimate import Estimate, estimate
from pipeline.region import Region
from pipeline.settings import Settings

NOMINAL_PERIOD_S = 0.1  # between frames whose times are not known
# The errors of lights' centres hang on where they fall on the pixels, and those of lights out of their place stay for
# good. So a frame tells less than it does by itself: by this factor where the ring moved a pixel or more, and by the
# smaller one where it stands still.
_WORTH, _WORTH_AT_REST = 0.6, 0.1
_MOST_ODDS = 3.0  # of one frame: a light that is taken for another one makes any frame surer than it may be
_WORTH_OF_MOTION = 0.5
_MATCHED = 16.0  # squared standard deviations within which a candidate continues a chain
_MOST_MOTION = 9.0  # squared standard deviations that count against a chain
_DOUBT = 1e-3  # left to either hypothesis, so that a wrong one heals within a few frames
_SURE_SIGMAS = 5.0
_RIVAL_FRAMES = 3  # a dock seen elsewhere for so many frames is followed from then on
_LEAST_PERIOD_S = 1e-3

_CIRCLE_POINTS = 24
_FULL_EVERY = 25  # frames: then the whole picture is searched again
_REGION_SHARE = 0.5  # of the ring's size: margin on each side
_REGION_MARGIN_PX = 20.0
_LEAST_REGION = 0.25  # of the picture's width and height; a smaller one has too little water for a histogram
_LARGEST_REGION = 0.6  # of the picture's pixels; of a larger one the whole picture is as fast


@dataclass(frozen=True)
class Track:
    """How the dock is followed.

    Attributes
    ----------
    probability : that the chosen one of the two poses is right; None where the dock is lost.
    age : frames since the track began, that one counted; 0 where the dock is lost.
    predicted : the dock was not seen in this frame where it can be; the pose is a prediction.
    lost : no dock is followed: none was seen yet, or not for too long.
    """

    probability: float | None = None
    age: int = 0
    predicted: bool = False
    lost: bool = True


@dataclass(frozen=True)
class Tracked:
    """What was found in one frame, and what the frames before it make of that.

    Attributes
    ----------
    estimate : of the frame alone, as it was found.
    track : how the dock is followed.
    selected : index of the final choice among ``estimate.candidates``; None where none of them continues the track.
    selected_by : "tracking" where the track decided; "spacing" or "colours" where the frame decides by itself and the
        track agrees, or a track begins; None where nothing is selected.
    pose : the candidate that is selected, or where the frame shows none the predicted pose; None where lost.
    smoothed : the same over frames, for display; None where lost.
    chain : 0 or 1, which of the two hypotheses the pose belongs to; their numbers hold as long as the track.
    """

    estimate: Estimate
    track: Track
    selected: int | None = None
    selected_by: str | None = None
    pose: CirclePose | None = None
    smoothed: CirclePose | None = None
    chain: int | None = None

    def to_dict(
        self,
        source: str | None = None,
        frame: int | None = None,
        time_s: float | None = None,
        sha256: str | None = None,
    ) -> dict[str, Any]:
        """The estimate's JSON object with the final choice, and ``track``; the candidates are those of the frame."""
        track = self.track
        return self.estimate.to_dict(source, frame, time_s, sha256) | {
            "selected": self.selected,
            "selected_by": self.selected_by,
            "track": {
                "probability": track.probability,
                "age": track.age,
                "predicted": track.predicted,
                "lost": track.lost,
            },
        }


@dataclass(frozen=True)
class _State:
    """Both chains after a frame, and the probability that the first is right.

    Attributes
    ----------
    chains : of the first and of the second hypothesis.
    first : probability of the first.
    age : frames.
    gap_s : time since the dock was seen.
    """

    chains: tuple[Chain, Chain]
    first: float
    age: int = 1
    gap_s: float = 0.0

    @property
    def chosen(self) -> int:
        return 0 if self.first >= 0.5 else 1

    @property
    def probability(self) -> float:
        return max(self.first, 1 - self.first)


class Tracker:
    """Follows one dock over frames, and tells which of its two poses is right.

    Parameters
    ----------
    camera, dock, settings : as for :func:`pipeline.estimate.estimate`; the settings bound the vehicle's speed.
    use_region : let :meth:`see` search around the last ring first, which is faster, and the whole picture where that
        fails and every 25 frames. Numbers then hang on the frames before (see :func:`pipeline.estimate.estimate` for
        how much); without it, each frame's estimate is that of :func:`pipeline.estimate.estimate` alone, so that frames
        may be estimated in any order and by several processes, and then followed in their own.

    Notes
    -----
    A hidden Markov model: hidden is which of the two candidates is right. A candidate's probability by its frame is
    the emission, tempered, because errors are shared by frames in a row. The transition from either chain to either
    candidate is the likelihood of that motion; so where both candidates nearly coincide their chains may cross, and
    as much certainty is lost as that is ambiguous. Nothing is drawn at random.
    """

    def __init__(self, camera: Camera, dock: Dock, settings: Settings | None = None, *, use_region: bool = True):
        self.camera, self.dock, self.settings = camera, dock, settings or Settings()
        self.use_region = use_region
        self._speeds = Speeds.of(self.settings)
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._state: _State | None = None
        self._rival: _State | None = None
        self._time_s: float | None = None
        self._ring: Ellipse | None = None
        self._last: Estimate | None = None
        self._since_full = 0

    def see(self, image: Any, time_s: float | None = None, command: Command | None = None) -> Tracked:
        """Search the next frame, in a region of it where that is used, and follow the dock.

        Parameters
        ----------
        image : as for :func:`pipeline.estimate.estimate`.
        time_s : when it was taken; None for a tenth of a second after the frame before.
        command : the vehicle's motion since the frame before, where it is known.
        """
        height, width = np.asarray(image).shape[:2]
        region = self._region(width, height, self._period_s(time_s)) if self.use_region else None
        found = estimate(image, self.camera, self.dock, self.settings, region=region)
        self._since_full += 1
        if region is not None and not self._holds(found, region, time_s):
            first_ms = found.elapsed_ms
            found = estimate(image, self.camera, self.dock, self.settings)
            found = replace(found, elapsed_ms=first_ms + found.elapsed_ms)
            region = None
        if region is None:
            self._since_full = 0
        return self.follow(found, time_s, command)

    def follow(self, found: Estimate, time_s: float | None = None, command: Command | None = None) -> Tracked:
        """Take in the estimate of the next frame.

        Parameters
        ----------
        found : what the frame shows, of the whole picture or a region.
        time_s : when it was taken; None for a tenth of a second after the frame before. Where it is before the frame
            before, a new track begins.
        command : the vehicle's motion since the frame before, where it is known.
        """
        if time_s is not None and self._time_s is not None and time_s < self._time_s:
            self.reset()
        period_s = self._period_s(time_s)
        self._time_s = time_s if time_s is not None else (self._time_s or 0.0) + period_s
        worth = self._worth(found.ellipse)
        self._last, self._ring = found, found.ellipse or self._ring
        before = self._state and self._expected(self._state, period_s, command)
        if before is not None and before.gap_s > self.settings.lost_after_s:
            before = None
        if before is None:
            self._state, self._rival = self._begun(found), None
            return Tracked(found, Track()) if self._state is None else self._told(found, self._state, (0, 1))
        matched = self._match(before, found, worth)
        if matched is not None:
            self._state, self._rival = matched[0], None
            return self._told(found, *matched)
        self._state = before
        return self._elsewhere(found, worth, period_s, command)

    def _period_s(self, time_s: float | None) -> float:
        if time_s is None or self._time_s is None:
            return NOMINAL_PERIOD_S
        return max(_LEAST_PERIOD_S, time_s - self._time_s)

    def _expected(self, state: _State, period_s: float, command: Command | None) -> _State:
        """Both chains where they should be now."""
        first, second = (chain.after(period_s, self._speeds, command) for chain in state.chains)
        return _State((first, second), state.first, state.age + 1, state.gap_s + period_s)

    def _begun(self, found: Estimate) -> _State | None:
        """A track that begins with this frame; None where it shows no dock."""
        pair = _pair(found)
        if pair is None:
            return None
        first, second = (Chain.begin(pose, self._speeds) for pose in pair)
        return _State((first, second), _logistic(_log_odds(pair, _WORTH)))

    def _match(self, before: _State, found: Estimate, worth: float) -> tuple[_State, tuple[int, int]] | None:
        """The state after a frame, and the candidate that continues each chain, -1 for none.

        None where the frame shows no dock, or one that cannot be this.
        """
        pair = _pair(found)
        if pair is None or not any(self._is_near(before, pose) for pose in pair):
            return None
        squares, spread = _squares(before.chains, pair)
        order = (0, 1) if squares[0, 0] + squares[1, 1] <= squares[0, 1] + squares[1, 0] else (1, 0)
        off = squares / spread
        seen = [off[chain, order[chain]] <= _MATCHED for chain in (0, 1)]
        if not any(seen):
            return None
        chains = [
            chain.seen_as(pair[order[number]]) if seen[number] else chain for number, chain in enumerate(before.chains)
        ]
        first = before.first
        if found.lights_on_ring is None or found.lights_on_ring >= MIN_POINTS:
            first = _posterior(first, off, order, _log_odds(pair, worth))
        state = _State((chains[0], chains[1]), first, before.age, 0.0)
        first_seen, second_seen = (order[chain] if seen[chain] else -1 for chain in (0, 1))
        return state, (first_seen, second_seen)

    def _is_near(self, before: _State, pose: CirclePose) -> bool:
        """Whether the dock can have come there since it was seen, at the speed that is allowed."""
        chain = before.chains[before.chosen]
        distance = float(np.linalg.norm(pose.position_m))
        error = _SURE_SIGMAS * float(np.linalg.norm(pose.sigma_position_m or 0.0)) + 0.02 * distance
        apart = float(np.linalg.norm(pose.position_m - chain.position_m))
        return apart <= self._speeds.reach_m(distance, before.gap_s) + error

    def _elsewhere(self, found: Estimate, worth: float, period_s: float, command: Command | None) -> Tracked:
        """The dock was not seen where it can be. One seen elsewhere takes over after a few frames."""
        before = self._rival and self._expected(self._rival, period_s, command)
        matched = self._match(before, found, worth) if before else None
        self._rival = matched[0] if matched else self._begun(found) or before
        if matched and matched[0].age >= _RIVAL_FRAMES:
            self._state, self._rival = matched[0], None
            return self._told(found, *matched)
        assert self._state is not None
        return self._told(found, self._state, (-1, -1))

    def _told(self, found: Estimate, state: _State, seen: tuple[int, int]) -> Tracked:
        chain = state.chains[state.chosen]
        smoothed = self._pose(found.camera, chain)
        track = Track(state.probability, state.age, seen[state.chosen] < 0, False)
        if track.predicted or found.choice is None:
            return Tracked(found, track, None, None, smoothed, smoothed, state.chosen)
        selected = seen[state.chosen]
        agrees = selected == found.choice.selected and (found.choice.decided or state.age == 1)
        by = found.choice.selected_by if agrees else "tracking"
        return Tracked(found, track, selected, by, found.candidates[selected], smoothed, state.chosen)

    @staticmethod
    def _pose(camera: Camera, chain: Chain) -> CirclePose:
        x, y, z = chain.position_m.tolist()
        centre_px = np.array([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy])
        return CirclePose(chain.position_m, chain.normal, centre_px)

    def _worth(self, ring: Ellipse | None) -> float:
        """What a frame's evidence is worth, by how far the ring's picture moved since the frame before."""
        if ring is None or self._ring is None:
            return _WORTH
        moved = float(np.linalg.norm(np.subtract(ring.centre_px, self._ring.centre_px)))
        grown = float(np.linalg.norm(np.subtract(ring.semi_axes_px, self._ring.semi_axes_px)))
        return max(_WORTH_AT_REST, _WORTH * min(1.0, math.hypot(moved, grown)))

    def _region(self, width: int, height: int, period_s: float) -> Region | None:
        """Where to search; None for the whole picture."""
        if self._state is None or self._last is None or not self._last.candidates:
            return None
        if self._since_full + 1 >= _FULL_EVERY:
            return None
        left, top, right, bottom = _box(self._last.candidates[0], self._last.camera, self.dock)
        if not math.isfinite(left):
            return None
        chain = self._state.chains[self._state.chosen]
        distance = float(np.linalg.norm(chain.position_m))
        camera = self._last.camera
        moved = self._speeds.reach_m(distance, period_s + self._state.gap_s) / distance * max(camera.fx, camera.fy)
        margin = _REGION_SHARE * max(right - left, bottom - top) + _REGION_MARGIN_PX + moved
        across = max(right - left + 2 * margin, _LEAST_REGION * width)
        down = max(bottom - top + 2 * margin, _LEAST_REGION * height)
        x, y = (left + right - across) / 2, (top + bottom - down) / 2
        seen_across, seen_down = min(width, x + across) - max(0.0, x), min(height, y + down) - max(0.0, y)
        if min(seen_across, seen_down) < 1 or seen_across * seen_down > _LARGEST_REGION * width * height:
            return None
        return x, y, across, down

    def _holds(self, found: Estimate, region: Region, time_s: float | None) -> bool:
        """Whether what a region shows may be all of the ring, and continues the track."""
        pair = _pair(found)
        if pair is None or self._state is None or self._last is None:
            return False
        if (found.lights_on_ring or 0) < (self._last.lights_on_ring or 0):
            return False
        left, top, right, bottom = _box(pair[0], found.camera, self.dock)
        x, y, across, down = region
        within = left >= x and top >= y and right <= x + across and bottom <= y + down
        before = self._expected(self._state, self._period_s(time_s), None)
        return within and any(self._is_near(before, pose) for pose in pair)


def _pair(found: Estimate) -> tuple[CirclePose, CirclePose] | None:
    """Both candidates; a pose that came alone is its own twin."""
    if found.status != "ok" or not found.candidates:
        return None
    return found.candidates[0], found.candidates[-1]


def _squares(chains: tuple[Chain, Chain], pair: tuple[CirclePose, CirclePose]) -> tuple[np.ndarray, float]:
    """Squared angles (2, 2) from each chain to each candidate, and the variance that they should have."""
    off = [[chain.off(pose) for pose in pair] for chain in chains]
    squares = np.array([[square for square, _ in row] for row in off])
    return squares, sum(spread for row in off for _, spread in row) / 4


def _log_odds(pair: tuple[CirclePose, CirclePose], worth: float) -> float:
    """Log-odds of the first candidate by its frame alone, tempered."""
    first, second = (max(pose.probability or 0.0, 1e-300) for pose in pair)
    return min(_MOST_ODDS, max(-_MOST_ODDS, worth * math.log(first / second)))


def _posterior(first: float, off: np.ndarray, order: tuple[int, int], log_odds: float) -> float:
    """Probability that the first chain is right, after a frame.

    Parameters
    ----------
    first : the same before it.
    off : (2, 2) squared standard deviations from each chain to each candidate.
    order : the candidate that continues each chain.
    log_odds : of the first candidate by the frame alone.
    """
    moves = np.exp(-0.5 * _WORTH_OF_MOTION * np.minimum(off, _MOST_MOTION))
    # Ambiguity is judged untempered: a candidate that is out of the question for a chain takes nothing from it.
    fit = np.exp(-0.5 * np.minimum(off, 700.0))
    fit = fit / fit.sum(axis=1, keepdims=True)
    best = moves[(0, 1), order]
    carried = np.array([first, 1 - first]) * best
    candidates = carried @ fit * np.array([_logistic(log_odds), _logistic(-log_odds)])
    share = float(candidates[order[0]] / candidates.sum())
    return min(1 - _DOUBT, max(_DOUBT, share))


def _box(pose: CirclePose, camera: Camera, dock: Dock) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of the picture of a dock's ring; infinite where some of it has none."""
    angles = np.linspace(0, 2 * np.pi, _CIRCLE_POINTS, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]) @ pose.rotation[:, :2].T
    seen = camera.project(pose.position_m + dock.radius * circle)
    if not np.isfinite(seen).all():
        return -math.inf, -math.inf, math.inf, math.inf
    (left, top), (right, bottom) = seen.min(axis=0).tolist(), seen.max(axis=0).tolist()
    return left, top, right, bottom


def _logistic(log_odds: float) -> float:
    return 1 / (1 + math.exp(-log_odds))
