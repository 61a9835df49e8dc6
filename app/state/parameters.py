"""Every number that a slider sets, one row each: label, hint, unit, range, and where it lives in the view.

Numbers from a browser pass through :func:`put`, which brings them into range and refuses what is no number.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from dockpose import Camera
from dockpose.app.errors import UserError
from dockpose.app.state.camera import DEFAULT_PORT, coefficients_of, with_coefficient
from dockpose.app.state.scene import DEFAULT_SCENE, turbidity_of, with_scene
from dockpose.app.state.view import View
from dockpose.simulate.optics.water import water_of_turbidity
from dockpose.simulate.parts import Mirror, Snow
from dockpose.thresholds import LEVELS
from msgspec.structs import replace as changed

_IF_NONE = {"port": DEFAULT_PORT, "scene": DEFAULT_SCENE}


@dataclass(frozen=True)
class Limits:
    """The range of a slider, and its step."""

    low: float
    high: float
    step: float

    def clamp(self, value: float) -> float:
        """Bring a number into the range."""
        return min(max(value, self.low), self.high)


@dataclass(frozen=True)
class Parameter:
    """One number of a view."""

    label: str  # as the page shows it
    hint: str  # likewise
    path: str  # what holds the number, as "camera.fx" or "scene.pose.position_m.2"
    limits: Limits | Callable[[View], Limits]  # range in the label's unit, or a function that returns it for a view
    scale: float = 1  # how many times as large as the stored number people see it
    whole: bool = False  # whether to round to whole numbers
    # in place of ``scale``: ``shown(part)`` is the number for what is at ``path``, and ``stored(number, part)`` is what
    # to put there for a number
    shown: Callable[[Any], float] | None = None
    stored: Callable[[float, Any], Any] | None = None

    def range(self, view: View) -> Limits:
        """Return the limits; they depend on what came with the picture, not on where the slider stands."""
        return self.limits(view) if callable(self.limits) else self.limits

    def get(self, view: View) -> float:
        """Return the number in the label's unit."""
        part: Any = view
        for name in self.path.split("."):
            part = _part(part, name)
        return self.scale * part if self.shown is None else self.shown(part)

    def put(self, view: View, value: Any) -> View:
        """Return a view with another number, in the label's unit, clamped to the range."""
        number = self.range(view).clamp(checked_number(self.label, value))
        number = round(number) if self.whole else number / self.scale
        stored = self.stored or (lambda number, part: number)
        return _with_part(view, self.path.split("."), partial(stored, number))


def put(view: View, name: str, value: Any) -> View:
    """Set the parameter called ``name`` in ``PARAMETERS``, see :meth:`Parameter.put`."""
    if name not in PARAMETERS:
        raise UserError(f"There is no number called {name!r}.")
    return PARAMETERS[name].put(view, value)


