"""The dock: a circle of known diameter with lights around its rim."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from dockpose.checks import check_number, check_one_of, check_whole, make_plain, shown

LIGHT_COLOURS = ("white", "red", "green", "blue")
_CLOSEST_DEG = 0.5  # two lights closer together than this are the same
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
        check_vectors(self, "position_m", "normal")
        for name in ("radius_m", "cone_deg", "standoff_m"):
            check_number(name, getattr(self, name), least=0)
        if self.cone_deg >= 90:
            raise ValueError(f"cone_deg is {self.cone_deg:g}; it must be below 90")

    @property
    def is_on_axis(self) -> bool:
        """Whether it looks the same however the dock is rolled."""
        return is_on_axis(self.position_m, self.normal)


def check_vectors(of: msgspec.Struct, place: str, direction: str) -> None:
    """Raise a ValueError unless one attribute is a place of three numbers, and another a direction that is not zero."""
    for name in (place, direction):
        if len(getattr(of, name)) != 3:
            raise ValueError(f"{name} has {len(getattr(of, name))} values; it must have three")
        for axis, value in zip("xyz", getattr(of, name), strict=True):
            check_number(f"{name} {axis}", value)
    if math.hypot(*getattr(of, direction)) < 1e-9:
        raise ValueError(f"{direction} is {list(getattr(of, direction))}; it must have a length")


def is_on_axis(position_m: Vector, normal: Vector) -> bool:
    """Whether a place and a direction are on a dock's axis, so that no roll moves them."""
    return not any((*position_m[:2], *normal[:2]))


class LightRing(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"diameter": "diameter_m"}):
    """What a dock and each of its rings have: a circle of lights."""

    diameter: float = _NOT_GIVEN
    lights: int | None = None
    angles_deg: tuple[float, ...] = ()
    colours: tuple[str, ...] = ()
    offsets_m: tuple[Vector, ...] = ()
    diameter_sigma_m: float | None = None
    lights_sigma_m: float | None = None
    lamp_depth_m: float = 0.0
    lamp_depth_sigma_m: float = 0.0

    def __post_init__(self) -> None:
        make_plain(self)
        if self.diameter is _NOT_GIVEN:
            raise ValueError("diameter_m is missing; it must be the diameter of the circle through the lights")
        check_number("diameter", self.diameter, above=0)
        if self.lights is None and (self.angles_deg or self.colours or self.offsets_m):
            msgspec.structs.force_setattr(self, "lights", len(self.angles_deg or self.colours or self.offsets_m))
        if self.lights is not None:
            check_whole("lights", self.lights, least=3)
        for name in ("angles_deg", "colours", "offsets_m"):
            if len(getattr(self, name)) not in (0, self.lights):
                raise ValueError(f"{name} has {len(getattr(self, name))} values; the dock has {self.lights} lights")
        self._check_angles()
        for index, offset in enumerate(self.offsets_m):
            for value in offset:
                check_number(f"offsets_m[{index}]", value)
            if not math.hypot(*offset) < self.radius:
                raise ValueError(f"offsets_m[{index}] is {list(offset)}; it must be below the radius, {self.radius:g}")
        for index, colour in enumerate(self.colours):
            check_one_of(f"colours[{index}]", colour, LIGHT_COLOURS)
        check_number("lamp_depth_m", self.lamp_depth_m)
        if not abs(self.lamp_depth_m) < self.radius:
            raise ValueError(f"lamp_depth_m is {self.lamp_depth_m:g}; it must be below the radius, {self.radius:g}")
        for name in ("diameter_sigma_m", "lights_sigma_m", "lamp_depth_sigma_m"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), least=0)

    def _check_angles(self) -> None:
        for index, angle in enumerate(self.angles_deg):
            check_number(f"angles_deg[{index}]", angle)
        around = sorted(angle % 360 for angle in self.angles_deg)
        for one, other in zip(around, [*around[1:], *(angle + 360 for angle in around[:1])], strict=True):
            if other - one < _CLOSEST_DEG:
                raise ValueError(f"angles_deg has two lights at {one:g} degrees; each must have its own place")

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


