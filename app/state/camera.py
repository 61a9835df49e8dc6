"""Whose camera and dock are in force, and changes of the camera that are no single number, as its port or file."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.pictures import save_dock
from dockpose.app.inputs.received import read_sent, written
from dockpose.app.state.tank import Tank
from dockpose.app.state.view import View, own_camera, own_dock
from dockpose.camera.files import load_camera, save_camera
from dockpose.camera.port import FlatPort
from dockpose.camera.tone import TONES
from msgspec.structs import replace as changed


def with_my_tank(view: View) -> View:
    """Look at the picture with My tank's camera and dock; a camera is assumed where My tank has none that fits."""
    camera, camera_of = own_camera(view.tank, view.image)
    dock, dock_of = own_dock(view.tank)
    return replace(view, camera=camera, camera_of=camera_of, dock=dock, dock_of=dock_of)


def with_tank(view: View, tank: Tank) -> View:
    """Take another tank for My tank; a picture that came with a camera and a dock of its own keeps them."""
    own = _with_given(with_my_tank(replace(view, tank=tank)))
    if view.camera_of == "picture":
        given_of = "picture", own.given_of[1]
        own = replace(own, camera=view.camera, camera_of="picture", given_camera=view.given_camera, given_of=given_of)
    if view.dock_of == "picture":
        given_of = own.given_of[0], "picture"
        own = replace(own, dock=view.dock, dock_of="picture", given_dock=view.given_dock, given_of=given_of)
    return own


def _with_given(view: View, *, camera: bool = True, dock: bool = True) -> View:
    """Take the camera, the dock or both in force for those that were given, to go back to."""
    given_of = view.camera_of if camera else view.given_of[0], view.dock_of if dock else view.given_of[1]
    given_camera, given_dock = view.camera if camera else view.given_camera, view.dock if dock else view.given_dock
    return replace(view, given_camera=given_camera, given_dock=given_dock, given_of=given_of)


def with_these_as_mine(view: View) -> View:
    """Take the camera and the dock in force for My tank; an assumed camera is nobody's."""
    if view.camera_of != "guess":
        tank = changed(view.tank, camera=view.camera, fx_per_fy=view.given_fx_per_fy)
        view = replace(view, tank=tank, camera_of="tank")
    return with_own_dock(view, view.dock)


def with_own_camera(view: View, camera: Camera, name: str) -> View:
    """Take a camera that the operator gave, in a file of that name, for My tank, and look with it."""
    height, width = view.image.shape[:2]
    try:
        fitting = camera.for_size(width, height)
    except ValueError as error:
        raise UserError(f"{name}: {error}") from error
    own = replace(view, camera=fitting, camera_of="tank", tank=view.tank.with_given(camera, None))
    return _with_given(own, dock=False)


def with_calibrated_camera(view: View, camera: Camera) -> View:
    """Take a calibrated camera for My tank, and look with it unless the picture is of another shape."""
    try:
        return with_own_camera(view, camera, "the calibration")
    except UserError:
        size = f"{camera.width} x {camera.height}"
        note = f"The calibrated camera, for {size}, is My tank's; this picture has another shape."
        return replace(with_tank(view, view.tank.with_given(camera, None)), note=note)


def with_own_dock(view: View, dock: Dock) -> View:
    """Take a dock that the operator gave for My tank, and look for it."""
    own = replace(view, dock=dock, dock_of="tank", tank=changed(view.tank, dock=dock, knows_diameter=True))
    return _with_given(own, camera=False)


def kept(before: View, after: View) -> View:
    """Finish a change: camera and dock go into My tank, unless the picture brought them; a note, with its cause."""
    if after.note and after.note == before.note and after.settings != before.settings:
        after = replace(after, note="")
    if after.image is not before.image or after.tank is not before.tank:
        return after
    if after.camera != before.camera and after.camera_of == before.camera_of != "picture":
        ratio = after.given_fx_per_fy
        fx_per_fy = None if after.camera.fx / after.camera.fy == ratio else ratio
        tank = changed(after.tank, camera=after.camera, fx_per_fy=fx_per_fy)
        after = replace(after, tank=tank, camera_of="tank")
    if after.dock != before.dock and after.dock_of == before.dock_of != "picture":
        knows_diameter = after.dock.diameter != before.dock.diameter or before.dock_of == "tank"
        tank = changed(after.tank, dock=after.dock, knows_diameter=knows_diameter)
        after = replace(after, tank=tank, dock_of=own_dock(tank)[1])
    return after


def is_in_force(view: View) -> bool:
    """Whether the picture is looked at with My tank."""
    return view.camera_of == view.dock_of == "tank"


def origin(view: View) -> str:
    """What the picture's own camera and dock came with: "the sample", or the name of the file beside it."""
    if view.list_name in ("samples", "sequence"):
        return "the " + view.list_name.removesuffix("s")
    return f"{Path(view.item).stem}.yaml" if view.item else "the simulated scene"


