"""The dock: a circle of known diameter with lights around its rim."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from dockpose.checks import check_number, check_whole, make_plain

_CLOSEST_DEG = 0.5  # two lights closer together than this are the same
# Of the diameter: nearer to the plane of the lights an extra one tells nothing, farther than that none is mounted.
LEAST_DEPTH, _FARTHEST = 0.02, 2.0
Vector = tuple[float, float, float]
_NOT_GIVEN = float("nan")


class Entrance(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Where the vehicle shall go in, relative to the ring, and the corridor that leads there.

    Parameters
    ----------
    position_m : (float, float, float), metres
        Its middle in the dock's frame: x and y across the ring, z into the dock.
    normal : (float, float, float)
        Direction out of it along the corridor, of any length; (0, 0, -1) is straight out of the ring.
    radius_m : float, metres
        How far from its middle the vehicle may still go in.
    cone_deg : float, degrees
        How fast the corridor widens before it: the half angle of a cone that is ``radius_m`` wide at the entrance.
    standoff_m : float, metres
        How far before it, on the corridor's axis, a vehicle that is not in the cone goes first.

    Raises
    ------
    ValueError
        If a number is not finite or out of range, or the normal is zero.
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, -1.0)
    radius_m: float = 0.0
    cone_deg: float = 15.0
    standoff_m: float = 1.0

    def __post_init__(self) -> None:
        make_plain(self)
        for name in ("position_m", "normal"):
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} has {len(getattr(self, name))} values; it must have three")
            for axis, value in zip("xyz", getattr(self, name), strict=True):
                check_number(f"{name} {axis}", value)
        if math.hypot(*self.normal) < 1e-9:
            raise ValueError(f"normal is {list(self.normal)}; it must have a length")
        for name in ("radius_m", "cone_deg", "standoff_m"):
            check_number(name, getattr(self, name), least=0)
        if self.cone_deg >= 90:
            raise ValueError(f"cone_deg is {self.cone_deg:g}; it must be below 90")

    @property
    def is_on_axis(self) -> bool:
        """Whether it looks the same however the dock is rolled."""
        return not any((*self.position_m[:2], *self.normal[:2]))


def frame_of(normal: Vector) -> np.ndarray:
    """Rotation (3, 3) to the dock's frame from one whose face looks along a normal (3,), turned the shortest way."""
    out = np.array(normal) / math.hypot(*normal)
    if out[2] > 1 - 1e-12:
        return np.diag([-1.0, 1.0, -1.0])
    # Two reflections are a rotation: -z, the face's own normal, is turned about, and then brought to this one.
    half = out - [0.0, 0.0, 1.0]
    half /= np.linalg.norm(half)
    return (np.eye(3) - 2 * np.outer(half, half)) @ np.diag([1.0, 1.0, -1.0])


