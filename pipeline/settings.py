"""Detection and tracking settings."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from dockpose.checks import check_number, check_one_of, check_whole, make_plain
from dockpose.lights.markers import CENTROIDS
from dockpose.lights.masks import Mask, check_masks
from dockpose.thresholds import LEVELS, METHODS


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a picture is searched, and how fast a tracked dock may move.

    Parameters
    ----------
    method : str
        Name of the threshold method, one of ``METHODS`` or one that was registered.
    level : int, optional
        Grey level for the method "fixed", 0..255.
    min_area_px : int, pixels
        Groups of fewer pixels are noise.
    centroid : {"grey", "binary"}
        Weigh a light's pixels by brightness, or all alike (the paper's mass moment).
    masks : tuple of (x_px, y_px, width_px, height_px)
        Rectangles that are ignored, see :mod:`dockpose.lights.masks`.
    max_speed_m_per_s, max_turn_deg_per_s : float, metres and degrees per second
        The fastest the vehicle moves and turns, for tracking.
    lost_after_s : float, seconds
        How long a dock that is not seen is predicted before the track is lost.

    Raises
    ------
    ValueError
        If the method or the centroid is unknown, a number is out of range, or "fixed" has no level.

    Examples
    --------
    >>> Settings(method="otsu").min_area_px
    2
    >>> Settings(method="fixed")
    Traceback (most recent call last):
        ...
    ValueError: level is None; the method 'fixed' needs a level, 0 to 255
    """

    method: str = "hats"
    level: int | None = None
    min_area_px: int = 2
    centroid: str = "grey"
    masks: tuple[Mask, ...] = ()
    max_speed_m_per_s: float = 2.0
    max_turn_deg_per_s: float = 30.0
    lost_after_s: float = 1.0

    if TYPE_CHECKING:  # what is taken is more than what is kept

        def __init__(
            self,
            method: str = "hats",
            level: int | None = None,
            min_area_px: int = 2,
            centroid: str = "grey",
            masks: Sequence[Sequence[float]] | np.ndarray = (),
            max_speed_m_per_s: float = 2.0,
            max_turn_deg_per_s: float = 30.0,
            lost_after_s: float = 1.0,
        ) -> None: ...

    def __post_init__(self) -> None:
        make_plain(self)
        check_one_of("method", self.method, METHODS)
        check_one_of("centroid", self.centroid, CENTROIDS)
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
