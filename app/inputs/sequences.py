"""Frames that belong together: what was typed, and what the page can play; what a camera may be asked for."""

import itertools
import math
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dockpose.sources as sources
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.pictures import Batch, camera_and_dock, expand, known
from dockpose.app.inputs.received import below, folders_below, pictures_in, videos_below
from dockpose.files import FileError
from dockpose.sidecar import read_sidecar
from dockpose.sources import Callback, CaptureSettings, Frames, Kind, SourceError
from dockpose.text import InputError, public

if TYPE_CHECKING:
    from dockpose.simulate import FilmPlan, Scene

SIMULATED = ("simulated approach", "simulated sweep", "simulated hover", "simulated closed loop")
PICTURES_HZ = 10.0  # rate at which the page plays pictures, which have no times
_PICTURES_IN = "pictures in "
_RATE_HZ = 25.0
_FAR, _NEAR = 13.0, 1.7  # diameters: a 0.30 m ring from 4 m to 0.5 m
MOST_HZ = 1000.0
_FORMAT = re.compile(r"[A-Z0-9]{3,4}")
_OF_PICTURES = (Kind.PICTURE, Kind.FOLDER, Kind.GLOB)


@dataclass(frozen=True)
class FrameSource:
    """Frames that belong together in time, with their camera and dock."""

    source: str  # as it was typed, or the path of a video
    name: str  # what to call it
    paths: tuple[Path, ...] = ()  # of its pictures
    rate_hz: float | None = None  # of its pictures
    camera: Camera | None = None  # those given for it or beside it
    dock: Dock | None = None  # those given for it or beside it
    course: "FilmPlan | None" = None  # what is simulated
    topic: str | None = None  # of a bag
    folder: tempfile.TemporaryDirectory[str] | None = None  # holds a file that was sent, until :meth:`discard`
    capture: CaptureSettings = sources.DEFAULT_CAPTURE  # what a camera is asked for
    rotate_deg: int = 0  # by how much the frames, and ``camera`` with them, are turned clockwise on opening

    def open(self, tell: Callback, *, grey: bool = False) -> Frames:
        """Open the frames, which then carry the camera and the dock."""
        try:
            if self.course is not None:
                frames: Frames = sources.Simulated(self.course, self.source)
            elif self.paths:
                frames = sources.Pictures(self.paths, self.source, self.rate_hz, tell)
            else:
                capture = of_size(self.capture, self.camera)
                how = {"rate_hz": self.rate_hz, "topic": self.topic}
                frames = sources.open_frames(self.source, tell, grey=grey, capture=capture, **how)
        except SourceError as error:
            if self.folder is None:
                raise
            self.discard()
            raise UserError(str(error).replace(self.source, self.name)) from error
        for note in frames.camera_notes if self.camera is None else ():
            tell(f"{self.name}: {note}")
        frames.camera, frames.dock = self.camera or frames.camera, self.dock or frames.dock
        frames.turn(self.rotate_deg)
        return frames

    def discard(self) -> None:
        """Delete a file that was kept for it."""
        if self.folder is not None:
            self.folder.cleanup()


def is_sequence(source: str) -> bool:
    """Whether what was given at the start is more than one picture."""
    return sources.kind_of(source) is not Kind.PICTURE


def typed(
    source: str,
    camera: Camera | None,
    dock: Dock | None,
    paths: Sequence[Path] = (),
    rate_hz: float | None = None,
    topic: str | None = None,
    rotate_deg: int = 0,
) -> FrameSource:
    """Return a sequence that was typed, with its camera and dock."""
    kind, course, name = sources.kind_of(source), None, source
    if kind is Kind.SIMULATED:
        from dockpose.simulate.files import load_sequence

        course = load_sequence(source)
        camera, dock = camera or course.scene.camera, dock or course.scene.dock
    elif kind in (Kind.CAMERA, Kind.STREAM):
        name = _live_name(source)
        camera, dock = known(name, camera, dock)
    elif kind is Kind.BAG:
        beside = read_sidecar(Path(source))
        camera, dock = camera or beside.camera, dock or beside.dock
    else:
        camera, dock = camera_and_dock(paths[0] if paths else Path(source), camera, dock)
    return FrameSource(source, name, tuple(paths), rate_hz, camera, dock, course, topic, rotate_deg=rotate_deg)


def given(source: str, camera: Camera | None, dock: Dock | None, topic: str | None = None) -> FrameSource:
    """The sequence that the page starts with, of a bag with its topic; its camera and dock need not be known."""
    kind = sources.kind_of(source)
    if kind in (Kind.CAMERA, Kind.STREAM):
        return FrameSource(source, _live_name(source), camera=camera, dock=dock)
    first = None if kind is Kind.SIMULATED else Path(source) if kind is Kind.BAG else sources.list_pictures(source)[0]
    rate_hz = None if kind is Kind.PAGES else PICTURES_HZ
    found = FrameSource(source, Path(source).name or source, (), rate_hz, camera, dock, topic=topic)
    return found if first is None else _with_sidecar(found, first)


def choices(given: FrameSource | None, root: Path | None) -> list[str]:
    """Names of all sequences that the page can play: the given one, those below the folder, simulated ones."""
    names = [] if given is None else [given.name]
    if root is not None:
        names += videos_below(root)
        names += [f"{_PICTURES_IN}{folder}" for folder in folders_below(root) if len(pictures_in(root, folder)) > 1]
    return [*names, *SIMULATED]


