"""Everything that a simulated picture shows, with every number in one place, and the truth of it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_whole
from dockpose.dock import Dock
from dockpose.lights.ellipse import Ellipse, NoEllipseError, fit_ellipse
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate import parts
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.optics.water import PRESETS, Water, preset
from dockpose.simulate.parts import Occluder


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
    walls : tuple of Wall
        The tank's floor and walls, which do so dimly.
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
    walls: tuple[parts.Wall, ...] = ()
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
            if count not in (0, self.dock.lights):
                raise ValueError(f"lights.{name} has {count} values; the dock has {self.dock.lights} lights")
        for number in self.lights.missing:
            if not 0 <= number < self.dock.lights:
                raise ValueError(f"lights.missing has {number}; the lights are counted 0 to {self.dock.lights - 1}")

    @property
    def light_angles_rad(self) -> tuple[float, ...]:
        """Angle of each light around the ring, before the dock's roll."""
        if self.lights.angles_deg:
            return tuple(math.radians(angle) for angle in self.lights.angles_deg)
        return tuple(self.dock.light_angles_rad().tolist())

    @property
    def light_colours(self) -> tuple[str, ...]:
        """Name of each light's colour."""
        return self.lights.colours or ("white",) * (self.dock.lights or 0)


# The parts that every scene has.
_KINDS = {field.name: field.type for field in msgspec.structs.fields(Scene) if isinstance(field.type, type)}


_CIRCLE_POINTS = 360  # of which the ellipse is fitted
_DECIMALS = 9  # in files; leaves out the last digits, which differ between machines' linear algebra


@dataclass(frozen=True)
class Truth:
    """The truth of a picture.

    Attributes
    ----------
    position_m : (3,) float array, metres
        The dock's centre in the camera frame.
    normal : (3,) float array
        Unit normal of the dock's face in the camera frame.
    lights_m, lights_px : (N, 3) and (N, 2) float arrays, metres and pixels
        The lights in the camera frame, and their images; NaN for those behind the camera.
    lit, visible : (N,) bool arrays
        Neither missing nor off in this picture; lit, facing the camera, inside the picture and not hidden.
    centre_px : (2,) float array, pixels
        Image of the dock's centre.
    ellipse : Ellipse or None
        Image of the circle through the lights, in pixels of the undistorted picture, computed from the circle itself;
        None where the circle is not entirely in front of the camera.
    """

    position_m: np.ndarray
    normal: np.ndarray
    lights_m: np.ndarray
    lights_px: np.ndarray
    lit: np.ndarray
    visible: np.ndarray
    centre_px: np.ndarray
    ellipse: Ellipse | None


def truth_of(scene: Scene) -> Truth:
    """Compute what the picture of ``scene`` shows, without rendering it.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    Truth
        Where the dock, its lights and their ellipse are, in space and in the picture.
    """
    rotation = dock_rotation(scene)
    position = np.array(scene.pose.position_m)
    ring_m = position + scene.dock.lamp_depth_m * rotation[:, 2]
    lights_m = _on_ring(scene, np.array(scene.light_angles_rad), ring_m, rotation)
    lights_m += np.array(scene.dock.offsets_m or np.zeros(3)) @ rotation.T
    lights_px = scene.camera.project(lights_m)
    normal = -rotation[:, 2]
    lit = random_stream(scene, "flicker").random(len(lights_m)) >= scene.lights.flicker
    lit[list(scene.lights.missing)] = False
    facing = lights_m @ normal < 0
    inside = ((lights_px > -0.5) & (lights_px < np.array([scene.camera.width, scene.camera.height]) - 0.5)).all(axis=1)
    visible = lit & facing & inside & ~_hidden(lights_px, scene.occluders)
    ellipse = _circle_image(scene, ring_m, rotation)
    centre_px = scene.camera.project(position[None])[0]
    return Truth(position, normal, lights_m, lights_px, lit, visible, centre_px, ellipse)


def dock_rotation(scene: Scene) -> np.ndarray:
    """Rotation (3, 3) from the dock's frame to the camera's, roll included."""
    pose = scene.pose
    return rotation_from_angles(*map(math.radians, (pose.theta_x_deg, pose.theta_y_deg, pose.roll_deg)))


def truth_dict(scene: Scene, truth: Truth) -> dict[str, Any]:
    """The truth as plain values with their units in the names, for a file; None for what has no image."""
    ellipse = truth.ellipse
    return {
        "position_m": _numbers(truth.position_m),
        "normal": _numbers(truth.normal),
        "theta_x_deg": scene.pose.theta_x_deg,
        "theta_y_deg": scene.pose.theta_y_deg,
        "roll_deg": scene.pose.roll_deg,
        "centre_px": _numbers(truth.centre_px),
        "lights_px": [_numbers(point) for point in truth.lights_px],
        "visible": truth.visible.tolist(),
        "ellipse": None
        if ellipse is None
        else {
            "centre_px": _numbers(ellipse.centre_px),
            "semi_axes_px": _numbers(ellipse.semi_axes_px),
            "angle_deg": round(math.degrees(ellipse.angle_rad), _DECIMALS),
        },
    }


def random_stream(scene: Scene, name: str) -> np.random.Generator:
    """Random numbers for one part of a scene; changing one part leaves the others' numbers unchanged."""
    return np.random.default_rng([scene.seed, *name.encode()])


def _on_ring(scene: Scene, angles: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return position + scene.dock.radius * ring @ rotation.T


def _circle_image(scene: Scene, position: np.ndarray, rotation: np.ndarray) -> Ellipse | None:
    angles = np.linspace(0, 2 * np.pi, _CIRCLE_POINTS, endpoint=False)
    image = scene.camera.project(_on_ring(scene, angles, position, rotation))
    if not np.isfinite(image).all():
        return None
    try:
        return fit_ellipse(scene.camera.undistort(image))
    except NoEllipseError:
        return None


def _hidden(points_px: np.ndarray, occluders: tuple[Occluder, ...]) -> np.ndarray:
    hidden = np.zeros(len(points_px), dtype=bool)
    for bar in occluders:
        angle = math.radians(bar.angle_deg)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        local = np.abs((points_px - [bar.x_px, bar.y_px]) @ turn.T)
        hidden |= (local <= [bar.width_px / 2, bar.height_px / 2]).all(axis=1)
    return hidden


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [round(float(value), _DECIMALS) if math.isfinite(value) else None for value in values]
