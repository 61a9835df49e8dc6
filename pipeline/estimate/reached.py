"""The stages that the search of a picture reached, which an estimate reports and a drawing shows."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.by_hand import ByHand
from dockpose.lights.ellipse import Ellipse
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.thresholds import Threshold


@dataclass(frozen=True)
class Stages:
    """What was searched and what each stage found; ``Estimate`` says what each is."""

    status: str
    message: str
    width: int
    height: int
    bits: int
    camera: Camera
    dock: Dock
    settings: Settings
    threshold: Threshold | None = None
    markers: Markers | None = None
    ring: Ring | None = None
    ellipse: Ellipse | None = None
    choice: Choice | None = None
    detection: float | None = None
    elapsed_ms: float = 0.0
    found_by: str = "search"
    min_channel: bool = False
    by_hand: ByHand | None = None
    picture: Callable[[], Any] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def candidates(self) -> tuple[CirclePose, ...]:
        """The two poses, the likelier first; empty where there are none."""
        return () if self.choice is None else self.choice.candidates

    @cached_property
    def selected(self) -> CirclePose | None:
        """The chosen pose."""
        return None if self.choice is None else self.choice.candidates[self.choice.selected]

    @property
    def lights_on_ring(self) -> int | None:
        """How many groups are lights on the ring; None where the search did not come so far."""
        return None if self.ring is None else int(self.ring.on_ring.sum())

    def light_numbers(self) -> list[int | None]:
        """For each marker the number of the light that it is; None where it is not a light, or unknown."""
        if self.markers is None:
            return []
        numbers: list[int | None] = [None] * len(self.markers)
        if self.ring is not None and self.choice is not None and self.choice.lights is not None:
            markers = np.flatnonzero(self.ring.on_ring).tolist()
            for marker, light in zip(markers, self.choice.lights.tolist(), strict=True):
                numbers[marker] = light
        return numbers
