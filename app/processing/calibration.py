"""Views of a dock, to learn where its lights are."""

from collections.abc import Callable, Iterator

from dockpose import Camera, Dock, Estimate, estimate
from dockpose.pose.learned.views import FEWEST_LIGHTS, DockView
from dockpose.sources import Frames

MOST_VIEWS = 300  # of a recording; more tell hardly more
_SOON_S = 0.5  # a dock that is seen again within this time is taken not to have rolled by half a light's spacing


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
