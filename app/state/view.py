"""What the page shows and works from, without the page: one frozen View, and the ways to open one."""

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from dockpose import Camera, Dock, Settings
from dockpose.app.errors import UserError
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.state.tank import Tank
from dockpose.camera.image import ImageError, decode, orientation_of, orientation_sentence, read_picture_file, turned
from dockpose.lights.by_hand import ByHand
from dockpose.pose.known import KnownPose
from dockpose.sidecar import Sidecar, lights_beside, read_sidecar, sample_names, sample_path
from dockpose.simulate import Scene, load_scene
from dockpose.sources.pictures import read_tagged

_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}


class MeasuredPose(msgspec.Struct, frozen=True):
    """Centimetres and degrees of the dock's centre and face; None for what was not measured."""

    x_cm: float | None = None
    y_cm: float | None = None
    z_cm: float | None = None
    theta_x_deg: float | None = None
    theta_y_deg: float | None = None

    @property
    def values(self) -> tuple[float | None, ...]:
        """The five numbers, in the order of the tables."""
        return msgspec.structs.astuple(self)

    @property
    def pose(self) -> KnownPose | None:
        """The whole pose; None where a number of it is blank."""
        x, y, z, theta_x, theta_y = self.values
        if x is None or y is None or z is None or theta_x is None or theta_y is None:
            return None
        return KnownPose((x / 100, y / 100, z / 100), theta_x, theta_y)


def typed_number(name: str, text: str) -> float | None:
    """Return a typed number in the unit that ends the name, as "z (cm)", with or without a unit; None for a blank."""
    text, unit = text.strip(), name.rpartition("(")[2].rstrip(")")
    if not text:
        return None
    digits = text.rstrip("cm°degpx")
    typed = text[len(digits) :].replace("deg", "°") or unit
    try:
        number = float(digits.replace(",", ".").replace("−", "-"))
        if typed != unit:
            number = round(number * _METRES[typed] / _METRES[unit], 9)
    except (ValueError, KeyError):
        number = math.nan
    if not math.isfinite(number):
        raise UserError(f"{name} is {text!r}; it must be a number, or blank.")
    return number


def number_text(number: float | None) -> str:
    """Return a number as people type it; blank for None."""
    return "" if number is None else f"{number:.6f}".rstrip("0").rstrip(".")


NO_TANK = Tank()
DEFAULT_DOCK = NO_TANK.dock
GUESSED_VIEW_DEG = 60.0
Owner = Literal["tank", "picture", "guess"]
# What a frame of a sequence is without.
_OF_NO_FILE: dict[str, Any] = {
    **dict.fromkeys(("sample", "truth", "by_hand", "set_lights", "measured", "scene", "sha256")),
    **{"is_stale": False, "item": ""},
}


