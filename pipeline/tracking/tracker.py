"""Tracking: a filter over frames that carries both poses until it is known which one is right."""

import math
import os
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.estimate.rivals import rings_of
from dockpose.guidance import guided
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.tracking.chain import Command
from dockpose.tracking.follow import period_s
from dockpose.tracking.hypotheses import Hypotheses
from dockpose.tracking.search import Search
from dockpose.vehicle import Vehicle
from numpy.typing import ArrayLike

# Centroid errors depend on sub-pixel position and persist between frames, and so do those of lights out of place. So
# each frame's evidence is down-weighted: by the first factor if the ring moved a pixel or more, by the second at rest.
WORTH, WORTH_AT_REST = 0.4, 0.07
# What the JSON line of a picture that belongs to no sequence has in place of a track's.
NO_TRACK = {"track": None, "predicted": None, "filtered": None}
_RIVAL_FRAMES = 2  # a dock seen elsewhere for this many frames, and the tracked one not, begins a new track


@dataclass(frozen=True)
class Track:
    """State of the track.

    Attributes
    ----------
    probability : float or None
        Probability that the chosen one of the two poses is right; None where the dock is lost.
    age : int
        Frames since the track began, including this one; 0 where the dock is lost.
    predicted : bool
        The dock was not seen in this frame, or not within reach; the pose is a prediction.
    lost : bool
        No dock is tracked: none has been seen yet, or not for too long.
    number : int
        Which track it is since the first frame, from 1; 0 where the dock is lost.
    """

    probability: float | None = None
    age: int = 0
    predicted: bool = False
    lost: bool = True
    number: int = 0


@dataclass(frozen=True)
class Step:
    """What a frame did to the hypotheses."""

    before: Hypotheses | None  # as predicted by the frames before it
    after: Hypotheses | None  # updated with it

    @property
    def goes_on(self) -> bool:
        """Whether the track that was there before goes on, rather than another one or none."""
        return self.before is not None and self.after is not None and self.before.age == self.after.age


@dataclass(frozen=True)
class Tracked:
    """What was found in one frame, and what the previous frames make of it.

    Attributes
    ----------
    estimate : Estimate
        Result of the frame alone; where it shows several rings, that of the tracked one.
    track : Track
        State of the track.
    index : int or None
        Place of the final choice among ``estimate.candidates``; None where none of them continues the track.
    selected_by : str or None
        "tracking" where the track decided; "spacing" where the frame decides by itself and the track
        agrees, or a track begins; None where nothing is selected.
    pose : CirclePose or None
        The selected candidate, or the predicted pose where the frame shows none; None where lost.
    filtered : CirclePose or None
        The pose filtered over frames; None where lost.
    chain : int or None
        0 or 1, the hypothesis that the pose belongs to; the numbers are stable for the life of the track.
    step : Step or None
        The hypotheses before and after the frame; None where no frame was followed.
    """

    estimate: Estimate
    track: Track
    index: int | None = None
    selected_by: str | None = None
    pose: CirclePose | None = None
    filtered: CirclePose | None = None
    chain: int | None = None
    step: Step | None = None

    @property
    def selected(self) -> CirclePose | None:
        """The final choice among the candidates, as ``Estimate.selected`` is the frame's own; None without one."""
        return None if self.index is None else self.estimate.candidates[self.index]

    @property
    def message(self) -> str:
        """The frame's message; where the pose is the track's prediction, that and how far away it is."""
        found = self.estimate
        if self.pose is None or not self.track.predicted:
            return found.message
        ahead = f"predicted by the track alone, the dock is {100 * self.pose.position_m[2]:.1f} cm ahead"
        if found.choice is None:
            return f"{found.message.rstrip('.')}; {ahead}."
        return f"The ring in this frame does not continue the track; {ahead}."

    def to_dict(
        self,
        source: str | None = None,
        frame: int | None = None,
        time_s: float | None = None,
        sha256: str | None = None,
        time_unix_s: float | None = None,
        vehicle: Vehicle | None = None,
    ) -> dict[str, Any]:
        """The estimate's JSON object with the final choice, ``track``, and the predicted and the filtered pose."""
        chosen, camera, dock, chain = self.selected, self.estimate.camera, self.estimate.dock, self.chain
        before = None if self.step is None or chain is None or not self.step.goes_on else self.step.before
        after = None if self.step is None or chain is None else self.step.after
        return self.estimate.to_dict(source, frame, time_s, sha256, time_unix_s) | {
            "message": self.message,
            "selected": self.index,
            "selected_by": self.selected_by,
            "chosen": None if chosen is None else chosen.summary(),
            **guided(chosen, dock, camera, vehicle),
            "predicted": None if before is None or chain is None else before.chains[chain].pose(camera, dock).summary(),
            "filtered": None if after is None or chain is None else after.chains[chain].pose(camera, dock).summary(),
            "track": asdict(self.track),
        }