def in_force_words(view: View) -> str:
    """Say whose camera and dock this picture is looked at with; empty where they are My tank's."""
    if is_in_force(view):
        return ""
    its = origin(view)
    if view.camera_of == view.dock_of:
        both = f"camera and dock of {its}" if view.camera_of == "picture" else "an assumed camera and dock"
        given = view.given_camera, view.given_dock
        edited = ", changed by hand" if view.camera_of == "picture" and (view.camera, view.dock) != given else ""
        return f"In use here: {both}{edited}."
    names = {"tank": "My tank's {}", "picture": f"the {{}} of {its}", "guess": "an assumed {}"}
    camera, dock = names[view.camera_of].format("camera"), names[view.dock_of].format("dock")
    return f"In use here: {camera} and {dock}."


_COEFFICIENTS, _FISHEYE_COEFFICIENTS = 5, 4
DEFAULT_PORT = FlatPort(air_gap_m=0.020, glass_m=0.010)


def coefficients_of(camera: Camera) -> list[float]:
    """Return k1, k2, p1, p2 and k3 (a fisheye lens has four of its own), zero where there are fewer."""
    return [*camera.distortion, *[0.0] * _COEFFICIENTS][:_COEFFICIENTS]


def with_coefficient(camera: Camera, index: int, number: float) -> Camera:
    """Set one coefficient of the lens's distortion, in the order of :func:`coefficients_of`."""
    if camera.fisheye and index >= _FISHEYE_COEFFICIENTS:
        raise UserError("A fisheye lens has four coefficients; there is no fifth.")
    numbers = [*coefficients_of(camera), *camera.distortion[_COEFFICIENTS:]]
    numbers[index] = number
    distortion = tuple(numbers[:_FISHEYE_COEFFICIENTS] if camera.fisheye else numbers)
    return changed(camera, distortion=distortion if any(distortion) else ())


def tone_names(camera: Camera) -> list[str]:
    """Return the tone curves to choose from, with the camera's own."""
    return list(dict.fromkeys([*TONES, "2.2", str(camera.tone)]))


def with_tone(view: View, name: str) -> View:
    """Set the tone curve by its name, or by its gamma."""
    return replace(view, camera=changed(view.camera, tone=name if name in TONES else float(name)))


def with_port(view: View, is_there: Any) -> View:
    """Put a flat window before the camera, or take it away."""
    port = (view.camera.port or view.given_camera.port or DEFAULT_PORT) if is_there else None
    return replace(view, camera=changed(view.camera, port=port))


def with_given_values(view: View) -> View:
    """Go back to the camera and the dock that were given, with the picture or in a file; an assumed one is neither."""
    camera_of, dock_of = view.given_of
    if camera_of != "guess":
        view = replace(view, camera=view.given_camera, camera_of=camera_of)
    return view if dock_of == "guess" else replace(view, dock=view.given_dock, dock_of=dock_of)


def with_camera_file(view: View, data: bytes, name: str) -> View:
    """Take the camera of a file that a browser sent; it is My tank's from then on."""
    notes: list[str] = []
    size = view.image.shape[1], view.image.shape[0]
    camera = read_sent(data, name, lambda path: load_camera(path, size=size, tell=notes.append))
    note = re.sub(r"\S*sent\.yaml", name, " ".join(notes))
    try:
        return with_own_camera(replace(view, note=note), camera, name)
    except UserError:
        if view.camera_of != "picture":
            raise
        note = f"{name} is for pictures of {camera.width} x {camera.height}; the one shown keeps its own camera."
        return replace(view, tank=view.tank.with_given(camera, None), note=note)


def dock_file(dock: Dock) -> bytes:
    """The bytes of a dock file."""
    return written(lambda path: save_dock(dock, path))


def camera_file(camera: Camera, file_format: Any = "dockpose") -> bytes:
    """The bytes of a camera file in one of :data:`dockpose.camera.files.FORMATS`."""
    return written(lambda path: save_camera(camera, path, file_format))


def field_of_view_sentence(camera: Camera) -> str:
    """How much the camera sees, in degrees, and in the water where it looks through a flat port."""
    across, down = map(math.degrees, camera.field_of_view_rad)
    if camera.port is None:
        return f"Field of view: {across:.1f}° wide, {down:.1f}° high."
    left, right, top, bottom = -0.5, camera.width - 0.5, -0.5, camera.height - 0.5
    rays = camera.rays([[left, camera.cy], [right, camera.cy], [camera.cx, top], [camera.cx, bottom]])
    angles = np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]))
    wide, high = angles[0] + angles[1], angles[2] + angles[3]
    return (
        f"Field of view: {across:.1f}° wide, {down:.1f}° high in air; {wide:.1f}° wide, {high:.1f}° high in the water."
    )