@dataclass(frozen=True, eq=False)
class View:
    """A picture, where it came from, and how it is to be read."""

    image: np.ndarray  # (H, W) grey or (H, W, 3) BGR, uint8 or uint16
    source: str  # name of the sample or file
    camera: Camera  # for exactly this picture's size
    dock: Dock  # what is searched for
    settings: Settings  # how it is searched for
    given_camera: Camera  # those that it was opened with, to go back to
    given_dock: Dock  # those that it was opened with, to go back to
    tank: Tank = NO_TANK  # the operator's own, whichever are in force
    # whose camera and dock are in force: those of My tank, those that came with the picture, or assumed ones
    camera_of: Owner = "picture"
    dock_of: Owner = "picture"
    given_of: tuple[Owner, Owner] = ("picture", "picture")  # whose ``given_camera`` and ``given_dock`` are
    sample: str | None = None  # name of the sample scene that this is
    truth: KnownPose | None = None  # where the dock of a simulated picture really is
    note: str = ""  # what was changed on opening it
    by_hand: tuple[float, float, float] | None = None  # normal of the pose that the operator chose
    set_lights: ByHand | None = None  # lights that the operator set in the picture; None where they are searched for
    measured: MeasuredPose | None = None  # what the operator measured of the pose
    scene: Scene | None = None  # what is simulated
    is_stale: bool = False  # whether ``image`` is still to be rendered from ``scene``
    # the list of pictures that this one is in ("samples", "uploads", "folder" for the one that the page may show,
    # "beside" for that of the picture given at the start, "sequence"), and its name there
    list_name: str = ""
    item: str = ""
    sha256: str | None = None  # of the bytes that the picture was read from

    @property
    def known_pose(self) -> KnownPose | None:
        """The truth, or else the measured pose; None where neither is known."""
        return self.measured_pose if self.truth is None else self.truth

    @property
    def measured_pose(self) -> KnownPose | None:
        """The measured pose, where all of it was measured."""
        return None if self.measured is None else self.measured.pose

    @property
    def given_fx_per_fy(self) -> float:
        """The ratio of fx to fy as the camera was given, 1 for square pixels."""
        kept = self.tank.fx_per_fy if self.camera_of == "tank" else None
        return kept or self.given_camera.fx / self.given_camera.fy

    @cached_property
    def assumed(self) -> tuple[str, ...]:
        """Which of camera and dock nobody has given."""
        return tuple(name for name in ("camera", "dock") if getattr(self, f"{name}_of") == "guess")

    @property
    def notes(self) -> tuple[str, ...]:
        """What had to be assumed, as sentences; each holds for the camera in force now."""
        own, sentences = self.tank.camera, [self.note] if self.note else []
        if self.camera_of == "guess":
            other = "" if own is None else f"The camera of My tank is for {own.width} x {own.height}. "
            sentences.insert(
                0,
                f"{other}No camera is known for a picture of {self.camera.width} x {self.camera.height}: one that sees "
                f"{GUESSED_VIEW_DEG:.0f} degrees was assumed, so distances are only rough.",
            )
        elif self.camera_of == "tank" and own is not None and own.width != self.camera.width:
            size, own_size = (f"{camera.width} x {camera.height}" for camera in (self.camera, own))
            sentences.insert(0, f"The camera of My tank is for {own_size}; its values were scaled to {size}.")
        return tuple(sentences)


def open_source(
    source: str | None, camera: Camera | None, dock: Dock | None, tank: Tank | None = None, rotate_deg: int = 0
) -> View:
    """Return the view to start with."""
    mine = (tank or NO_TANK).with_given(camera, dock)
    if source is None:
        return _sample_view(sample_names()[0], mine, camera=camera, dock=dock)
    path = Path(source)
    image, sha256, _, tag, _ = read_tagged(path)
    beside = read_sidecar(path)
    camera, truth = camera or beside.camera, beside.truth
    brought = Sidecar(
        None if camera is None else camera.rotated(rotate_deg),
        dock or beside.dock,
        None if truth is None else truth.rotated(rotate_deg),
    )
    view = _view(turned(image, rotate_deg), path.name, mine, brought)
    note, lights = orientation_sentence(tag, path.name), lights_beside(path)
    if rotate_deg and lights is not None:
        note, lights = f"{note} Lights are set in the picture as it is, and do not go with --rotate.", None
    item = path.resolve().name
    return replace(view, sha256=sha256, list_name="beside", item=item, note=note.strip(), set_lights=lights)


def with_sample(view: View, name: Any) -> View:
    """Show the sample scene of that name, with its own camera and dock; My tank stays as it is."""
    return _sample_view(name, view.tank, view.settings)


def with_file(view: View, path: Path, name: str, list_name: str = "folder") -> View:
    """Show a picture of a folder on this machine, called ``name`` there."""
    is_beside = path.with_suffix(".yaml").resolve().parent == path.parent
    beside, lights = (read_sidecar(path), lights_beside(path)) if is_beside else (Sidecar(), None)
    try:
        data = read_picture_file(path)
    except ImageError as error:
        raise UserError(str(error).replace(str(path), name, 1)) from error
    return replace(_decoded(view, data, name, list_name, beside), set_lights=lights)