class Dock(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    rename={"diameter": "diameter_m", "_rings": "rings", "_colours": "colours"},
    repr_omit_defaults=True,
):
    """A ring of lights.

    Parameters
    ----------
    diameter : float, metres
        Diameter of the circle through the lights, above 0.
    lights : int, optional
        Number of lights, at least 3; None where it is not known.
    angles_deg : tuple of float, degrees
        Angle of each light around the ring, see :meth:`light_points`; empty where they are evenly spaced.
    offsets_m : tuple of (float, float, float), metres
        How far each light is from its place on the circle, along the dock's x, y and z; empty where all are in place.
        ``dockpose learn-dock`` finds them.
    diameter_sigma_m : float, metres, optional
        Standard error of the diameter; where it is unknown, 0.3 % of it is taken.
    lights_sigma_m : float, metres, optional
        Standard error of each light's place, per axis; where it is unknown, it is what the residuals show.
    lamp_depth_m : float, metres
        How far behind the circle's plane, into the dock, the light of each lamp comes from; below 0 before it. A lamp
        under a dome of radius r is seen some 0.4 r deeper, a disc behind a rim some 0.15 r nearer.
    lamp_depth_sigma_m : float, metres
        Standard error of that depth.
    extra_lights_m : tuple of (float, float, float), metres
        Lamps before or behind the plane of the others, along the dock's x, y and z, as on a rod behind the ring's
        middle: where one is seen tells which of the two poses is right.
    entrance : Entrance, optional
        Where the vehicle shall go in, and along which corridor; one off the dock's axis needs ``lights``, for the roll
        shows by them.

    Raises
    ------
    ValueError
        If the diameter is not a positive number, there are fewer than 3 lights, the number of angles or offsets differs
        from that of the lights, two angles are the same, an offset or the lamps' depth is as large as the radius, an
        extra light lies in the plane of the others or two diameters away, or an entrance is off the axis of a dock of
        unknown lights.

    Examples
    --------
    >>> dock = Dock(diameter=0.30, lights=4)
    >>> dock.light_points().round(3) + 0.0
    array([[ 0.15,  0.  ,  0.  ],
           [ 0.  ,  0.15,  0.  ],
           [-0.15,  0.  ,  0.  ],
           [ 0.  , -0.15,  0.  ]])
    """

    diameter: float = _NOT_GIVEN
    lights: int | None = None
    angles_deg: tuple[float, ...] = ()
    offsets_m: tuple[Vector, ...] = ()
    diameter_sigma_m: float | None = None
    lights_sigma_m: float | None = None
    lamp_depth_m: float = 0.0
    lamp_depth_sigma_m: float = 0.0
    extra_lights_m: tuple[Vector, ...] = ()
    entrance: Entrance | None = None
    # In files of versions that had docks of several rings, or told lights apart by their colours; empty of others.
    _rings: Any = msgspec.UNSET
    _colours: Any = msgspec.UNSET

    if TYPE_CHECKING:  # what is taken is more than what is kept

        def __init__(
            self,
            diameter: float = _NOT_GIVEN,
            lights: int | None = None,
            angles_deg: Sequence[float] | np.ndarray = (),
            offsets_m: Sequence[Sequence[float]] | np.ndarray = (),
            diameter_sigma_m: float | None = None,
            lights_sigma_m: float | None = None,
            lamp_depth_m: float = 0.0,
            lamp_depth_sigma_m: float = 0.0,
            extra_lights_m: Sequence[Sequence[float]] | np.ndarray = (),
            entrance: Entrance | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        if self._rings:
            raise ValueError("rings is given; a dock has one ring: give its diameter_m and lights instead")
        if self._colours:
            raise ValueError("colours is given; lights are told apart by their places alone: leave colours out")
        for name in ("_rings", "_colours"):
            msgspec.structs.force_setattr(self, name, msgspec.UNSET)
        make_plain(self)
        if self.diameter is _NOT_GIVEN:
            raise ValueError("diameter_m is missing; it must be the diameter of the circle through the lights")
        check_number("diameter", self.diameter, above=0)
        if self.lights is None and (self.angles_deg or self.offsets_m):
            msgspec.structs.force_setattr(self, "lights", len(self.angles_deg or self.offsets_m))
        if self.lights is not None:
            check_whole("lights", self.lights, least=3)
        for name in ("angles_deg", "offsets_m"):
            if len(getattr(self, name)) not in (0, self.lights):
                raise ValueError(f"{name} has {len(getattr(self, name))} values; the dock has {self.lights} lights")
        self._check_angles()
        for index, offset in enumerate(self.offsets_m):
            for value in offset:
                check_number(f"offsets_m[{index}]", value)
            if not math.hypot(*offset) < self.radius:
                raise ValueError(f"offsets_m[{index}] is {list(offset)}; it must be below the radius, {self.radius:g}")
        check_number("lamp_depth_m", self.lamp_depth_m)
        if not abs(self.lamp_depth_m) < self.radius:
            raise ValueError(f"lamp_depth_m is {self.lamp_depth_m:g}; it must be below the radius, {self.radius:g}")
        for index, place in enumerate(self.extra_lights_m):
            self._check_extra(f"extra_lights_m[{index}]", place)
        for name in ("diameter_sigma_m", "lights_sigma_m", "lamp_depth_sigma_m"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), least=0)
        if self.entrance is not None and self.lights is None and not self.entrance.is_on_axis:
            raise ValueError("lights is None; an entrance off the dock's axis needs them, for the roll shows by them")

    def with_lights(self, lights: int | None) -> "Dock":
        """Return this dock with another number of lights; None for an unknown one.

        Raises
        ------
        ValueError
            if the dock's angles or offsets are of another number.
        """
        return _with_lights(self, lights)

    def _check_angles(self) -> None:
        for index, angle in enumerate(self.angles_deg):
            check_number(f"angles_deg[{index}]", angle)
        around = sorted(angle % 360 for angle in self.angles_deg)
        for one, other in zip(around, [*around[1:], *(angle + 360 for angle in around[:1])], strict=True):
            if other - one < _CLOSEST_DEG:
                raise ValueError(f"angles_deg has two lights at {one:g} degrees; each must have its own place")

    def _check_extra(self, name: str, place: Vector) -> None:
        if len(place) != 3:
            raise ValueError(f"{name} has {len(place)} values; it must have three")
        for value in place:
            check_number(name, value)
        if not math.hypot(*place) <= _FARTHEST * self.diameter:
            raise ValueError(f"{name} is {list(place)}; it must be within two diameters, {2 * self.diameter:g}")
        if not abs(place[2] - self.lamp_depth_m) >= LEAST_DEPTH * self.diameter:
            raise ValueError(
                f"{name} is {list(place)}; it must be at least {LEAST_DEPTH * self.diameter:g} before or behind the "
                "plane of the lights, or it tells nothing of the two poses"
            )

    @property
    def radius(self) -> float:
        """Half the diameter, in metres."""
        return self.diameter / 2

    def light_angles_rad(self) -> np.ndarray:
        """Angle (lights,) of each light from the dock's x axis towards y; ValueError where their number is unknown."""
        if self.lights is None:
            raise ValueError("lights is None; the number of lights is needed to place them")
        if self.angles_deg:
            return np.radians(self.angles_deg)
        return 2 * math.pi * np.arange(self.lights) / self.lights

    def light_points(self) -> np.ndarray:
        """Positions (lights, 3) in metres in the dock's frame, whose face looks along -z, with depth and offsets."""
        angles = self.light_angles_rad()
        depths = np.full(len(angles), self.lamp_depth_m)
        circle = np.column_stack([self.radius * np.cos(angles), self.radius * np.sin(angles), depths])
        return circle + np.array(self.offsets_m) if self.offsets_m else circle


@lru_cache(maxsize=256)  # where a number is unknown each ring is tried with dozens
def _with_lights(dock: Dock, lights: int | None) -> Dock:
    return msgspec.structs.replace(dock, lights=lights)