def choose(name: Any, given: FrameSource | None, root: Path | None, scene: "Scene") -> FrameSource:
    """Return one of :func:`choices`."""
    if given is not None and name == given.name:
        return given
    if name in SIMULATED:
        return simulated(name, scene)
    if root is None or not isinstance(name, str):
        raise UserError(f"There is no sequence called {name!r}.")
    if name.startswith(_PICTURES_IN):
        folder = name.removeprefix(_PICTURES_IN)
        paths = tuple(below(root, picture) for picture in pictures_in(root, folder))
        if not paths:
            raise UserError(f"There are no pictures in {folder}.")
        return _with_sidecar(FrameSource(name, name, paths, PICTURES_HZ), paths[0])
    if name not in videos_below(root):
        raise UserError(f"There is no sequence called {name!r}.")
    path = below(root, name)
    return _with_sidecar(FrameSource(str(path), name), path)


def sent(data: bytes, name: str) -> FrameSource:
    """A video, bag or picture of pages that a browser sent, kept until it is discarded; UserError for anything else."""
    folder = tempfile.TemporaryDirectory(prefix="dockpose-")
    path = Path(folder.name) / f"sent{Path(name).suffix.lower()}"
    path.write_bytes(data)
    if sources.kind_of(str(path)) not in (Kind.VIDEO, Kind.BAG, Kind.PAGES):
        folder.cleanup()
        raise UserError(f"{name} is not a video, a bag or a picture of several pages.")
    return FrameSource(str(path), name, folder=folder)


def simulated(name: str, scene: "Scene") -> FrameSource:
    """A simulated course through a scene, at distances that suit its dock."""
    from dockpose.simulate import Approach, ClosedLoop, FilmPlan, Hover, Sweep

    near_m, far_m = _NEAR * scene.dock.diameter, _FAR * scene.dock.diameter
    drift_m = 0.05 * scene.dock.diameter
    currents = {"drift_m": drift_m, "drift_deg": 1.0, "rate_hz": _RATE_HZ}
    motion = {
        SIMULATED[0]: Approach(start_m=far_m, end_m=near_m, frames=500, **currents),
        SIMULATED[1]: Sweep(reach_m=0.5 * scene.dock.diameter, frames=250, **currents),
        SIMULATED[2]: Hover(frames=250, rate_hz=_RATE_HZ, drift_m=drift_m),
        SIMULATED[3]: ClosedLoop(end_m=near_m, frames=500, **currents),
    }[name]
    return FrameSource(name, name, course=FilmPlan(scene=scene, motion=motion))


def of_size(capture: CaptureSettings, camera: Camera | None) -> CaptureSettings:
    """The settings with the size that a camera file is for, where they name none."""
    if camera is None or capture.width is not None:
        return capture
    return replace(capture, width=camera.width, height=camera.height)


def _live_name(source: str) -> str:
    number = sources.camera_number(source)
    return public(source) if number is None else f"camera {number}"


def _with_sidecar(source: FrameSource, path: Path) -> FrameSource:
    beside = read_sidecar(path)
    return replace(source, camera=source.camera or beside.camera, dock=source.dock or beside.dock)


def capture_from(given: Mapping[str, float | str | None], names: Mapping[str, str]) -> CaptureSettings:
    """Capture settings made of what was typed."""
    numbers = {name: _number(given[name], names[name]) for name in ("exposure", "gain", "rate_hz")}
    rate_hz = numbers["rate_hz"]
    if rate_hz is not None and not 0 < rate_hz <= MOST_HZ:
        raise UserError(f"{names['rate_hz']} is {rate_hz:g}; it must be above 0 and at most {MOST_HZ:g}")
    letters = str(given["format"] or "").strip().upper()
    if letters and not _FORMAT.fullmatch(letters):
        raise UserError(f"{names['format']} {letters}: must be the three or four letters of a format, as MJPG or Y16")
    return CaptureSettings(exposure=numbers["exposure"], gain=numbers["gain"], rate_hz=rate_hz, format=letters or None)


def _number(value: float | str | None, name: str) -> float | None:
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    try:
        number = float(value)
    except ValueError as error:
        raise UserError(f"{name} is {value!r}; it must be a number") from error
    if not math.isfinite(number):
        raise UserError(f"{name} is {number:g}; it must be a number")
    return number


def resolve(
    words: Sequence[str],
    camera: Camera | None,
    dock: Dock | None,
    report: Callable[[str], None],
    rate_hz: float | None = None,
    topic: str | None = None,
    rotate_deg: int = 0,
) -> list[Batch | FrameSource | None]:
    """Pictures in a row make one Batch; with a rate a sequence, those typed one by one, or each folder or glob.

    What cannot be had is None, and ``report`` hears why; where an argument is wrong for all of them, that is raised.
    """
    found: list[Batch | FrameSource | None] = []
    refused: list[InputError] = []
    for group in _groups(words, rate_hz):
        is_pictures = sources.kind_of(group[0]) in _OF_PICTURES
        try:
            if is_pictures and rate_hz is None:
                found.append(Batch(group, camera, dock, report, rotate_deg))
            else:
                paths = expand(group) if is_pictures else []
                found.append(typed(group[0], camera, dock, paths, rate_hz, topic, rotate_deg))
        except InputError as error:
            refused.append(error)
            found.append(None)
    if refused and not any(found) and not isinstance(refused[0], FileError):
        raise refused[0]
    for error in refused:
        report(str(error))
    return found


def _groups(words: Sequence[str], rate_hz: float | None) -> Iterator[list[str]]:
    """Sources in a row that go together."""

    def group_of(numbered: tuple[int, str]) -> int:
        number, source = numbered
        go_together = _OF_PICTURES if rate_hz is None else (Kind.PICTURE,)
        return -1 if sources.kind_of(source) in go_together else number

    for _, group in itertools.groupby(enumerate(words), group_of):
        yield [source for _, source in group]
