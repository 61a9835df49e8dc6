"""How a picture is searched."""

from __future__ import annotations

import msgspec
from dockpose.checks import check_number, check_whole
from dockpose.lights.markers import CENTROIDS
from dockpose.lights.masks import Mask, check_masks
from dockpose.thresholds import LEVELS, METHODS


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a picture is searched.

    Parameters
    ----------
    method : name of the threshold method, one of ``METHODS``.
    level : for the method "fixed", 0..255.
    min_area_px : groups of fewer pixels are noise.
    centroid : "grey" (weighed by brightness) or "binary" (the paper's mass moment).
    masks : rectangles (x_px, y_px, width_px, height_px) that are not looked at, see :mod:`dockpose.lights.masks`.
    max_speed_m_per_s, max_turn_deg_per_s : the fastest that the vehicle moves and turns, for following it over frames.
    lost_after_s : how long a dock that is not seen is predicted before it is lost.

    Raises
    ------
    ValueError
        if the method or the centroid is unknown, a number is out of range, or "fixed" has no level.
    """

    method: str = "hats"
    level: int | None = None
    min_area_px: int = 2
    centroid: str = "grey"
    masks: tuple[Mask, ...] = ()
    max_speed_m_per_s: float = 2.0
    max_turn_deg_per_s: float = 30.0
    lost_after_s: float = 1.0

    def __post_init__(self) -> None:
        _check_one_of("method", self.method, tuple(METHODS))
        _check_one_of("centroid", self.centroid, CENTROIDS)
        check_whole("min_area_px", self.min_area_px, least=1)
        if self.level is not None:
            check_whole("level", self.level, least=0)
            if self.level >= LEVELS:
                raise ValueError(f"level is {self.level!r}; it must be at most {LEVELS - 1}")
        elif self.method == "fixed":
            raise ValueError(f"level is None; the method 'fixed' needs a level, 0 to {LEVELS - 1}")
        check_masks(self.masks)
        for name in ("max_speed_m_per_s", "max_turn_deg_per_s", "lost_after_s"):
            check_number(name, getattr(self, name), above=0)


def _check_one_of(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(allowed)}")
