"""The parts of a scene: pose, lights, what surrounds them, and the sensor."""

import math
from typing import ClassVar

import msgspec
from dockpose.checks import check_number, check_one_of, check_whole, make_plain

# Response of the blue, green and red bands to a lamp of each colour.
COLOURS = {"white": (1.0, 1.0, 1.0), "red": (0.02, 0.08, 1.0), "green": (0.10, 1.0, 0.10), "blue": (1.0, 0.15, 0.02)}
SENSOR_COLOURS = ("grey", "bgr", "bayer")
SIDES = {
    "floor": (1, 1.0),
    "left": (0, -1.0),
    "right": (0, 1.0),
    "back": (2, 1.0),
}  # axis and direction from the camera
BITS = (8, 10, 12, 16)


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a scene: checks that its numbers are finite, and not negative unless listed in ``_SIGNED``."""

    _above_0: ClassVar[tuple[str, ...]] = ()  # numbers that may not be 0 either

    def __post_init__(self) -> None:
        make_plain(self)
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, float):
                check_number(name, value, least=-math.inf if name in _SIGNED else 0)
        for name in self._above_0:
            check_number(name, getattr(self, name), above=0)


# Numbers that may be negative.
_SIGNED = frozenset(
    {"theta_x_deg", "theta_y_deg", "roll_deg", "x_px", "y_px", "gradient_x", "gradient_y", "angle_deg"}
    | {"motion_angle_deg", "angles_deg"}
)


class Pose(Part, frozen=True, kw_only=True):
    """Position of the dock in the camera frame and its attitude.

    Parameters
    ----------
    position_m : (float, float, float), metres
        The dock's centre: x to the right, y down, z ahead, which is above 0.
    theta_x_deg, theta_y_deg : float, degrees
        Its pitch and yaw; both are 0 where it is square on.
    roll_deg : float, degrees
        Turn of the ring in its own plane.
    """

    position_m: tuple[float, float, float]
    theta_x_deg: float = 0.0
    theta_y_deg: float = 0.0
    roll_deg: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for axis, value in zip("xyz", self.position_m, strict=True):
            check_number(f"position_m {axis}", value)
        check_number("position_m z", self.position_m[2], above=0)


class Lights(Part, frozen=True, kw_only=True):
    """The dock's lights.

    Parameters
    ----------
    level : float
        Grey level (of 255), before clipping, at the centre of a light's image 1 m ahead in clear water, with the blur
        of the lens.
    radius_m : float, metres
        Radius of one lamp.
    beam_exponent : float
        Intensity falls with this power of the cosine of the angle off the dock's normal: 1 is a Lambertian surface, 0
        shines equally in all directions in front of the dock.
    brightness, size : tuple of float
        Of each light, as a share of ``level`` and ``radius_m``; empty where all are alike.
    colours : tuple of str
        Colour of each light, names in ``COLOURS``; empty where all are white.
    angles_deg : tuple of float, degrees
        Angle of each light around the ring; empty for the dock's own. Others than those describe a dock that was not
        built to its drawing.
    missing : tuple of int
        Numbers of dead lights, counted from 0.
    flicker : float
        Probability that a light is off in a picture.
    rim, dome : float
        Light of a bright rim around each lamp and of the dome over it, as shares of its own; both have its radius.
    """

    level: float = 400.0
    radius_m: float = 0.004
    beam_exponent: float = 1.0
    brightness: tuple[float, ...] = ()
    size: tuple[float, ...] = ()
    colours: tuple[str, ...] = ()
    angles_deg: tuple[float, ...] = ()
    missing: tuple[int, ...] = ()
    flicker: float = 0.0
    rim: float = 0.0
    dome: float = 0.0

    _above_0 = ("radius_m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.flicker > 1:
            raise ValueError(f"flicker is {self.flicker!r}; it is a probability, 0 to 1")
        for name in ("brightness", "size", "angles_deg"):
            for index, value in enumerate(getattr(self, name)):
                check_number(f"{name}[{index}]", value, least=-math.inf if name in _SIGNED else 0)
        for index, colour in enumerate(self.colours):
            check_one_of(f"colours[{index}]", colour, COLOURS)


class Glare(Part, frozen=True, kw_only=True):
    """A bright patch of the background: a Gaussian of standard deviation ``size_px`` around a point of the picture."""

    x_px: float
    y_px: float
    size_px: float
    level: float


class Background(Part, frozen=True, kw_only=True):
    """The picture without lights."""

    level: float = 12.0  # grey level at the centre of the picture
    gradient_x: float = 0.0  # change of the level across the width
    gradient_y: float = 0.0  # change of the level across the height
    backscatter_level: float = 0.0  # veil of the vehicle's own lamp in very deep water, brightest at the centre
    glares: tuple[Glare, ...] = ()  # bright patches
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)  # response of the blue, green and red bands to all of it

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in zip(("blue", "green", "red"), self.colour, strict=True):
            check_number(f"background colour {name}", value, least=0)


class Panel(Part, frozen=True, kw_only=True):
    """A square plate in the dock's plane, behind the lights, that hides the background."""

    size_m: float
    level: float = 5.0


