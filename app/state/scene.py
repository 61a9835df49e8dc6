"""The simulated scene behind the page's sliders: which numbers they turn, and the view that shows the scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.state.view import Limits, View, checked_number
from dockpose.simulate import Lights, Pose, Scene, render, truth_dict, truth_of
from dockpose.simulate.optics.psf import MODELS
from dockpose.simulate.optics.water import PRESETS, Water, preset, water_of_turbidity
from dockpose.simulate.scene import Background, Mirror, Snow, Text
from msgspec.structs import replace as changed

SOURCE_NAME = "simulated scene"
# The measured transfer function names a file on this machine, which no browser may choose.
PSF_MODELS = tuple(name for name in MODELS if name != "mtf")
LONGEST_TEXT = 60
_MOST_PIXELS = 4_000_000
DEFAULT = Scene(
    camera=Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480),
    dock=Dock(diameter=0.30, lights=10),
    pose=Pose(position_m=(0.05, 0.03, 1.0), theta_x_deg=10.0, theta_y_deg=-15.0, roll_deg=5.0),
    lights=Lights(),
    background=Background(),
)


@dataclass(frozen=True)
class Knob:
    """One number of a scene.

    Attributes
    ----------
    label, hint : as the page says it, with the unit.
    limits : of the slider.
    get, put : read the number from a scene, in the label's unit, and give a scene with another one.
    """

    label: str
    hint: str
    limits: Limits
    get: Callable[[Scene], float]
    put: Callable[[Scene, float], Scene]


def _pose_knob(label: str, hint: str, limits: Limits, name: str) -> Knob:
    def put(scene: Scene, value: float) -> Scene:
        return changed(scene, pose=changed(scene.pose, **{name: value}))

    return Knob(label, hint, limits, lambda scene: getattr(scene.pose, name), put)


def _place_knob(label: str, hint: str, limits: Limits, axis: int) -> Knob:
    def put(scene: Scene, value: float) -> Scene:
        x, y, z = (value / 100 if index == axis else old for index, old in enumerate(scene.pose.position_m))
        return changed(scene, pose=changed(scene.pose, position_m=(x, y, z)))

    return Knob(label, hint, limits, lambda scene: 100 * scene.pose.position_m[axis], put)


def _put_part(part: str, name: str) -> Callable[[Scene, float], Scene]:
    return lambda scene, value: changed(scene, **{part: changed(getattr(scene, part), **{name: value})})


def turbidity_of(water: Water) -> float:
    """Where between clear (0) and harbour (1) water scatters as this one does."""
    logs = [math.log(one.scattering_per_m) for one in PRESETS.values()]
    return float(np.interp(math.log(max(water.scattering_per_m, 1e-9)), logs, np.linspace(0, 1, len(logs))))


def _put_snow(scene: Scene, value: float) -> Scene:
    return changed(scene, snow=changed(scene.snow or Snow(count=0), count=round(value)) if value > 0 else None)


def _put_surface(scene: Scene, value: float) -> Scene:
    mirror = changed(scene.mirror or Mirror(height_m=0.0), height_m=value / 100) if value > 0 else None
    return changed(scene, mirror=mirror)


_SIDEWAYS, _ANGLE = Limits(-200, 200, 0.5), Limits(-85, 85, 0.5)
POSE_KNOBS = {
    "x": _place_knob("Dock x (cm)", "How far the dock's centre is to the right of the camera's axis.", _SIDEWAYS, 0),
    "y": _place_knob("Dock y (cm)", "How far the dock's centre is below the camera's axis.", _SIDEWAYS, 1),
    "z": _place_knob("Dock z (cm)", "How far ahead the dock is.", Limits(10, 2000, 1), 2),
    "theta_x": _pose_knob("Dock θx (°)", "Pitch of the dock's face; 0 is square on.", _ANGLE, "theta_x_deg"),
    "theta_y": _pose_knob("Dock θy (°)", "Yaw of the dock's face; 0 is square on.", _ANGLE, "theta_y_deg"),
    "roll": _pose_knob(
        "Dock roll (°)", "Turns the ring in its own plane; no estimate can see it.", Limits(-180, 180, 1), "roll_deg"
    ),
}
WATER_KNOBS = {
    "turbidity": Knob(
        "Turbidity (0-1)",
        "0: Petzold's clear water, 0.33: tank, 0.67: coastal, 1: harbour.",
        Limits(0, 1, 0.01),
        lambda scene: turbidity_of(scene.water),
        lambda scene, value: changed(scene, water=water_of_turbidity(value)),
    ),
    "light": Knob(
        "Light (10^ grey)",
        "Power of ten of the grey level that a light's middle would show 1 m ahead in clear water; 255 is white.",
        Limits(1, 6, 0.05),
        lambda scene: math.log10(max(scene.lights.level, 10)),
        lambda scene, value: changed(scene, lights=changed(scene.lights, level=10**value)),
    ),
    "ambient": Knob(
        "Ambient (grey)",
        "Grey level, 0 to 255, of the water without lamps.",
        Limits(0, 200, 1),
        lambda scene: scene.background.level,
        _put_part("background", "level"),
    ),
    "veil": Knob(
        "Lamp veil (grey)",
        "Grey level of the haze that the vehicle's own lamp makes in the middle of the picture.",
        Limits(0, 200, 1),
        lambda scene: scene.background.backscatter_level,
        _put_part("background", "backscatter_level"),
    ),
}
DISTURBANCE_KNOBS = {
    "noise": Knob(
        "Noise (grey)",
        "Standard deviation of the sensor's own noise.",
        Limits(0, 30, 0.5),
        lambda scene: scene.sensor.read_noise_levels,
        _put_part("sensor", "read_noise_levels"),
    ),
    "snow": Knob(
        "Snow (count)",
        "Marine snow: drifting particles that shine.",
        Limits(0, 1000, 10),
        lambda scene: 0 if scene.snow is None else scene.snow.count,
        _put_snow,
    ),
    "surface": Knob(
        "Surface (cm up)",
        "Height of the water's surface above the camera, which mirrors the lights; 0: no surface near.",
        Limits(0, 300, 1),
        lambda scene: 0 if scene.mirror is None else 100 * scene.mirror.height_m,
        _put_surface,
    ),
}
KNOBS = POSE_KNOBS | WATER_KNOBS | DISTURBANCE_KNOBS


def with_scene(view: View, scene: Scene, *, keep: bool = True) -> View:
    """Show a simulated scene; its picture is rendered by the worker (:func:`rendered`).

    The camera and the dock in use are kept where they belong to a scene of the same camera, so that one can see what a
    wrong calibration does; else, or with ``keep`` off, they are the scene's.
    """
    check_affordable(scene)
    new = replace(
        view,
        scene=scene,
        is_stale=True,
        truth=truth_dict(scene, truth_of(scene)),
        source=SOURCE_NAME,
        sample=None,
        note="",
        list_name="",
    )
    if keep and view.scene is not None and view.scene.camera == scene.camera:
        return new
    return replace(new, camera=scene.camera, dock=scene.dock, given_camera=scene.camera, given_dock=scene.dock)


def rendered(view: View) -> View:
    """The view with the picture of its scene, where that is still to be rendered.

    Raises ValueError where the water's point spread function does not reach as far as the dock is.
    """
    if not view.is_stale or view.scene is None:
        return view
    return replace(view, image=render(view.scene)[0], is_stale=False)


def with_knob(view: View, name: str, value: Any) -> View:
    """Turn one number of the scene; where no scene is shown, that of the default one."""
    knob = KNOBS[name]
    return with_scene(view, knob.put(scene_of(view), knob.limits.clamp(checked_number(knob.label, value))))


def with_water(view: View, name: Any) -> View:
    """Take one of the preset waters."""
    if not isinstance(name, str) or name not in PRESETS:
        raise UserError(f"There is no water called {name!r}.")
    return with_scene(view, changed(scene_of(view), water=preset(name)))


def with_psf(view: View, model: Any) -> View:
    """Take another model of how water spreads light."""
    if model not in PSF_MODELS:
        raise UserError(f"There is no model of the water called {model!r}.")
    scene = scene_of(view)
    return with_scene(view, changed(scene, psf=changed(scene.psf, model=model, mtf_csv=None)))


def with_missing(view: View, text: Any) -> View:
    """Switch lights off, by their numbers from 0, with commas between them."""
    try:
        missing = tuple(sorted({int(word) for word in str(text).replace(",", " ").split()}))
    except ValueError as error:
        raise UserError(f"Missing lights are {text!r}; they must be numbers from 0, as 0, 3, 7.") from error
    scene = scene_of(view)
    return with_scene(view, changed(scene, lights=changed(scene.lights, missing=missing)))


def with_text(view: View, text: Any) -> View:
    """Burn letters into the picture, as recorders do; none for an empty text."""
    words = "".join(letter for letter in str(text) if letter.isprintable())[:LONGEST_TEXT]
    scene = scene_of(view)
    first = scene.texts[0] if scene.texts else Text(text="", x_px=12.0, y_px=12.0)
    return with_scene(view, changed(scene, texts=(changed(first, text=words), *scene.texts[1:]) if words else ()))


def with_camera_in_use(view: View) -> View:
    """Simulate with the camera and the dock of the camera panel."""
    return with_scene(view, changed(scene_of(view), camera=view.camera, dock=view.dock))


def scene_of(view: View) -> Scene:
    """The scene that is shown, or the one to start from."""
    return view.scene or DEFAULT


def preset_name(water: Water) -> str | None:
    """Which preset a water is; None for any other."""
    return next((name for name, one in PRESETS.items() if one == water), None)


def check_affordable(scene: Scene) -> None:
    """Refuse scenes that would keep the machine busy for long, or read a file of this machine."""
    if scene.psf.mtf_csv is not None:
        raise UserError("psf.mtf_csv names a file on this machine; the page does not read it.")
    if scene.camera.width * scene.camera.height > _MOST_PIXELS:
        size = f"{scene.camera.width} x {scene.camera.height}"
        raise UserError(
            f"The scene's picture is {size}; at most {_MOST_PIXELS // 10**6} megapixels are simulated here."
        )
    counts = {"lights": scene.dock.lights or 0, "lamps": len(scene.lamps), "texts": len(scene.texts)}
    counts |= {"occluders": len(scene.occluders), "glares": len(scene.background.glares)}
    sizes = {"texts.height_px": max((one.height_px for one in scene.texts), default=0)}
    sizes |= {"sensor.blur_px": scene.sensor.blur_px, "sensor.motion_blur_px": scene.sensor.motion_blur_px}
    sizes |= {"snow.size_px": 0 if scene.snow is None else scene.snow.size_px}
    sizes |= {"texts.text (letters)": max((len(one.text) for one in scene.texts), default=0)}
    snow = {"snow.count": 0 if scene.snow is None else scene.snow.count}
    for limit, group in ((60, counts), (200, sizes), (5000, snow)):
        for name, value in group.items():
            if value > limit:
                raise UserError(f"{name} is {value:g}; at most {limit} are simulated here.")
