"""Smoothing over a whole recording: each pose given all frames, those after it as well as those before."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.tracking.chain import MEMORY_S, Chain, speed_sigmas
from dockpose.tracking.hypotheses import links
from dockpose.tracking.tracker import Tracked


@dataclass(frozen=True)
class Smoothed:
    """The pose of one frame given the whole recording.

    Attributes
    ----------
    pose : CirclePose
        With its standard errors.
    probability : float
        That of the two poses this is the right one.
    chain : int
        0 or 1, the hypothesis that it belongs to.
    """

    pose: CirclePose
    probability: float
    chain: int

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names."""
        return self.pose.summary() | {"probability": self.probability}


@dataclass(frozen=True)
class _Kept:
    """What smoothing needs of a frame: both chains, the probability of the first, and the way from the frame before."""

    dock: Dock
    chains: tuple[Chain, Chain]
    predicted: tuple[Chain, Chain] | None
    first: float
    links: np.ndarray
    elapsed_s: float


class Smoother:
    """Smooths the poses of a recording that a :class:`Tracker` followed, once all its frames are known.

    Parameters
    ----------
    camera : Camera
        The camera that took the frames.
    settings : Settings, optional
        Those of the tracker.

    Notes
    -----
    Both chains are smoothed backwards over the length of a track by the fixed-interval equations of Rauch, Tung and
    Striebel. Which of them is right in a frame is the smoothed state of the tracker's hidden Markov model, by the
    forward-backward algorithm; where the chains may have crossed, the pose so passes from one to the other. Known
    motion of the vehicle is not used. Memory grows by about 2 KB a frame.

    References
    ----------
    Rauch, Tung and Striebel 1965, "Maximum likelihood estimates of linear dynamic systems".
    Rabiner 1989, "A tutorial on hidden Markov models and selected applications in speech recognition".
    """

    def __init__(self, camera: Camera, settings: Settings | None = None) -> None:
        self._camera, self._settings = camera, settings or Settings()
        self._kept: list[_Kept | None] = []

    def note(self, tracked: Tracked) -> None:
        """Take in the next frame."""
        step = tracked.step
        if step is None or step.after is None:
            self._kept.append(None)
            return
        before, after, found = step.before if step.goes_on else None, step.after, tracked.estimate
        link = np.eye(2) if before is None or after.gap_s > 0 else links(before, found, step.worth)
        predicted = None if before is None else before.chains
        self._kept.append(_Kept(found.dock, after.chains, predicted, after.first, link, step.elapsed_s))

    def poses(self) -> list[Smoothed | None]:
        """The smoothed pose of each frame that was taken in, in order; None where no dock was tracked."""
        found: list[Smoothed | None] = [None] * len(self._kept)
        later: _Kept | None = None
        chains: list[Chain] = []
        onwards = np.ones(2)
        for index, kept in reversed(list(enumerate(self._kept))):
            if kept is None:
                later = None
                continue
            if later is None or later.predicted is None:
                chains, onwards = list(kept.chains), np.ones(2)
            else:
                # One that begins anew in the next frame, with a speed that nothing tells, ends here.
                ends = zip(kept.chains, later.predicted, later.chains, chains, strict=True)
                chains = [
                    rts_step(here, predicted, after, later.elapsed_s, self._settings)
                    if new.variances[1].any()
                    else here
                    for here, predicted, new, after in ends
                ]
                onwards = later.links @ onwards
                onwards = onwards / onwards.sum()
            weights = np.array([kept.first, 1 - kept.first]) * onwards
            first = float(weights[0] / weights.sum())
            chosen = 0 if first >= 0.5 else 1
            found[index] = Smoothed(chains[chosen].pose(self._camera, kept.dock), max(first, 1 - first), chosen)
            later = kept
        return found


def rts_step(filtered: Chain, predicted: Chain, after: Chain, elapsed_s: float, settings: Settings) -> Chain:
    """One step backwards of the fixed-interval smoother."""
    value, both, rate = filtered.variances
    rate = np.minimum(rate, speed_sigmas(filtered.state, settings) ** 2)  # as the prediction takes it
    kept = math.exp(-elapsed_s / MEMORY_S)
    moved = MEMORY_S * (1 - kept)
    # P F^T, the covariance of the state and rate here with those in the next frame, and the gain C = P F^T P'^-1.
    there, there_both, there_rate = predicted.variances
    determinant = there * there_rate - there_both**2
    across = np.array([[value + moved * both, kept * both], [both + moved * rate, kept * rate]])
    inverse = np.array([[there_rate, -there_both], [-there_both, there]]) / determinant
    gain = np.einsum("ijk,jlk->ilk", across, inverse)
    apart = np.array([after.state - predicted.state, after.rates - predicted.rates])
    state, rates = np.array([filtered.state, filtered.rates]) + np.einsum("ijk,jk->ik", gain, apart)
    less, less_both, less_rate = after.variances - predicted.variances
    change = np.einsum("ijk,jlk,mlk->imk", gain, np.array([[less, less_both], [less_both, less_rate]]), gain)
    variances = np.array([value + change[0, 0], both + change[0, 1], rate + change[1, 1]])
    variances[[0, 2]] = np.maximum(variances[[0, 2]], 0.0)
    state[3:] /= np.linalg.norm(state[3:])
    return Chain(state, rates, variances)
