"""The methods of the study: every threshold method with the steps after it, and the program's default."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dockpose.estimate import Estimate, estimate
from dockpose.settings import Settings
from dockpose.study.draw import Picture
from dockpose.thresholds import METHODS as THRESHOLDS

PRODUCT, HATS = "hats_and_local", "hats"
RIVALS = ("otsu", "kapur", "kittler", "sezan")  # those of the paper


@dataclass(frozen=True)
class Method:
    """A way to find the dock."""

    label: str  # its name in tables
    threshold: str  # which of ``dockpose.thresholds.METHODS``
    fall_back: bool = False  # for hats, whether lights get a level each where no single level shows the ring

    @property
    def title(self) -> str:
        """Its name for people."""
        title = THRESHOLDS.title(self.threshold).partition(" (")[0]
        return f"{title} + local" if self.fall_back else title

    def find(self, picture: Picture) -> Estimate:
        """Find the dock in a picture, given the camera, the diameter and the number of lights."""
        scene, settings = picture.scene, Settings(method=self.threshold)
        return estimate(picture.image, scene.camera, scene.dock, settings, fall_back=self.fall_back)


class _Methods(Mapping[str, Method]):
    """The program's default first, then all that are registered but a fixed level, which no one sets for each scene."""

    def __getitem__(self, label: str) -> Method:
        if label == PRODUCT:
            return Method(PRODUCT, HATS, fall_back=True)
        if label not in THRESHOLDS or label == "fixed":
            raise KeyError(label)
        return Method(label, label)

    def __iter__(self) -> Iterator[str]:
        return iter((PRODUCT, *(name for name in THRESHOLDS if name != "fixed")))

    def __len__(self) -> int:
        return len(THRESHOLDS)


METHODS = _Methods()
