"""Every number that a slider sets, by static/sliders.toml: brought into range, and refused where it is none."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from typing import Any

from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.resources import read_toml
from dockpose.app.state.camera import DEFAULT_PORT, coefficients_of, with_coefficient
from dockpose.app.state.scene import DEFAULT_SCENE, turbidity_of, water_at, with_scene
from dockpose.app.state.view import View
from dockpose.simulate.parts import Mirror, Snow
from msgspec.structs import replace as changed

LEAST_LIGHTS = 3
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
    needs: str = ""  # what there must be for it to be set, as "camera.port"
    around: bool = False  # whether its slider reaches a fifth to either side of what was given; more can be typed
    # in place of ``scale``: ``shown(part)`` is the number for what is at ``path``, and ``stored(number, part)`` is what
    # to put there for a number
    shown: Callable[[Any], float] | None = None
    stored: Callable[[float, Any], Any] | None = None

    def is_there(self, view: View) -> bool:
        """Whether the view has what the number belongs to."""
        return not self.needs or attrgetter(self.needs)(view) is not None

    def range(self, view: View) -> Limits:
        """Return the limits; they depend on what came with the picture, not on where the slider stands."""
        return self.limits(view) if callable(self.limits) else self.limits

    def track(self, view: View) -> Limits:
        """Return the limits of its slider, which reach as far as where it stands."""
        given = self.get(replace(view, camera=view.given_camera, dock=view.given_dock)) if self.around else 0
        if given <= 0:
            return self.range(view)
        now, step = self.get(view), float(f"{given / 1000:.2g}")
        return Limits(round(min(0.8 * given, now), 2), round(max(1.2 * given, now), 2), step)

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


def _lens(name: str, limits_of: Callable[[Camera], Limits]) -> dict[str, Any]:
    """Limits that depend on the given camera, and always include its own number of that name."""

    def limits(view: View) -> Limits:
        usual, given = limits_of(view.given_camera), getattr(view.given_camera, name)
        return Limits(min(usual.low, given), max(usual.high, given), usual.step)

    return {"limits": limits}


def _diameter_limits(view: View) -> Limits:
    """1 cm to 3 m; more where the given dock is larger."""
    given = 100 * view.given_dock.diameter
    return Limits(min(1.0, given), max(300.0, 2 * given), 0.1)


def _coefficient(index: int, usual: float) -> dict[str, Any]:
    """A coefficient in OpenCV's order, up to ``usual`` to either side; more where the given camera has more."""

    def limits(view: View) -> Limits:
        most = max(usual, 2 * abs(coefficients_of(view.given_camera)[index]))
        return Limits(-most, most, 0.0005)

    def stored(number: float, camera: Camera) -> Camera:
        return with_coefficient(camera, index, number)

    return {"limits": limits, "shown": lambda camera: coefficients_of(camera)[index], "stored": stored}


def _with_lights(number: float, dock: Dock) -> Dock:
    """Another number of lights, 0 for unknown; what was given light by light is dropped."""
    lights = None if number == 0 else max(round(number), LEAST_LIGHTS)
    return dock if lights == dock.lights else changed(dock, lights=lights, angles_deg=(), offsets_m=())


def _with_snow(number: float, snow: Snow | None) -> Snow | None:
    return changed(snow or Snow(count=0), count=number) if number > 0 else None


def _with_surface(number: float, mirror: Mirror | None) -> Mirror | None:
    return changed(mirror or Mirror(height_m=0.0), height_m=number / 100) if number > 0 else None


_FUNCTIONS: dict[str, dict[str, Any]] = {
    # Fields of view from 136 to 11 degrees.
    **{name: _lens(name, lambda camera: Limits(0.2 * camera.width, 5.0 * camera.width, 1.0)) for name in ("fx", "fy")},
    "cx": _lens("cx", lambda camera: Limits(0.0, camera.width - 1.0, 0.5)),
    "cy": _lens("cy", lambda camera: Limits(0.0, camera.height - 1.0, 0.5)),
    "k1": _coefficient(0, 1.0),
    "k2": _coefficient(1, 2.0),
    "p1": _coefficient(2, 0.1),
    "p2": _coefficient(3, 0.1),
    "k3": _coefficient(4, 2.0),
    "diameter_cm": {"limits": _diameter_limits},
    "lights": {"shown": lambda dock: dock.lights or 0, "stored": _with_lights},
    "turbidity": {"shown": turbidity_of, "stored": lambda number, water: water_at(number)},
    "light": {"shown": lambda level: math.log10(max(level, 10)), "stored": lambda number, level: 10**number},
    "snow": {"shown": lambda snow: 0 if snow is None else snow.count, "stored": _with_snow},
    "surface_cm": {"shown": lambda mirror: 0 if mirror is None else 100 * mirror.height_m, "stored": _with_surface},
}


def parameter(name: str, row: dict[str, Any]) -> Parameter:
    """The parameter of a row, with the functions of that name."""
    limits: dict[str, Any] = {"limits": Limits(*row["limits"])} if "limits" in row else {}
    return Parameter(**row | _FUNCTIONS.get(name, {}) | limits)


def _group(name: str) -> dict[str, Parameter]:
    return {one: parameter(one, row) for one, row in read_toml("sliders.toml")[name].items()}


LENS, DISTORTION, PORT, DOCK, DETECTION = map(_group, ("lens", "distortion", "port", "dock", "detection"))
SCENE_POSE, SCENE_WATER, SCENE_DISTURBANCES = map(_group, ("scene_pose", "scene_water", "scene_disturbances"))
SCENE = SCENE_POSE | SCENE_WATER | SCENE_DISTURBANCES
PARAMETERS = LENS | DISTORTION | PORT | DOCK | DETECTION | SCENE


_FOCAL = {LENS["fx"].label, LENS["fy"].label}


def with_given_number(view: View, label: str) -> View:
    """Set the number of that label back to what was given of the camera or the dock; of fx and fy both."""
    given = replace(view, camera=view.given_camera, dock=view.given_dock)
    labels = _FOCAL if label in _FOCAL else {label}
    for one in (LENS | DISTORTION | PORT | DOCK).values():
        if one.label in labels and one.is_there(view):
            view = one.put(view, one.get(given))
    return view
