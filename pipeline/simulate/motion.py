"""How the vehicle moves: an approach, a sweep past the dock, hovering, and a course that an estimator steers."""

from __future__ import annotations

import math

import numpy as np
from dockpose.checks import check_number, check_whole
from dockpose.simulate.scene import Part


class Motion(Part, frozen=True, kw_only=True, tag_field="kind"):
    """What all motions share.

    Parameters
    ----------
    frames : number of pictures.
    rate_hz : pictures in a second.
    drift_m, drift_deg : how far currents carry and turn the vehicle along and about each of its axes, as a standard
        deviation over many sequences.
    drift_time_s : the shortest time in which it swings to and fro.

    Raises
    ------
    ValueError
        if a number is not finite or out of range.
    """

    frames: int = 100
    rate_hz: float = 10.0
    drift_m: float = 0.0
    drift_deg: float = 0.0
    drift_time_s: float = 4.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole("frames", self.frames, least=1)
        check_number("rate_hz", self.rate_hz, above=0)
        check_number("drift_time_s", self.drift_time_s, above=0)

    def position_m(self, position_m: np.ndarray, share: float) -> np.ndarray:
        """Where the dock is when this share (0 to 1) of the motion is over, from its place in the scene."""
        return position_m


class Approach(Motion, frozen=True, kw_only=True, tag="approach"):
    """The distance ahead (z) falls evenly from ``start_m`` to ``end_m``; the dock stays where it is in the picture."""

    start_m: float = 20.0
    end_m: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("start_m", self.start_m, above=0)
        check_number("end_m", self.end_m, above=0)

    def position_m(self, position_m: np.ndarray, share: float) -> np.ndarray:
        """Where the dock is when this share (0 to 1) of the motion is over, from its place in the scene."""
        return position_m * (self.start_m + share * (self.end_m - self.start_m)) / position_m[2]


class Sweep(Motion, frozen=True, kw_only=True, tag="sweep"):
    """The dock passes by at an even speed, as far to either side of its place in the scene as ``reach_m``.

    ``angle_deg`` is its direction in the picture, from the x axis towards y.
    """

    reach_m: float = 1.0
    angle_deg: float = 0.0

    def position_m(self, position_m: np.ndarray, share: float) -> np.ndarray:
        """Where the dock is when this share (0 to 1) of the motion is over, from its place in the scene."""
        angle = math.radians(self.angle_deg)
        return position_m + (2 * share - 1) * self.reach_m * np.array([math.cos(angle), math.sin(angle), 0])


class Hover(Motion, frozen=True, kw_only=True, tag="hover"):
    """The vehicle keeps its place but for the currents."""

    drift_m: float = 0.03
    drift_deg: float = 2.0


class ClosedLoop(Motion, frozen=True, kw_only=True, tag="closed_loop"):
    """The vehicle goes where an estimator tells it that the dock's axis is, turns to the dock, and closes in.

    Parameters
    ----------
    end_m : distance at which it stops.
    speed_m_per_s, turn_deg_per_s : the fastest that it moves and turns.
    """

    end_m: float = 1.0
    speed_m_per_s: float = 0.3
    turn_deg_per_s: float = 20.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("end_m", self.end_m, above=0)