class Tracker:
    """Tracks one dock over frames, and decides which of its two poses is right.

    Parameters
    ----------
    camera : Camera
        The camera that takes the frames.
    dock : Dock
        The dock to track.
    settings : Settings, optional
        How to search each frame, and the vehicle's top speeds.
    follow_lights : bool
        Let :meth:`see` measure the lights where they must be by the frame before, and search where that fails and every
        100 frames, see :class:`Search`. Without it each frame's estimate is that of :func:`estimate` alone.

    Notes
    -----
    A hidden Markov model whose hidden state is which of the two candidates is right. The emission is a candidate's
    probability by its frame, tempered because consecutive frames share errors. The transition from either chain to
    either candidate is the likelihood of that motion; so where both candidates nearly coincide the chains may cross,
    and as much certainty is lost as the crossing is ambiguous. The filter is deterministic.

    Examples
    --------
    >>> from dockpose import simulate
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> dock = Dock(diameter=0.30, lights=10)
    >>> pose = simulate.Pose(position_m=(0.0, 0.0, 1.5), theta_y_deg=20.0)
    >>> scene = simulate.Scene(camera=camera, dock=dock, pose=pose)
    >>> plan = simulate.FilmPlan(scene=scene, motion=simulate.Hover(frames=3))
    >>> tracker = Tracker(camera, dock)
    >>> for frame in simulate.film(plan):
    ...     tracked = tracker.see(frame.image, frame.time_s)
    >>> tracked.track.age, tracked.track.lost
    (3, False)
    >>> bool(abs(tracked.pose.position_m[2] - 1.5) < 0.05)
    True
    """

    def __init__(self, camera: Camera, dock: Dock, settings: Settings | None = None, *, follow_lights: bool = True):
        self.camera, self.dock, self.settings = camera, dock, settings or Settings()
        self.follow_lights = follow_lights
        self._tracks = 0  # that were begun
        self.reset()

    def reset(self) -> None:
        """Forget all previous frames."""
        self._state: Hypotheses | None = None
        self._rival: Hypotheses | None = None
        self._elsewhere = 0  # frames in a row that show another dock and not this one
        self._time_s: float | None = None
        self._ring: Ellipse | None = None
        self._search, self._frames = Search(self.camera, self.dock), 0

    def see(
        self,
        image: np.ndarray | str | os.PathLike[str],
        time_s: float | None = None,
        command: Command | None = None,
        *,
        lights_px: ArrayLike | None = None,
        snap: ArrayLike = False,
    ) -> Tracked:
        """Search the next frame, or take the lights set in it, as :func:`estimate`; ``command`` is known motion."""
        if self.follow_lights:
            found = self._search.see(image, self._frames, time_s, self.settings, lights_px, snap)
        else:
            found = estimate(image, self.camera, self.dock, self.settings, lights_px=lights_px, snap=snap)
        self._frames += 1
        return self.follow(found, time_s, command)

    def follow(self, found: Estimate, time_s: float | None = None, command: Command | None = None) -> Tracked:
        """Update the track with the next frame's estimate; an earlier time begins a new track."""
        if time_s is not None and self._time_s is not None and time_s < self._time_s:
            self.reset()
        elapsed_s = period_s(self._time_s, time_s)
        self._time_s = time_s if time_s is not None else (self._time_s or 0.0) + elapsed_s
        before = self._state and self._state.predict(elapsed_s, self.settings, command)
        rival = self._rival and self._rival.predict(elapsed_s, self.settings, command)
        ahead_m = 0.0 if before is None else before.chains[before.chosen].position_m[2]
        if before is None or before.gap_s > self.settings.lost_after_s or not ahead_m > 0:
            self._state, self._rival, self._elsewhere = Hypotheses.begin(found, self.settings, WORTH), None, 0
            step, self._ring = Step(before, self._state), found.ellipse
            self._tracks += self._state is not None
            return _reported(found, step, self._tracks)
        after, rings = None, list(rings_of(found))
        for ring in sorted(rings, key=before.log_likelihood, reverse=True):
            if after is not None or (rival and rival.log_likelihood(ring) > before.log_likelihood(ring)):
                continue
            if after := before.update(ring, self.settings, self._worth(ring.ellipse)):
                found, self._ring = ring, ring.ellipse
        self._state = after or before
        elsewhere = self._seen_elsewhere([ring for ring in rings if after is None or ring is not found], rival)
        self._elsewhere = self._elsewhere + 1 if elsewhere and after is None else 0
        if elsewhere and self._rival and self._elsewhere >= _RIVAL_FRAMES:
            found, self._state, self._rival = elsewhere, replace(self._rival, age=self._elsewhere), None
            self._tracks += 1
        return _reported(found, Step(before, self._state), self._tracks)

    def _seen_elsewhere(self, rings: list[Estimate], rival: Hypotheses | None) -> Estimate | None:
        """Track another dock than the tracked one as well; the ring of it, if any of these rings is."""
        if rival is not None:
            for ring in sorted(rings, key=rival.log_likelihood, reverse=True):
                if after := rival.update(ring, self.settings, WORTH_AT_REST):
                    self._rival = after
                    return ring
        self._elsewhere = 0
        self._rival = rival if rival and rival.gap_s <= self.settings.lost_after_s else None
        if rings:
            self._rival = Hypotheses.begin(rings[0], self.settings, WORTH)
        return rings[0] if rings else None

    def _worth(self, ring: Ellipse | None) -> float:
        """Weight of a frame's evidence, by how far the ring's image moved since the previous frame."""
        before = self._ring
        if ring is None or before is None:
            return WORTH
        moved = math.dist((*ring.centre_px, *ring.semi_axes_px), (*before.centre_px, *before.semi_axes_px))
        return max(WORTH_AT_REST, WORTH * min(1.0, moved))


def _reported(found: Estimate, step: Step, number: int) -> Tracked:
    """What is reported about a frame."""
    state = step.after
    if state is None:
        return Tracked(found, Track(), step=step)
    chosen = state.chosen
    selected = state.seen[chosen]
    filtered = CirclePose.at(state.chains[chosen].position_m, state.chains[chosen].normal, found.camera)
    if selected is None or found.choice is None:
        track = Track(state.probability, state.age, predicted=True, lost=False, number=number)
        return Tracked(found, track, None, None, filtered, filtered, chosen, step)
    track = Track(state.probability, state.age, predicted=False, lost=False, number=number)
    agrees = selected == found.choice.selected and (found.choice.decided or state.age == 1)
    by = found.choice.selected_by if agrees else "tracking"
    return Tracked(found, track, selected, by, found.candidates[selected], filtered, chosen, step)