class Snow(Part, frozen=True, kw_only=True):
    """Marine snow: particles about ``size_px`` in size with a brightness of up to ``level``."""

    count: int
    level: float = 60.0
    size_px: float = 1.2

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole("snow count", self.count, least=0)


class Mirror(Part, frozen=True, kw_only=True):
    """The water's surface at ``height_m`` above the camera, tilted by ripples."""

    height_m: float
    ripple_deg: float = 0.5


class Wall(Part, frozen=True, kw_only=True):
    """A side of the tank at ``distance_m`` from the camera that mirrors a ``share`` of the light, smeared as if tilted.

    ``side`` is "floor", "left" or "right"; ``rough_deg`` is the tilt of its surface.
    """

    side: str
    distance_m: float
    share: float = 0.1
    rough_deg: float = 1.0

    _above_0 = ("distance_m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_one_of("wall side", self.side, SIDES)
        if self.share > 1:
            raise ValueError(f"wall share is {self.share!r}; it must be within 0 to 1")


class Lamp(Part, frozen=True, kw_only=True):
    """Another lamp, which shines equally in all directions; ``level`` and ``radius_m`` as for the dock's lights."""

    position_m: tuple[float, float, float]
    level: float = 400.0
    radius_m: float = 0.004

    def __post_init__(self) -> None:
        super().__post_init__()
        for axis, value in zip("xyz", self.position_m, strict=True):
            check_number(f"lamp position_m {axis}", value)


class Occluder(Part, frozen=True, kw_only=True):
    """A bar in front of everything: centre, size, rotation and grey level in the picture."""

    x_px: float
    y_px: float
    width_px: float
    height_px: float
    angle_deg: float = 0.0
    level: float = 5.0


class Text(Part, frozen=True, kw_only=True):
    """Letters burnt into the picture by the camera; (x, y) is their upper left corner."""

    text: str
    x_px: float
    y_px: float
    height_px: float = 16.0
    level: float = 255.0


class Sensor(Part, frozen=True, kw_only=True):
    """The camera's sensor, and what happens to the picture before it is stored.

    Parameters
    ----------
    exposure, gain : float
        Factors on the light, and on the light together with its noise.
    electrons_per_level : float
        Photoelectrons per grey level (of 255) at gain 1, which determine the shot noise.
    read_noise_levels : float
        Standard deviation of the read noise, in grey levels at gain 1.
    mean_level : float, optional
        Grey level (of 255) that automatic exposure brings the picture's mean to, by up to 64 times more or less light
        than ``exposure``; None for none.
    vignetting : float
        Share of the light lost in the corners, 0 to 1.
    blur_px : float, pixels
        Standard deviation of the lens blur.
    motion_blur_px, motion_angle_deg : float, pixels and degrees
        Length of the motion during the exposure, and its direction from the x axis towards y.
    bits : {8, 10, 12, 16}
        Bits per pixel.
    colour : {"grey", "bgr", "bayer"}
        Colours of the picture; "bayer" is a colour mosaic interpolated to BGR.
    sharpening, sharpening_px : float, and pixels
        How strongly the camera sharpens: so many times what a blur of this standard deviation takes away is added,
        which leaves dark halos around lamps.
    jpeg_quality : int, optional
        1 to 100, for 8 bits; None for lossless storage.
    """

    exposure: float = 1.0
    gain: float = 1.0
    electrons_per_level: float = 40.0
    read_noise_levels: float = 1.0
    mean_level: float | None = None
    vignetting: float = 0.0
    blur_px: float = 0.8
    motion_blur_px: float = 0.0
    motion_angle_deg: float = 0.0
    bits: int = 8
    colour: str = "grey"
    sharpening: float = 0.0
    sharpening_px: float = 1.5
    jpeg_quality: int | None = None

    _above_0 = ("exposure", "gain", "electrons_per_level", "blur_px", "sharpening_px")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.vignetting > 1:
            raise ValueError(f"vignetting is {self.vignetting!r}; it must be within 0 to 1")
        if self.mean_level is not None and not 0 < self.mean_level < 255:
            raise ValueError(f"mean_level is {self.mean_level!r}; it must be above 0 and below 255")
        check_one_of("bits", self.bits, BITS)
        check_one_of("colour", self.colour, SENSOR_COLOURS)
        if self.jpeg_quality is not None:
            if self.bits != 8:
                raise ValueError(f"jpeg_quality is {self.jpeg_quality!r} with {self.bits} bits; JPEG stores 8")
            if not 1 <= self.jpeg_quality <= 100:
                raise ValueError(f"jpeg_quality is {self.jpeg_quality!r}; it must be within 1 to 100")
