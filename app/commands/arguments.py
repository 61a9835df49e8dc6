"""Arguments that several commands share, and what is made of them."""

from __future__ import annotations

import argparse

from dockpose import Camera, Dock, Settings
from dockpose.app.errors import UserError
from dockpose.camera.files import load_camera
from dockpose.lights.masks import Mask, check_masks


def add_camera_and_dock(parser: argparse.ArgumentParser) -> None:
    """Add ``--camera``, ``--dock-diameter`` and ``--lights``."""
    beside = "default: what NAME.yaml beside NAME.png says"
    parser.add_argument("--camera", metavar="C.yaml", help=f"camera file: ROS, OpenCV or dockpose ({beside})")
    parser.add_argument("--dock-diameter", type=float, metavar="M", help=f"of the ring of lights, in metres ({beside})")
    parser.add_argument("--lights", type=int, metavar="N", help="how many lights, evenly spaced, where it is known")


def add_masks(parser: argparse.ArgumentParser) -> None:
    """Add ``--mask``."""
    parser.add_argument(
        "--mask",
        metavar="X,Y,W,H",
        action="append",
        default=[],
        help="leave out a rectangle, as burnt-in text: left, top, width and height in pixels; may be given repeatedly "
        "(--mask=-5,0,90,20 where it starts with a minus)",
    )


def camera_of(arguments: argparse.Namespace) -> Camera | None:
    """The camera that was named; None where none was. Raises UserError where its file is wrong."""
    try:
        return None if arguments.camera is None else load_camera(arguments.camera)
    except ValueError as error:
        raise UserError(f"--camera: {error}") from error


def dock_of(arguments: argparse.Namespace) -> Dock | None:
    """The dock that was described; None where none was. Raises UserError for an impossible one."""
    if arguments.dock_diameter is None:
        if arguments.lights is not None:
            raise UserError(f"--lights {arguments.lights} needs --dock-diameter beside it")
        return None
    try:
        return Dock(arguments.dock_diameter, arguments.lights)
    except ValueError as error:
        raise UserError(f"--dock-diameter, --lights: {error}") from error


def masks_of(arguments: argparse.Namespace) -> tuple[Mask, ...]:
    """The masks that were given. Raises UserError for one that is none."""
    masks = []
    for text in arguments.mask:
        try:
            x, y, width, height = (float(number) for number in text.split(","))
            check_masks([(x, y, width, height)])
        except ValueError as error:
            wanted = "left, top, width and height in pixels, as 440,10,190,30, the sizes above 0"
            raise UserError(f"--mask {text} must be {wanted}") from error
        masks.append((x, y, width, height))
    return tuple(masks)


def settings_of(arguments: argparse.Namespace) -> Settings:
    """The settings by ``--method``, ``--level`` and ``--mask``. Raises UserError where they contradict."""
    masks = masks_of(arguments)
    if arguments.level is None:
        if arguments.method == "fixed":
            raise UserError("--method fixed needs --level N beside it")
        return Settings(method=arguments.method or "hats", masks=masks)
    if arguments.method not in (None, "fixed"):
        raise UserError(f"--level {arguments.level} is a fixed level; it does not go with --method {arguments.method}")
    try:
        return Settings(method="fixed", level=arguments.level, masks=masks)
    except ValueError as error:
        raise UserError(f"--{error}") from error