def with_upload(view: View, data: bytes, name: str) -> View:
    """Show an uploaded picture with My tank, or a guessed camera. Raises ImageError, which names it, for no picture."""
    return _decoded(view, data, name, "uploads", Sidecar())


def with_first_frame(view: View, image: np.ndarray, source: str, camera: Camera | None, dock: Dock | None) -> View:
    """Show the first frame of a sequence, called ``source``."""
    return replace(_view(image, source, view.tank, Sidecar(camera, dock), view.settings), list_name="sequence")


def with_frame(view: View, image: np.ndarray, source: str) -> View:
    """Show a later frame of a sequence, called ``source``, with the camera and the dock in force."""
    camera, camera_of = _fitting(view.camera, image)
    return replace(
        view,
        image=image,
        source=source,
        camera=camera,
        camera_of="guess" if camera_of == "guess" else view.camera_of,
        list_name="sequence",
        **_OF_NO_FILE,
    )


def guess_camera(image: np.ndarray) -> Camera:
    """A camera for a picture of which nothing is known: 60 degrees wide, axis in the middle."""
    height, width = image.shape[:2]
    focal = width / 2 / math.tan(math.radians(GUESSED_VIEW_DEG) / 2)
    return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)


def own_camera(tank: Tank, image: np.ndarray) -> tuple[Camera, Owner]:
    """Return My tank's camera for a picture, or a guessed one where it has none or none that fits; and whose it is."""
    return (guess_camera(image), "guess") if tank.camera is None else _fitting(tank.camera, image)


def own_dock(tank: Tank) -> tuple[Dock, Owner]:
    """Return My tank's dock; and whose it is, as long as nobody has given its diameter."""
    is_assumed = not tank.knows_diameter and tank.dock.diameter == DEFAULT_DOCK.diameter
    return tank.dock, "guess" if is_assumed else "tank"


def _fitting(camera: Camera, image: np.ndarray) -> tuple[Camera, Owner]:
    height, width = image.shape[:2]
    try:
        return camera.for_size(width, height), "tank"
    except ValueError:
        return guess_camera(image), "guess"


def _decoded(view: View, data: bytes, name: str, list_name: str, beside: Sidecar) -> View:
    shown = _view(decode(data, name), name, view.tank, beside, view.settings)
    note, sha256 = orientation_sentence(orientation_of(data), name), hashlib.sha256(data).hexdigest()
    return replace(shown, list_name=list_name, item=name, sha256=sha256, note=note)


def _sample_view(
    name: str, tank: Tank, settings: Settings | None = None, *, camera: Camera | None = None, dock: Dock | None = None
) -> View:
    sample, scene = load_sample(name), load_scene(sample_path(name).with_suffix(".yaml"))
    beside = Sidecar(camera or sample.camera, dock or sample.dock, sample.truth)
    view = _view(sample.image, name, tank, beside, settings)
    return replace(view, sample=name, scene=scene, list_name="samples", item=name, sha256=sample.sha256)


def _view(image: np.ndarray, source: str, tank: Tank, beside: Sidecar, settings: Settings | None = None) -> View:
    """Show a picture with the camera and the dock that it brings along; My tank's in place of None."""
    height, width = image.shape[:2]
    if beside.camera is None:
        camera, camera_of = own_camera(tank, image)
    else:
        camera, camera_of = beside.camera.for_size(width, height), _owner(beside.camera == tank.camera)
    dock, dock_of = own_dock(tank) if beside.dock is None else (beside.dock, _owner(beside.dock == tank.dock))
    return View(
        image=image,
        source=source,
        camera=camera,
        dock=dock,
        settings=settings or Settings(),
        given_camera=camera,
        given_dock=dock,
        tank=tank,
        camera_of=camera_of,
        dock_of=dock_of,
        given_of=(camera_of, dock_of),
        truth=beside.truth,
    )


def _owner(is_mine: bool) -> Owner:
    return "tank" if is_mine else "picture"