def checked_number(name: str, value: Any) -> float:
    """Return a value from the page as a finite number."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise UserError(f"{name} is {value!r}; it must be a number.")
    return float(value)


def _part(owner: Any, name: str) -> Any:
    part = owner[int(name)] if name.isdigit() else getattr(owner, name)
    return _IF_NONE.get(name) if part is None else part


def _with_part(owner: Any, names: list[str], convert: Callable[[Any], Any]) -> Any:
    name, *rest = names
    old = _part(owner, name)
    new = _with_part(old, rest, convert) if rest else convert(old)
    if isinstance(owner, tuple):
        return (*owner[: int(name)], new, *owner[int(name) + 1 :])
    if not isinstance(owner, View):
        return changed(owner, **{name: new})
    return with_scene(owner, new) if name == "scene" else replace(owner, **{name: new})


def _lens(name: str, limits_of: Callable[[Camera], Limits], hint: str) -> Parameter:
    """A number of the camera within limits that depend on the given camera, and always include its own."""

    def limits(view: View) -> Limits:
        usual, given = limits_of(view.given_camera), getattr(view.given_camera, name)
        return Limits(min(usual.low, given), max(usual.high, given), usual.step)

    return Parameter(f"{name} (px)", hint, f"camera.{name}", limits)


def _focal(camera: Camera) -> Limits:
    """Fields of view from 136 to 11 degrees."""
    return Limits(0.2 * camera.width, 5.0 * camera.width, 1.0)


def _diameter_limits(view: View) -> Limits:
    """1 cm to 3 m; more where the given dock is larger."""
    given = 100 * view.given_dock.diameter
    return Limits(min(1.0, given), max(300.0, 2 * given), 0.1)


def _distortion(index: int, usual: float, name: str, hint: str) -> Parameter:
    """A coefficient up to ``usual`` to either side; more where the given camera has more."""

    def limits(view: View) -> Limits:
        most = max(usual, 2 * abs(coefficients_of(view.given_camera)[index]))
        return Limits(-most, most, 0.0005)

    def stored(number: float, camera: Camera) -> Camera:
        return with_coefficient(camera, index, number)

    return Parameter(name, hint, "camera", limits, shown=lambda camera: coefficients_of(camera)[index], stored=stored)


def _with_snow(number: float, snow: Snow | None) -> Snow | None:
    return changed(snow or Snow(count=0), count=number) if number > 0 else None


def _with_surface(number: float, mirror: Mirror | None) -> Mirror | None:
    return changed(mirror or Mirror(height_m=0.0), height_m=number / 100) if number > 0 else None


LENS = {
    "fx": _lens(
        "fx",
        _focal,
        "Focal length in pixels, horizontally. Larger: a narrower view, so the dock is taken to be further away.",
    ),
    "fy": _lens("fy", _focal, "Focal length in pixels, vertically. Nearly the same as fx in most cameras."),
    "cx": _lens(
        "cx",
        lambda camera: Limits(0.0, camera.width - 1.0, 0.5),
        "Where the optical axis meets the picture, in pixels from the left. Usually near the middle.",
    ),
    "cy": _lens(
        "cy",
        lambda camera: Limits(0.0, camera.height - 1.0, 0.5),
        "Where the optical axis meets the picture, in pixels from the top. Usually near the middle.",
    ),
}
_GROWS = "Distortion that grows with the {} power of the distance from the middle; no unit."
DISTORTION = {  # in OpenCV's order; a fisheye lens has four of its own instead
    "k1": _distortion(0, 1.0, "k1", "Barrel (below 0) or pincushion (above 0) distortion; no unit."),
    "k2": _distortion(1, 2.0, "k2", _GROWS.format("fourth")),
    "p1": _distortion(2, 0.1, "p1", "Lens tilted against the sensor, up and down; no unit."),
    "p2": _distortion(3, 0.1, "p2", "Lens tilted against the sensor, sideways; no unit."),
    "k3": _distortion(4, 2.0, "k3", _GROWS.format("sixth")),
}
PORT = {
    "air_gap_mm": Parameter(
        "Air gap (mm)",
        "From the lens's centre of projection to the window.",
        "camera.port.air_gap_m",
        Limits(0, 300, 0.5),
        scale=1000,
    ),
    "glass_mm": Parameter(
        "Window (mm)", "Thickness of the window.", "camera.port.glass_m", Limits(0, 100, 0.5), scale=1000
    ),
    "glass_index": Parameter(
        "Window index", "Refractive index of the window; no unit.", "camera.port.glass_index", Limits(1.3, 2.0, 0.001)
    ),
    "water_index": Parameter(
        "Water index", "Refractive index of the water; no unit.", "camera.port.water_index", Limits(1.3, 1.4, 0.001)
    ),
}
DOCK = {
    "diameter_cm": Parameter(
        "Diameter (cm)",
        "Of the dock: the circle through the middles of the lights, measured on the dock.",
        "dock.diameter",
        _diameter_limits,
        scale=100,
    ),
}
DETECTION = {
    "level": Parameter(
        "Level (0-255)",
        "Pixels at least this bright count as light. It follows the method; move it and it stays fixed there.",
        "settings.level",
        Limits(0, LEVELS - 1, 1),
        whole=True,
    ),
    "min_area_px": Parameter(
        "Min. area (px)",
        "Groups of fewer bright pixels than this are taken for noise.",
        "settings.min_area_px",
        Limits(1, 1000, 1),
        whole=True,
    ),
}
_SIDEWAYS, _ANGLE = Limits(-200, 200, 0.5), Limits(-85, 85, 0.5)
SCENE_POSE = {
    "x_cm": Parameter(
        "Dock x (cm)",
        "How far the dock's centre is to the right of the camera's axis.",
        "scene.pose.position_m.0",
        _SIDEWAYS,
        scale=100,
    ),
    "y_cm": Parameter(
        "Dock y (cm)",
        "How far the dock's centre is below the camera's axis.",
        "scene.pose.position_m.1",
        _SIDEWAYS,
        scale=100,
    ),
    "z_cm": Parameter(
        "Dock z (cm)", "How far ahead the dock is.", "scene.pose.position_m.2", Limits(10, 2000, 1), scale=100
    ),
    "theta_x_deg": Parameter(
        "Dock θx (°)", "Pitch of the dock's face; 0 is square on.", "scene.pose.theta_x_deg", _ANGLE
    ),
    "theta_y_deg": Parameter(
        "Dock θy (°)", "Yaw of the dock's face; 0 is square on.", "scene.pose.theta_y_deg", _ANGLE
    ),
    "roll_deg": Parameter(
        "Dock roll (°)",
        "Turns the ring in its own plane; no estimate can see it.",
        "scene.pose.roll_deg",
        Limits(-180, 180, 1),
    ),
}
SCENE_WATER = {
    "turbidity": Parameter(
        "Turbidity (0-1)",
        "0: Petzold's clear water, 0.33: tank, 0.67: coastal, 1: harbour.",
        "scene.water",
        Limits(0, 1, 0.01),
        shown=turbidity_of,
        stored=lambda number, water: water_of_turbidity(number),
    ),
    "light": Parameter(
        "Light (10^ grey)",
        "Power of ten of the grey level that a light's middle would show 1 m ahead in clear water; 255 is white.",
        "scene.lights.level",
        Limits(1, 6, 0.05),
        shown=lambda level: math.log10(max(level, 10)),
        stored=lambda number, level: 10**number,
    ),
    "ambient": Parameter(
        "Ambient (grey)",
        "Grey level, 0 to 255, of the water without lamps.",
        "scene.background.level",
        Limits(0, 200, 1),
    ),
    "veil": Parameter(
        "Lamp veil (grey)",
        "Grey level of the haze that the vehicle's own lamp makes in the middle of the picture.",
        "scene.background.backscatter_level",
        Limits(0, 200, 1),
    ),
}
SCENE_DISTURBANCES = {
    "noise": Parameter(
        "Noise (grey)",
        "Standard deviation of the sensor's own noise.",
        "scene.sensor.read_noise_levels",
        Limits(0, 30, 0.5),
    ),
    "snow": Parameter(
        "Snow (count)",
        "Marine snow: drifting particles that shine.",
        "scene.snow",
        Limits(0, 1000, 10),
        whole=True,
        shown=lambda snow: 0 if snow is None else snow.count,
        stored=_with_snow,
    ),
    "surface_cm": Parameter(
        "Surface (cm up)",
        "Height of the water's surface above the camera, which mirrors the lights; 0: no surface near.",
        "scene.mirror",
        Limits(0, 300, 1),
        shown=lambda mirror: 0 if mirror is None else 100 * mirror.height_m,
        stored=_with_surface,
    ),
}
SCENE = SCENE_POSE | SCENE_WATER | SCENE_DISTURBANCES
PARAMETERS = LENS | DISTORTION | PORT | DOCK | DETECTION | SCENE
