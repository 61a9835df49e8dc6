"""The sequences that the page can play: the one given at the start, those below the folder, and simulated ones."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.folder import below, folders_below, pictures_in, videos_below
from dockpose.app.inputs.sidecar import read_sidecar
from dockpose.app.state.scene import scene_of
from dockpose.app.state.view import View
from dockpose.simulate import Approach, ClosedLoop, FilmPlan, Hover, Scene, Sweep
from dockpose.sources import Frames, Kind, Pictures, Simulated, Tell, kind_of, open_frames

SIMULATED = ("simulated approach", "simulated sweep", "simulated hover", "simulated closed loop")
_PICTURES_IN = "pictures in "
_PICTURES_HZ = 10.0  # of pictures, which have no times
_RATE_HZ = 25.0
_FAR, _NEAR = 13.0, 1.7  # diameters: a 0.30 m ring from 4 m to 0.5 m


@dataclass(frozen=True)
class Given:
    """The sequence that was given at the start, as it was typed, with the camera and dock that were given with it."""

    source: str
    camera: Camera | None = None
    dock: Dock | None = None

    @property
    def name(self) -> str:
        """What to call it."""
        kind = kind_of(self.source)
        if kind in (Kind.CAMERA, Kind.STREAM):
            return f"camera {self.source}" if kind is Kind.CAMERA else self.source
        return Path(self.source).name or self.source


@dataclass(frozen=True)
class Opened:
    """A sequence that was opened.

    Attributes
    ----------
    frames : to be closed when they are done with.
    name : what to call it.
    camera, dock : that it brings along, if any.
    folder : that its file is in and that is to go with it, if any.
    """

    frames: Frames
    name: str
    camera: Camera | None = None
    dock: Dock | None = None
    folder: tempfile.TemporaryDirectory[str] | None = None

    def close(self) -> None:
        """Let go of the frames, and delete a file that was kept for them."""
        self.frames.close()
        if self.folder is not None:
            self.folder.cleanup()


def is_sequence(source: str) -> bool:
    """Whether what was given at the start is more than one picture."""
    return kind_of(source) is not Kind.PICTURE


def choices(given: Given | None, root: Path | None) -> list[str]:
    """Names of all sequences that can be chosen: the given one, those below the folder, simulated ones."""
    names = [] if given is None else [given.name]
    if root is not None:
        names += videos_below(root)
        names += [f"{_PICTURES_IN}{folder}" for folder in folders_below(root) if len(pictures_in(root, folder)) > 1]
    return [*names, *SIMULATED]


def open_choice(name: Any, given: Given | None, root: Path | None, view: View, tell: Tell) -> Opened:
    """Open one of :func:`choices`.

    Parameters
    ----------
    name : of the sequence, as a browser sent it.
    given, root : as for :func:`choices`.
    view : what is shown: its scene is what the simulated courses lead through.
    tell : hears of frames that are skipped, and of a live source that goes away.

    Raises
    ------
    UserError
        if it is none of the choices.
    SourceError
        if it gives no frames.
    """
    if given is not None and name == given.name:
        return open_given(given, tell)
    if name in SIMULATED:
        return simulated(name, scene_of(view))
    if root is None or not isinstance(name, str):
        raise UserError(f"There is no sequence called {name!r}.")
    if name.startswith(_PICTURES_IN):
        folder = name.removeprefix(_PICTURES_IN)
        paths = [below(root, picture) for picture in pictures_in(root, folder)]
        if not paths:
            raise UserError(f"There are no pictures in {folder}.")
        return _with_sidecar(Pictures(paths, name, _PICTURES_HZ, tell), name, paths[0])
    if name not in videos_below(root):
        raise UserError(f"There is no sequence called {name!r}.")
    path = below(root, name)
    return _with_sidecar(open_frames(str(path), tell), name, path)


def open_given(given: Given, tell: Tell) -> Opened:
    """Open what was given at the start: a video, a folder, a camera, a stream, a scene file."""
    kind, path = kind_of(given.source), Path(given.source)
    frames = open_frames(given.source, tell, rate_hz=_PICTURES_HZ)
    if kind is Kind.VIDEO:
        opened = _with_sidecar(frames, given.name, path)
    else:
        opened = Opened(frames, given.name, frames.camera, frames.dock)
    return replace(opened, camera=given.camera or opened.camera, dock=given.dock or opened.dock)


def open_sent(data: bytes, name: str, tell: Tell) -> Opened:
    """Open a video that a browser sent; its file is deleted when it is closed."""
    folder = tempfile.TemporaryDirectory(prefix="dockpose-")
    path = Path(folder.name) / f"sent{Path(name).suffix.lower()}"
    path.write_bytes(data)
    try:
        if kind_of(str(path)) is not Kind.VIDEO:
            raise UserError(f"{name} is no video by its name; .mp4, .avi, .mov, .mkv and .webm are.")
        frames = open_frames(str(path), tell)
    except ValueError as error:
        folder.cleanup()
        raise UserError(str(error).replace(str(path), name)) from error
    return Opened(frames, name, folder=folder)


def simulated(name: str, scene: Scene) -> Opened:
    """A simulated course through a scene, at distances that suit its dock."""
    near_m, far_m = _NEAR * scene.dock.diameter, _FAR * scene.dock.diameter
    drift_m = 0.05 * scene.dock.diameter
    currents = {"drift_m": drift_m, "drift_deg": 1.0, "rate_hz": _RATE_HZ}
    motion = {
        SIMULATED[0]: Approach(start_m=far_m, end_m=near_m, frames=500, **currents),
        SIMULATED[1]: Sweep(reach_m=0.5 * scene.dock.diameter, frames=250, **currents),
        SIMULATED[2]: Hover(frames=250, rate_hz=_RATE_HZ, drift_m=drift_m),
        SIMULATED[3]: ClosedLoop(end_m=near_m, frames=500, **currents),
    }[name]
    return Opened(Simulated(FilmPlan(scene=scene, motion=motion), name), name, scene.camera, scene.dock)


def _with_sidecar(frames: Frames, name: str, path: Path) -> Opened:
    try:
        beside = read_sidecar(path)
    except ValueError:
        frames.close()
        raise
    return Opened(frames, name, beside.camera, beside.dock)
