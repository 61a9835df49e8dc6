"""How far the search of a picture came with one threshold, and which of several looks shows most."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.lights.chance import ACCEPTED_AMONG_OTHERS, LEAST_PX
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.growing import distances
from dockpose.lights.handmade import ON_RIM
from dockpose.lights.markers import Markers

# Lights so near their places, so many of them, and so sure not to be chance leave other thresholds little to better:
# half a pixel is more than noise does to a centre. Of a dock that is built less exactly another is looked at, too; one
# that shows it to a hundredth of the radius, half of what docks are built to, will do.
_EXACT_PX, EXACT_OF_AXIS, _MOST_OF, NO_CHANCE = 0.5, 0.01, 0.75, math.log(1e-6)
# What shows no ring so rare as this by chance, by no size of lights, shows none in white either.
_HINT = 0.05
# What is accepted among others, over ten: about so many scales are looked at, each with points of its own. Four lights
# are hardly ever surer than that.
LITTLE_CHANCE = math.log(ACCEPTED_AMONG_OTHERS / 10)


@dataclass(frozen=True)
class Attempt:
    """How far the search came with one threshold."""

    status: str
    message: str
    stages: dict[str, Any]
    log_chance: float = math.inf  # of the ring, if there is one

    def is_exact(self, of_axis: float = 0.0) -> bool:
        """Whether nearly all lights are there, where they should be, within a share of the major semi-axis."""
        if self.status != "ok":
            return False
        ring, ellipse, choice = self.stages["ring"], self.stages["ellipse"], self.stages["choice"]
        if choice.focal_px is not None and ring.focal_px is None:
            return False  # it was found by the camera's focal length, with which its lights are off their places
        count, rms_px = int(ring.on_ring.sum()), choice.candidates[choice.selected].rms_px or 0.0
        least = min(MIN_POINTS, ring.lights or MIN_POINTS)
        if self.log_chance > (NO_CHANCE if least == MIN_POINTS else LITTLE_CHANCE):
            return False
        complete = count >= max(least, _MOST_OF * (ring.lights or count))
        return complete and rms_px <= max(_EXACT_PX, of_axis * ellipse.semi_axes_px[0])

    @property
    def hints_at_ring(self) -> bool:
        """Whether there is a ring, or might be one that is less than sure."""
        ring = self.stages.get("ring")
        return ring is not None and (ring.found or ring.least_log_chance < math.log(_HINT))

    @property
    def suggests_count(self) -> bool:
        """Whether there is a whole ring of another number of lights than the dock has."""
        ring = self.stages.get("ring")
        return self.status != "ok" and ring is not None and not ring.found and ring.lights is not None

    @property
    def has_unexplained_groups(self) -> bool:
        """Whether the ring lacks lights, and groups that are none of them lie along its rim."""
        if self.status != "ok":
            return False
        ring, ellipse, markers = self.stages["ring"], self.stages["ellipse"], self.stages["markers"]
        if ring.on_ring.sum() >= (ring.lights or 0):
            return False
        others = markers.points_px[~ring.on_ring & ~markers.cut]
        return bool((ellipse.distances(others) < ON_RIM * ellipse.semi_axes_px[0]).any())

    def has_no_ring_in(self, markers: Markers) -> bool:
        """Whether no ring was found among lights that are these, to what is known of any centre."""
        own = self.stages.get("markers")
        if self.status != "not_a_ring" or own is None or "ring" not in self.stages or len(own) != len(markers):
            return False
        return float(distances(markers.points_px, own.points_px).min(axis=1).max()) < LEAST_PX

    def has_better_centres_than(self, other: "Attempt") -> bool:
        """Whether another look has these lights, worse known, no nearer to an ellipse: if more even, then by luck."""
        if self.status != "ok" or other.status != "ok":
            return False
        own, others = (one.stages["markers"].part(one.stages["ring"].on_ring) for one in (self, other))
        off_px = distances(own.points_px, others.points_px).min(axis=1)
        is_same = len(own) == len(others) and bool((math.pi * off_px**2 < own.areas_px).all())
        is_nearer = self.stages["ellipse"].rms_px > other.stages["ellipse"].rms_px + LEAST_PX
        return is_same and not is_nearer and max(_worst_px2(own), LEAST_PX**2) < _worst_px2(others)

    def rank(self) -> tuple[bool, bool, bool, float]:
        """A ring of five lights or more before one of fewer, any before none, and the least likely to be chance.

        Of thresholds that show none, one is best that shows all lights, if not where they should be.
        """
        ring, found = self.stages.get("ring"), self.status == "ok"
        lights = 0 if ring is None else int(ring.on_ring.sum())
        is_whole = ring is not None and ring.lights is not None and lights >= max(ring.lights, MIN_POINTS)
        return found and lights >= MIN_POINTS, found, is_whole, -self.log_chance


def _worst_px2(lights: Markers) -> float:
    """Variance, along both axes together, of the centre that is known worst; inf where nothing is known of one."""
    known_px2 = lights.covariances_px2
    return math.inf if known_px2 is None else float(np.nan_to_num(np.trace(known_px2.T), nan=math.inf).max())
