"""Whose camera and dock are in force: My tank's, those that came with the picture, or assumed ones."""

from dataclasses import replace
from pathlib import Path

from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.state.tank import Tank
from dockpose.app.state.view import View, own_camera, own_dock
from msgspec.structs import replace as changed


def with_my_tank(view: View) -> View:
    """Look at the picture with My tank's camera and dock; a camera is assumed where My tank has none that fits."""
    camera, camera_of = own_camera(view.tank, view.image)
    dock, dock_of = own_dock(view.tank)
    return replace(view, camera=camera, camera_of=camera_of, dock=dock, dock_of=dock_of)


def with_tank(view: View, tank: Tank) -> View:
    """Take another tank for My tank; a picture that came with a camera and a dock of its own keeps them."""
    own = with_my_tank(replace(view, tank=tank))
    if view.camera_of == "picture":
        own = replace(own, camera=view.camera, camera_of="picture")
    return replace(own, dock=view.dock, dock_of="picture") if view.dock_of == "picture" else own


def with_these_as_mine(view: View) -> View:
    """Take the camera and the dock in force for My tank; an assumed camera is nobody's."""
    camera = view.tank.camera if view.camera_of == "guess" else view.camera
    camera_of = view.camera_of if view.camera_of == "guess" else "tank"
    return with_own_dock(replace(view, tank=changed(view.tank, camera=camera), camera_of=camera_of), view.dock)


def with_own_camera(view: View, camera: Camera, name: str) -> View:
    """Take a camera that the operator gave, in a file of that name, for My tank, and look with it."""
    height, width = view.image.shape[:2]
    try:
        fitting = camera.for_size(width, height)
    except ValueError as error:
        raise UserError(f"{name}: {error}") from error
    return replace(view, camera=fitting, camera_of="tank", tank=changed(view.tank, camera=camera))


def with_own_dock(view: View, dock: Dock) -> View:
    """Take a dock that the operator gave for My tank, and look for it."""
    return replace(view, dock=dock, dock_of="tank", tank=changed(view.tank, dock=dock, knows_diameter=True))


def kept(before: View, after: View) -> View:
    """Finish a change: camera and dock go into My tank, unless the picture brought them; a note, with its cause."""
    if after.note and after.note == before.note and after.settings != before.settings:
        after = replace(after, note="")
    if after.image is not before.image or after.tank is not before.tank:
        return after
    if after.camera != before.camera and after.camera_of == before.camera_of != "picture":
        after = replace(after, tank=changed(after.tank, camera=after.camera), camera_of="tank")
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