class DockRing(LightRing, frozen=True, kw_only=True):
    """One of a dock's rings.

    Parameters
    ----------
    diameter : float, metres
        As of a :class:`Dock`, and so are all others up to the name, in the ring's own frame.
    lights : int
        Their number, which must be known.
    angles_deg : tuple of float, degrees
        Of the lights, around the ring.
    colours : tuple of str
        Of the lights.
    offsets_m : tuple of (float, float, float), metres
        Of the lights from their places.
    diameter_sigma_m, lights_sigma_m : float, metres, optional
        Standard errors of the diameter and of the lights' places.
    lamp_depth_m, lamp_depth_sigma_m : float, metres
        How far behind the circle they are seen, and its standard error.
    name : str
        By which results name it.
    position_m : (float, float, float), metres
        Its centre in the dock's frame.
    normal : (float, float, float)
        Of its face there, of any length; (0, 0, -1) looks straight out of the dock.

    Raises
    ------
    ValueError
        As of a dock.
    """

    name: str
    position_m: Vector = (0.0, 0.0, 0.0)
    normal: Vector = (0.0, 0.0, -1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_vectors(self, "position_m", "normal")
        if not self.name:
            raise ValueError("name is empty; each ring of a dock has one")
        if self.lights is None:
            raise ValueError(
                f"lights of the ring {shown(self.name)} is None; those of each of a dock's rings are needed"
            )

    @property
    def dock(self) -> "Dock":
        """The ring by itself, as a dock in its own frame."""
        return _alone(self)

    @property
    def frame(self) -> np.ndarray:
        """Rotation (3, 3) from its own frame to the dock's."""
        return frame_of(self.normal)


@lru_cache(maxsize=64)
def _alone(ring: DockRing) -> "Dock":
    return Dock(**{name: getattr(ring, name) for name in LightRing.__struct_fields__})


def frame_of(normal: Vector) -> np.ndarray:
    """Rotation (3, 3) to the dock's frame from one whose face looks along a normal (3,), turned the shortest way."""
    out = np.array(normal) / math.hypot(*normal)
    if out[2] > 1 - 1e-12:
        return np.diag([-1.0, 1.0, -1.0])
    # Two reflections are a rotation: -z, the face's own normal, is turned about, and then brought to this one.
    half = out - [0.0, 0.0, 1.0]
    half /= np.linalg.norm(half)
    return (np.eye(3) - 2 * np.outer(half, half)) @ np.diag([1.0, 1.0, -1.0])


class Dock(LightRing, frozen=True):
    """A ring of lights, or several.

    Parameters
    ----------
    diameter : float, metres
        Diameter of the circle through the lights, above 0.
    lights : int, optional
        Number of lights, at least 3; None where it is not known.
    angles_deg : tuple of float, degrees
        Angle of each light around the ring, see :meth:`light_points`; empty where they are evenly spaced.
    colours : tuple of str
        Colour of each light, names in ``LIGHT_COLOURS``; empty where all are alike.
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
    entrance : Entrance, optional
        Where the vehicle shall go in, and along which corridor; one off the dock's axis needs ``lights``, for the roll
        shows by them.
    rings : tuple of DockRing
        Where the dock has several rings, all of them; ``diameter``, ``lights`` and so on are then the largest one's.

    Raises
    ------
    ValueError
        If the diameter is not a positive number, there are fewer than 3 lights, the number of angles, colours or
        offsets differs from that of the lights, two angles are the same, a colour is unknown, or an offset or the
        lamps' depth is as large as the radius, an entrance is off the axis of a dock of unknown lights, two rings have
        one name, or the diameter is not the largest ring's.

    Examples
    --------
    >>> dock = Dock(diameter=0.30, lights=4)
    >>> dock.light_points().round(3) + 0.0
    array([[ 0.15,  0.  ,  0.  ],
           [ 0.  ,  0.15,  0.  ],
           [-0.15,  0.  ,  0.  ],
           [ 0.  , -0.15,  0.  ]])
    """

    entrance: Entrance | None = None
    rings: tuple[DockRing, ...] = ()

    if TYPE_CHECKING:  # what is taken is more than what is kept

        def __init__(
            self,
            diameter: float = _NOT_GIVEN,
            lights: int | None = None,
            angles_deg: Sequence[float] | np.ndarray = (),
            colours: Sequence[str] = (),
            offsets_m: Sequence[Sequence[float]] | np.ndarray = (),
            diameter_sigma_m: float | None = None,
            lights_sigma_m: float | None = None,
            lamp_depth_m: float = 0.0,
            lamp_depth_sigma_m: float = 0.0,
            entrance: Entrance | None = None,
            rings: Sequence[DockRing] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        if self.rings:
            self._take_largest()
        super().__post_init__()
        if self.entrance is not None and self.lights is None and not self.entrance.is_on_axis:
            raise ValueError("lights is None; an entrance off the dock's axis needs them, for the roll shows by them")

    def _take_largest(self) -> None:
        names = [ring.name for ring in self.rings]
        if len({*names}) < len(names):
            raise ValueError(f"rings are called {', '.join(map(shown, names))}; each must have a name of its own")
        largest = max(self.rings, key=lambda ring: ring.diameter)
        if self.diameter is not _NOT_GIVEN and self.diameter != largest.diameter:
            own = f"it must be that of the largest ring, {largest.diameter:g}, or be left out"
            raise ValueError(f"diameter is {shown(self.diameter)}; {own}")
        for name in LightRing.__struct_fields__:
            msgspec.structs.force_setattr(self, name, getattr(largest, name))
        msgspec.structs.force_setattr(self, "rings", tuple(self.rings))

    def every_light_point(self) -> np.ndarray:
        """Positions (N, 3) in metres, in the dock's frame, of the lights of all its rings, in their order."""
        if not self.rings:
            return self.light_points()
        return np.concatenate([ring.light_points() @ ring.frame.T + ring.position_m for ring in self.rings])
