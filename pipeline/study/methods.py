"""The methods that the study compares, each as the flow chart is called for it."""

from __future__ import annotations

from dataclasses import dataclass

from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.settings import Settings
from dockpose.study.draw import Picture

PRODUCT = "hats_and_local"


@dataclass(frozen=True)
class Method:
    """A way to find the dock."""

    label: str  # its name in tables
    title: str  # its name for people
    threshold: str  # which of ``dockpose.thresholds.METHODS``
    fall_back: bool = False  # for hats, whether lights get levels of their own where no single level shows the ring

    def find(self, picture: Picture) -> Estimate:
        """Find the dock in a picture, told the camera, the diameter and the number of lights."""
        camera: Camera = picture.scene.camera
        dock: Dock = picture.scene.dock
        return estimate(picture.image, camera, dock, Settings(method=self.threshold), fall_back=self.fall_back)


METHODS = {
    method.label: method
    for method in (
        Method(PRODUCT, "HATS + local", "hats", fall_back=True),
        Method("hats", "HATS", "hats"),
        Method("hats_local", "Local HATS", "hats_local"),
        Method("otsu", "Otsu", "otsu"),
        Method("kapur", "Kapur", "kapur"),
        Method("kittler", "Kittler-Illingworth", "kittler"),
        Method("sezan", "Sezan", "sezan"),
        Method("li", "Li", "li"),
        Method("yen", "Yen", "yen"),
        Method("triangle", "Triangle", "triangle"),
    )
}
HATS = "hats"
RIVALS = ("otsu", "kapur", "kittler", "sezan")  # those of the paper
