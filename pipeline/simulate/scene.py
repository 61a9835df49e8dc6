"""Everything that a simulated picture shows, with every number in one place."""

import math

import msgspec
from dockpose.camera.camera import Camera
from dockpose.checks import check_whole
from dockpose.dock import Dock
from dockpose.simulate import parts
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.optics.water import PRESETS, Water, preset


class Scene(parts.Part, frozen=True, kw_only=True):
    """One picture to simulate; each part is described by its own class.

    ``water`` may also be given as the name of a preset, such as "harbour".

    Parameters
    ----------
    camera, dock, pose : Camera, Dock, Pose
        What takes the picture; what it shows, with a known number of lights; where that is.
    lights, water, psf : Lights, Water, Psf
        How bright and large the dock's lights are, what absorbs and scatters their light, and how that spreads.
    background : Background
        The water's own brightness, glares and haze.
    panel, snow, mirror : Panel, Snow, Mirror or None
        The plate behind the lights, bright specks, and the water's surface, which shows the ring a second time.
    lamps, occluders, texts : tuples of Lamp, Occluder, Text
        Lights that are not the dock's, what hides parts of the picture, and words burnt into it.
    sensor : Sensor
        Exposure, noise, blur, bits and colours.
    seed : int
        Of all that is random; the same seed gives the same picture.

    Raises
    ------
    ValueError
        If a part is of the wrong class, a number is negative or not finite where it may not be, the dock is behind the
        camera or its number of lights is unknown, or a list about the lights does not have one entry per light.

    Examples
    --------
    >>> camera = Camera(fx=700, fy=700, cx=319.5, cy=239.5, width=640, height=480)
    >>> pose = parts.Pose(position_m=(0.0, 0.0, 2.0), theta_y_deg=15.0)
    >>> scene = Scene(camera=camera, dock=Dock(0.30, lights=10), pose=pose, water="harbour")
    >>> scene.water.scattering_per_m
    1.824
    """

    camera: Camera
    dock: Dock
    pose: parts.Pose
    lights: parts.Lights = parts.Lights()
    water: Water = PRESETS["tank"]
    psf: Psf = Psf()
    background: parts.Background = parts.Background()
    panel: parts.Panel | None = None
    snow: parts.Snow | None = None
    mirror: parts.Mirror | None = None
    lamps: tuple[parts.Lamp, ...] = ()
    occluders: tuple[parts.Occluder, ...] = ()
    texts: tuple[parts.Text, ...] = ()
    sensor: parts.Sensor = parts.Sensor()
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole("seed", self.seed, least=0)
        if isinstance(self.water, str):
            msgspec.structs.force_setattr(self, "water", preset(self.water))
        for name, kind in _KINDS.items():
            if not isinstance(getattr(self, name), kind):
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must be of the class {kind.__name__}")
        if self.dock.lights is None:
            raise ValueError("dock.lights is None; a simulated dock needs its number of lights")
        for name in ("brightness", "size", "colours", "angles_deg"):
            count = len(getattr(self.lights, name))
            if count not in (0, self.light_count):
                raise ValueError(f"lights.{name} has {count} values; the dock has {self.light_count} lights")
        if self.lights.angles_deg and self.dock.rings:
            raise ValueError("lights.angles_deg does not go with dock.rings, each of which has its own")
        for number in self.lights.missing:
            if not 0 <= number < self.light_count:
                raise ValueError(f"lights.missing has {number}; the lights are counted 0 to {self.light_count - 1}")

    @property
    def light_count(self) -> int:
        """How many lights the dock has, on all of its rings."""
        return sum(ring.lights or 0 for ring in self.dock.rings or (self.dock,))

    @property
    def light_angles_rad(self) -> tuple[float, ...]:
        """Angle of each light around the ring, before the dock's roll."""
        if self.lights.angles_deg:
            return tuple(math.radians(angle) for angle in self.lights.angles_deg)
        return tuple(self.dock.light_angles_rad().tolist())

    @property
    def light_colours(self) -> tuple[str, ...]:
        """Name of each light's colour."""
        if self.lights.colours:
            return self.lights.colours
        each = [ring.colours or ("white",) * (ring.lights or 0) for ring in self.dock.rings or (self.dock,)]
        return tuple(colour for colours in each for colour in colours)


# The parts that every scene has.
_KINDS = {field.name: field.type for field in msgspec.structs.fields(Scene) if isinstance(field.type, type)}
