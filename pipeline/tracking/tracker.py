"""Which of the two poses is right, over frames: a filter that carries both until one is known to be it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.tracking.chain import Command, Speeds
from dockpose.tracking.hypotheses import Hypotheses
from dockpose.tracking.search import Search, period_s

# The errors of lights' centres hang on where they fall on the pixels, and those of lights out of their place stay for
# good. So a frame tells less than it does by itself: by this factor where the ring moved a pixel or more, and by the
# smaller one where it stands still.
WORTH, WORTH_AT_REST = 0.4, 0.07
_RIVAL_FRAMES = 3  # a dock seen elsewhere for so many frames is followed from then on


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


class Tracker:
    """Follows one dock over frames, and tells which of its two poses is right.

    Parameters
    ----------
    camera, dock, settings : as for :func:`dockpose.estimate.estimate`; the settings bound the vehicle's speed.
    use_region : let :meth:`see` search around the last ring first, which is faster, and the whole picture where that
        fails and every 25 frames, see :class:`Search`. Numbers then depend on the frame before (see
        :func:`estimate` for how much); without it, each frame's estimate is that of
        :func:`estimate` alone, so that frames may be estimated in any order and by several processes,
        and then followed in their own.

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
        self._state: Hypotheses | None = None
        self._rival: Hypotheses | None = None
        self._time_s: float | None = None
        self._ring: Ellipse | None = None
        self._search, self._frames = Search(self.camera, self.dock, self.settings), 0

    def see(self, image: Any, time_s: float | None = None, command: Command | None = None) -> Tracked:
        """Search the next frame, in a region of it where that is used, and follow the dock.

        Parameters
        ----------
        image : as for :func:`dockpose.estimate.estimate`.
        time_s : when it was taken; None for a tenth of a second after the frame before.
        command : the vehicle's motion since the frame before, where it is known.
        """
        if self.use_region:
            found = self._search.see(image, self._frames, time_s, self.settings)
        else:
            found = estimate(image, self.camera, self.dock, self.settings)
        self._frames += 1
        return self.follow(found, time_s, command)

    def follow(self, found: Estimate, time_s: float | None = None, command: Command | None = None) -> Tracked:
        """Take in the estimate of the next frame.

        Parameters
        ----------
        found : what the frame shows, of the whole picture or a region.
        time_s : when it was taken; None for a tenth of a second after the frame before. Where it is earlier than the
            frame before, a new track begins.
        command : the vehicle's motion since the frame before, where it is known.
        """
        if time_s is not None and self._time_s is not None and time_s < self._time_s:
            self.reset()
        elapsed_s = period_s(self._time_s, time_s)
        self._time_s = time_s if time_s is not None else (self._time_s or 0.0) + elapsed_s
        worth = self._worth(found.ellipse)
        self._ring = found.ellipse or self._ring
        before = self._state and self._state.after(elapsed_s, self._speeds, command)
        if before is None or before.gap_s > self.settings.lost_after_s or not before.is_ahead:
            self._state, self._rival = Hypotheses.begin(found, self._speeds, WORTH), None
        else:
            after = before.with_frame(found, self._speeds, worth)
            self._rival = None if after else self._elsewhere(found, worth, elapsed_s, command)
            self._state = after or before
            if self._rival is not None and self._rival.age >= _RIVAL_FRAMES:
                self._state, self._rival = self._rival, None
        return _told(found, self._state)

    def _elsewhere(self, found: Estimate, worth: float, elapsed_s: float, command: Command | None) -> Hypotheses | None:
        """The dock was not seen where it can be: follow for a while what looks like it elsewhere, without a break."""
        before = self._rival and self._rival.after(elapsed_s, self._speeds, command)
        after = before and before.with_frame(found, self._speeds, worth)
        return after or Hypotheses.begin(found, self._speeds, WORTH)

    def _worth(self, ring: Ellipse | None) -> float:
        """What a frame's evidence is worth, by how far the ring's picture moved since the frame before."""
        if ring is None or self._ring is None:
            return WORTH
        before, now = self._ring, ring
        moved = math.dist((*now.centre_px, *now.semi_axes_px), (*before.centre_px, *before.semi_axes_px))
        return max(WORTH_AT_REST, WORTH * min(1.0, moved))


def _told(found: Estimate, state: Hypotheses | None) -> Tracked:
    """What is said about a frame."""
    if state is None:
        return Tracked(found, Track())
    chosen = state.chosen
    selected = state.seen[chosen]
    position, normal = state.chains[chosen].position_m, state.chains[chosen].normal
    x, y, z = position.tolist()
    centre_px = np.array([found.camera.fx * x / z + found.camera.cx, found.camera.fy * y / z + found.camera.cy])
    smoothed = CirclePose(position, normal, centre_px)
    if selected is None or found.choice is None:
        track = Track(state.probability, state.age, predicted=True, lost=False)
        return Tracked(found, track, None, None, smoothed, smoothed, chosen)
    track = Track(state.probability, state.age, predicted=False, lost=False)
    agrees = selected == found.choice.selected and (found.choice.decided or state.age == 1)
    by = found.choice.selected_by if agrees else "tracking"
    return Tracked(found, track, selected, by, found.candidates[selected], smoothed, chosen)
