"""The dock: a circle of known diameter with lights evenly spaced around its rim."""

from __future__ import annotations

import msgspec
import numpy as np

from pipeline.checks import check_number, check_whole


class Dock(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"diameter": "diameter_m"}):
    """A ring of lights.

    Parameters
    ----------
    diameter : of the circle through the lights, in metres, above 0.
    lights : how many there are, evenly spaced, at least 3; None where it is not known.

    Raises
    ------
    ValueError
        if the diameter is not a positive number or the number of lights is below 3.
    """

    diameter: float
    lights: int | None = None

    def __post_init__(self) -> None:
        check_number("diameter", self.diameter, above=0)
        if self.lights is not None:
            check_whole("lights", self.lights, least=3)

    @property
    def radius(self) -> float:
        """Half the diameter, in metres."""
        return self.diameter / 2

    def light_points(self) -> np.ndarray:
        """Positions (lights, 3) in metres in the dock's own frame.

        The dock lies in the plane z = 0, its face looks along -z (towards the camera when it is square on), light 0
        is on the x axis and the others follow towards y.
        """
        if self.lights is None:
            raise ValueError("lights is None; the number of lights is needed to place them")
        angles = 2 * np.pi * np.arange(self.lights) / self.lights
        return self.radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(self.lights)])
