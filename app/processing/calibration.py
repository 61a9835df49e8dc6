"""Boards gathered from frames, as the command and the page do it; views of a dock, to learn where its lights are."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from dockpose import Camera, Dock, Estimate, estimate
from dockpose.camera.board import Sighting
from dockpose.camera.calibrate import ALIKE, NO_BOARD, Gathering
from dockpose.camera.coverage import Coverage, coverage_of
from dockpose.camera.image import to_grey, to_levels
from dockpose.pose.learned.views import FEWEST_LIGHTS, DockView
from dockpose.sources import Frames

MOST_BOARDS = 40  # of a video; more tell hardly more
ENOUGH_LIVE = 15
_LOOKS_HZ, _MOST_LOOKS = 6.0, 600
_SORTS = {ALIKE: "were like others", NO_BOARD: "show no board"}
MOST_VIEWS = 300  # of a recording; more tell hardly more
_SOON_S = 0.5  # a dock that is seen again within this time is taken not to have rolled by half a light's spacing


@dataclass
class Looked:
    """How many frames were looked at, and what became of them."""

    frames: int = 0  # number of frames that were looked at
    left_out: Counter[str] = field(default_factory=Counter)  # how many were left out, by the reason in a few words
    last: Sighting | None = None  # the board in the newest frame
    grey: np.ndarray | None = None  # the newest frame (H, W)

    def see(self, gathering: Gathering, image: np.ndarray, name: str) -> Sighting | None:
        """Look for the board in one more frame, (H, W) or (H, W, 3); only frames that count stay in the gathering."""
        self.frames += 1
        self.grey = to_levels(to_grey(image))[0]
        self.last = gathering.add(name, self.grey, thorough=False)
        dropped = gathering.views[name].dropped
        if dropped:
            del gathering.views[name]
            self.left_out[_SORTS.get(dropped, dropped)] += 1
        for other in [other for other, view in gathering.views.items() if view.dropped == ALIKE]:
            del gathering.views[other]  # its place was taken by a sharper one
        return self.last

    def in_words(self, used: int) -> str:
        """For people: "310 frames looked at: 25 used, 200 were like others, 85 show no board"."""
        parts = [f"{used} used", *(f"{count} {why}" for why, count in self.left_out.most_common())]
        return f"{self.frames} frames looked at: {', '.join(parts)}"


def gather(
    frames: Frames,
    gathering: Gathering,
    on_look: Callable[[Looked, Coverage | None], None] = lambda looked, seen: None,
    prefix: str = "",
) -> Looked:
    """Gather boards from frames: to the end of a recording, or from a live source until they are enough."""
    looked = Looked()
    every = max(1, round((frames.rate_hz or 1.0) / _LOOKS_HZ), (frames.count or 0) // _MOST_LOOKS)
    if frames.is_live or frames.count is None:
        every = 1
    for number, frame in enumerate(frames):
        if number % every:
            continue
        before = len(gathering.sightings)
        looked.see(gathering, frame.image, f"{prefix}frame {frame.index}")
        is_new = len(gathering.sightings) > before and gathering.size is not None
        covered = coverage_of(gathering.sightings, gathering.size) if is_new and gathering.size else None
        on_look(looked, covered)
        enough = ENOUGH_LIVE if frames.is_live else MOST_BOARDS
        if covered is not None and covered.is_enough and covered.pictures >= enough:
            break
    return looked


def dock_views(
    frames: Frames, camera: Camera, dock: Dock, on_frame: Callable[[Estimate], None] = lambda found: None
) -> Iterator[DockView]:
    """Look for the dock in frames; yield those in which at least five of its lights are found."""
    every = max(1, (frames.count or 0) // MOST_VIEWS)
    last_s: float | None = None
    for number, frame in enumerate(frames):
        if number % every:
            continue
        found = estimate(frame.image, camera, dock)
        on_frame(found)
        if found.status != "ok" or found.markers is None or found.ring is None:
            continue
        points_px = found.markers.points_px[found.ring.on_ring]
        if len(points_px) < FEWEST_LIGHTS:
            continue
        follows = last_s is not None and frame.time_s is not None and frame.time_s - last_s <= _SOON_S
        last_s = frame.time_s
        yield DockView(f"{frame.name} frame {frame.index}", points_px, found.candidates, follows)
