"""Other rings in a picture, each as if it were the dock: the tracker decides which of them it follows."""

from collections.abc import Iterator
from dataclasses import replace

from dockpose.estimate.result import Estimate
from dockpose.lights.ellipse import NoEllipseError
from dockpose.lights.ring import Ring
from dockpose.pose.detection import accept_pose, detection_of, found_in_words


def rings_of(found: Estimate) -> Iterator[Estimate]:
    """A frame's estimate, if it shows a dock, and then as it would be of each other ring in view."""
    if found.status != "ok" or not found.candidates:
        return
    yield found
    ring, markers, camera, dock = found.ring, found.markers, found.camera, found.dock
    if ring is None or markers is None:
        return
    every, area_px2 = (ring.on_ring, *ring.rivals), float(found.width * found.height)
    for number, on_ring in enumerate(ring.rivals, 1):
        other = Ring(on_ring, ring.reason, rivals=every[:number] + every[number + 1 :], alike=ring.alike)
        try:
            ellipse, choice, log_chance, reason = accept_pose(other, markers, camera, dock, area_px2)
        except NoEllipseError:
            continue
        if reason is None:
            other = replace(other, lights=choice.number)
            words = found_in_words(other, choice, camera, dock)
            detection = detection_of(log_chance, other, choice, camera, dock)
            yield replace(found, message=words, ring=other, ellipse=ellipse, choice=choice, detection=detection)
