"""Changes of the simulated scene, and the view that shows it."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.state.view import View
from dockpose.paper.scenes import tank_scenes
from dockpose.pose.known import KnownPose
from dockpose.simulate import Lights, Pose, Scene, render
from dockpose.simulate.optics.water import PRESETS, Water, water_of_turbidity
from dockpose.simulate.parts import Background, Text
from msgspec.structs import replace as changed

SOURCE_NAME = "simulated scene"
# The measured transfer function names a file on this machine, which no browser may choose.
LONGEST_TEXT = 60
_MOST_PIXELS = 4_000_000
_NEAR = 0.005  # half a step of the slider
DEFAULT_SCENE = Scene(
    camera=Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480),
    dock=Dock(diameter=0.30, lights=10),
    pose=Pose(position_m=(0.05, 0.03, 1.0), theta_x_deg=10.0, theta_y_deg=-15.0, roll_deg=5.0),
    lights=Lights(),
    background=Background(),
)
NOT_OF_THE_PAPER = "(none)"
paper_scenes = cache(tank_scenes)


def paper_scene(view: View) -> str:
    """The name of the report's scene that is shown as the report draws it."""
    named = (name for name, scene in paper_scenes().items() if scene == view.scene)
    return next(named, NOT_OF_THE_PAPER)


def with_paper_scene(view: View, name: Any) -> View:
    """Show a scene like one of the paper's photographs, as the report on the paper draws it, or the first scene."""
    if name == NOT_OF_THE_PAPER:
        return with_scene(view, DEFAULT_SCENE, keep=False)
    if name not in paper_scenes():
        raise UserError(f"The paper's scene is {name!r}; it must be one of {', '.join(paper_scenes())}.")
    return replace(with_scene(view, paper_scenes()[name], keep=False), source=name)


def turbidity_of(water: Water) -> float:
    """Where between clear (0) and harbour (1) water scatters as this one does."""
    logs = [math.log(one.scattering_per_m) for one in PRESETS.values()]
    return float(np.interp(math.log(max(water.scattering_per_m, 1e-9)), logs, np.linspace(0, 1, len(logs))))


def water_at(turbidity: float) -> Water:
    """The water of a turbidity: a measured one where the slider's step reaches it."""
    places = zip(np.linspace(0, 1, len(PRESETS)), PRESETS.values(), strict=True)
    return next((water for place, water in places if abs(turbidity - place) < _NEAR), water_of_turbidity(turbidity))


def with_scene(view: View, scene: Scene, *, keep: bool = True) -> View:
    """Show a scene, to be rendered; with ``keep`` a scene of the same camera leaves camera and dock in use."""
    check_affordable(scene)
    new = replace(
        view,
        scene=scene,
        is_stale=True,
        truth=KnownPose(scene.pose.position_m, scene.pose.theta_x_deg, scene.pose.theta_y_deg),
        source=SOURCE_NAME,
        sample=None,
        note="",
        list_name="",
        item="",
        sha256=None,
    )
    if keep and view.scene is not None and view.scene.camera == scene.camera:
        return new
    camera, dock = scene.camera, scene.dock
    brought = {"camera_of": "picture", "dock_of": "picture", "given_of": ("picture", "picture")}
    return replace(new, camera=camera, dock=dock, given_camera=camera, given_dock=dock, **brought)


def rendered(view: View) -> View:
    """The view with the picture of its scene, where that is still to be rendered; lights were set in another one."""
    if not view.is_stale or view.scene is None:
        return view
    return replace(view, image=render(view.scene)[0], is_stale=False, set_lights=None)


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
    return view.scene or DEFAULT_SCENE


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
