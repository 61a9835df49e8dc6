"""Masks over what stays put while the rest of the pictures moves, as burnt-in text does."""

from collections.abc import Callable
from typing import Any

import msgspec
from dockpose import Camera, Dock, Estimate, Settings
from dockpose.lights.masks import StillGroups


class AutoMasks:
    """Masks what stays put in consecutive frames of one size, camera and dock; ``tell`` hears of each new mask."""

    def __init__(self, settings: Settings, tell: Callable[[str], None]) -> None:
        self._settings, self._tell = settings, tell
        self._still = StillGroups()
        self._belongs: tuple[Any, ...] = ()

    def settings_for(self, shape: tuple[int, ...], camera: Camera, dock: Dock) -> Settings:
        """Settings for the next frame, of that height and width, with the masks found so far."""
        belongs = (*shape[:2], camera, dock)
        if belongs != self._belongs:
            self._belongs, self._still = belongs, StillGroups()
        if not self._still.masks:
            return self._settings
        return msgspec.structs.replace(self._settings, masks=(*self._settings.masks, *self._still.masks))

    def see(self, found: Estimate, name: str) -> None:
        """Learn from what was found in that frame, called ``name``."""
        on_ring = found.ring.on_ring if found.status == "ok" and found.ring is not None else None
        if found.found_by == "following":  # which looks at nothing but lights
            return
        masks = self._still.see(found.markers, on_ring)
        if masks:
            where = "; ".join(",".join(f"{number:g}" for number in mask) for mask in masks)
            self._tell(
                f"{name}: something bright stays put while the rest moves, as burnt-in text does; "
                f"from the next picture on it is masked (x, y, width, height in pixels): {where}"
            )
