"""What the page shows and works from, without the page: one frozen View, and the ways to open one."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from dockpose import Camera, Dock, Settings
from dockpose.app.errors import UserError
from dockpose.app.inputs.samples import load_sample, sample_names, sample_path
from dockpose.app.inputs.sidecar import Sidecar, read_sidecar
from dockpose.camera.image import decode
from dockpose.pose.known import KnownPose
from dockpose.simulate import Scene, load_scene
from dockpose.sources.pictures import read_picture

DEFAULT_DOCK = Dock(diameter=0.30)
GUESSED_VIEW_DEG = 60.0


@dataclass(frozen=True, eq=False)
class View:
    """A picture, where it came from, and how it is to be read.

    Attributes
    ----------
    image : np.ndarray
        (H, W) grey or (H, W, 3) BGR, uint8 or uint16.
    source : str
        Name of the sample or file.
    camera : Camera
        For exactly this picture's size.
    dock : Dock
        What is searched for.
    settings : Settings
        How it is searched for.
    given_camera, given_dock : Camera, Dock
        Those that came with the picture, to go back to.
    sample : str, optional
        Name of the sample scene that this is.
    truth : KnownPose, optional
        Where the dock of a simulated picture really is.
    note : str
        What had to be assumed; empty where nothing had to be.
    by_hand : tuple of float, optional
        Normal of the pose that the operator chose; None leaves the choice to the program.
    scene : Scene, optional
        What is simulated.
    is_stale : bool
        Whether ``image`` is still to be rendered from ``scene``.
    list_name, item : str
        The list of pictures that this one is in ("samples", "uploads", "folder" for the one that the
        page may show, "beside" for that of the picture given at the start, "sequence"), and its name there.
    measured : KnownPose, optional
        Pose that the operator measured.
    sha256 : str, optional
        Of the bytes that the picture was read from; None for simulated pictures and frames of a sequence.
    """

    image: np.ndarray
    source: str
    camera: Camera
    dock: Dock
    settings: Settings
    given_camera: Camera
    given_dock: Dock
    sample: str | None = None
    truth: KnownPose | None = None
    note: str = ""
    by_hand: tuple[float, float, float] | None = None
    measured: KnownPose | None = None
    scene: Scene | None = None
    is_stale: bool = False
    list_name: str = ""
    item: str = ""
    sha256: str | None = None

    @property
    def known_pose(self) -> KnownPose | None:
        """The truth, or else the measured pose; None where neither is known."""
        return self.measured if self.truth is None else self.truth


def open_source(source: str | None, camera: Camera | None, dock: Dock | None) -> View:
    """Return the view to start with.

    Parameters
    ----------
    source : str, optional
        Path of a picture; None for the first sample scene.
    camera : Camera, optional
        None takes the one in the YAML beside the picture, or else guesses one.
    dock : Dock, optional
        None takes the one in the YAML beside the picture, or else one 0.30 m across.

    Raises
    ------
    ValueError
        If the picture cannot be read, or the camera is not for a picture of this size.
    """
    if source is None:
        return _sample_view(sample_names()[0], camera, dock)
    path = Path(source)
    image, sha256 = read_picture(path)
    beside = read_sidecar(path)
    known, note = camera or beside.camera, ""
    if known is None:
        known = guess_camera(image)
        note = _guess_sentence(known)
    view = _view(image, path.name, known, dock or beside.dock or DEFAULT_DOCK, truth=beside.truth, note=note)
    return replace(view, sha256=sha256, list_name="beside", item=path.resolve().name)


def with_sample(view: View, name: Any) -> View:
    """Show the sample scene of that name, with its own camera and dock."""
    if name not in sample_names():
        raise UserError(f"There is no sample scene called {name!r}.")
    return _sample_view(name, None, None, view.settings)


def with_file(view: View, path: Path, name: str, list_name: str = "folder") -> View:
    """Show a picture of a folder on this machine, called ``name`` there.

    What the YAML beside it says goes before the camera and the dock in use; see :func:`with_upload`.
    """
    beside = read_sidecar(path) if path.with_suffix(".yaml").resolve().parent == path.parent else Sidecar()
    shown = with_upload(view, _read_bytes(path, name), name)
    if beside.camera is None and beside.dock is None:
        return replace(shown, truth=beside.truth, list_name=list_name)
    camera, note = (shown.camera, shown.note) if beside.camera is None else (beside.camera, "")
    own = _view(shown.image, name, camera, beside.dock or view.dock, settings=view.settings, truth=beside.truth)
    return replace(own, note=note, list_name=list_name, item=name, sha256=shown.sha256)


def with_upload(view: View, data: bytes, name: str) -> View:
    """Show an uploaded picture.

    The present camera is kept where the picture has its size or is a pure rescale of it; otherwise a camera is guessed,
    and the note says so. Raises ValueError (ImageError) for a file that is no picture, naming it.
    """
    image = decode(data, name)
    camera, note = _fitting(view.camera, image)
    shown = _view(image, name, camera, view.dock, settings=view.settings, note=note)
    return replace(shown, list_name="uploads", item=name, sha256=hashlib.sha256(data).hexdigest())


def with_frame(
    view: View, image: np.ndarray, source: str, camera: Camera | None = None, dock: Dock | None = None
) -> View:
    """Show a frame of a sequence, called ``source``.

    ``camera`` and ``dock`` are those that the sequence brings along, for its first frame; None keeps those in use,
    the camera as :func:`with_upload` does.
    """
    camera, note = _fitting(camera or view.camera, image)
    dock = dock or view.dock
    given_camera = view.given_camera if camera is view.camera else camera
    given_dock = view.given_dock if dock is view.dock else dock
    return View(image, source, camera, dock, view.settings, given_camera, given_dock, note=note, list_name="sequence")


def guess_camera(image: np.ndarray) -> Camera:
    """A camera for a picture of which nothing is known: 60 degrees wide, axis in the middle."""
    height, width = image.shape[:2]
    focal = width / 2 / math.tan(math.radians(GUESSED_VIEW_DEG) / 2)
    return Camera(focal, focal, (width - 1) / 2, (height - 1) / 2, width, height)


def _read_bytes(path: Path, name: str) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{name}: cannot be read ({error.strerror or error})") from error


def _fitting(camera: Camera, image: np.ndarray) -> tuple[Camera, str]:
    """The camera for a picture of this size, or a guessed one, and a sentence where something had to be assumed."""
    height, width = image.shape[:2]
    try:
        fitting = camera.for_size(width, height)
    except ValueError:
        guessed = guess_camera(image)
        return guessed, f"The camera in use is for {camera.width} x {camera.height}. {_guess_sentence(guessed)}"
    scaled = f"The camera's values were scaled from {camera.width} x {camera.height} to {width} x {height}."
    return fitting, "" if fitting is camera else scaled


def _guess_sentence(camera: Camera) -> str:
    return (
        f"No camera is known for a picture of {camera.width} x {camera.height}: one that sees "
        f"{GUESSED_VIEW_DEG:.0f} degrees was assumed, so distances are only rough."
    )


def _sample_view(name: str, camera: Camera | None, dock: Dock | None, settings: Settings | None = None) -> View:
    sample, scene = load_sample(name), load_scene(sample_path(name).with_suffix(".yaml"))
    camera, dock = camera or sample.camera, dock or sample.dock
    view = _view(sample.image, name, camera, dock, settings=settings, sample=name, truth=sample.truth)
    return replace(view, scene=scene, list_name="samples", item=name, sha256=sample.sha256)


def _view(
    image: np.ndarray,
    source: str,
    camera: Camera,
    dock: Dock,
    *,
    settings: Settings | None = None,
    sample: str | None = None,
    truth: KnownPose | None = None,
    note: str = "",
) -> View:
    height, width = image.shape[:2]
    fitting = camera.for_size(width, height)
    return View(
        image=image,
        source=source,
        camera=fitting,
        dock=dock,
        settings=settings or Settings(),
        given_camera=fitting,
        given_dock=dock,
        sample=sample,
        truth=truth,
        note=note,
    )
