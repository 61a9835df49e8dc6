"""Picture files with their cameras and docks, in batches, and the sample scenes."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self, TypeVar

import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.errors import UserError
from dockpose.camera.image import orientation_sentence, turned
from dockpose.camera.stills import name_of
from dockpose.files import FileError, to_yaml, write_whole
from dockpose.labels import read_labels
from dockpose.lights.by_hand import ByHand
from dockpose.pose.known import KnownPose
from dockpose.sidecar import lights_beside, read_sidecar, sample_path
from dockpose.sources import Frame, SourceError, list_pictures
from dockpose.sources.kinds import Kind, kind_of
from dockpose.sources.pictures import read_tagged
from dockpose.text import MOST_START_BYTES, RESULTS, InputError, kind_in_words

Result = TypeVar("Result")


class UnknownError(UserError):
    """Nothing says which camera, or how large a dock, belongs to a picture or to frames."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture that was read."""

    path: Path  # of its file
    image: np.ndarray  # (H, W): grey, or BGR
    sha256: str  # of the file
    camera: Camera  # that belong to it
    dock: Dock  # that belong to it
    truth: KnownPose | None = None  # where the dock really is
    time_unix_s: float | None = None  # when it was taken, since 1970-01-01 00:00 UTC
    tag: int = 1  # of its orientation, by EXIF's numbers
    encoded: bytes | None = None  # see ``Frame.encoded``
    by_hand: ByHand | None = None  # lights that somebody has set in it

    def estimate(self, settings: Settings) -> Estimate:
        """Search it, or take the lights that somebody has set in it."""
        lights = {} if self.by_hand is None else msgspec.structs.asdict(self.by_hand)
        return estimate(self.image, self.camera, self.dock, settings, **lights)

    def frame(self) -> Frame:
        """The picture as the only frame of a source."""
        return Frame(self.image, 0, None, str(self.path), self.sha256, encoded=self.encoded)


@dataclass(frozen=True)
class PictureFile:
    """A picture that is to be read and turned clockwise, with the camera of the turned picture and the dock."""

    path: Path
    camera: Camera
    dock: Dock
    rotate_deg: int = 0
    by_hand: ByHand | None = None

    def with_lights(self, by_hand: ByHand | None) -> Self:
        """The picture with lights that are set in it. Raises UserError where it is to be turned."""
        if by_hand is not None and self.rotate_deg:
            raise UserError(f"{self.path}: lights are set in the picture as it is, and do not go with --rotate")
        return replace(self, by_hand=by_hand)

    def read(self) -> Picture:
        """Read and decode it. Raises ImageError, which names the file, where that cannot be done."""
        image, sha256, taken_s, tag, encoded = read_tagged(self.path)
        encoded = None if self.rotate_deg else encoded
        more = {"time_unix_s": taken_s, "tag": tag, "encoded": encoded, "by_hand": self.by_hand}
        return Picture(self.path, turned(image, self.rotate_deg), sha256, self.camera, self.dock, **more)


def take_labels(parts: "Iterable[Batch | object]", path: Path, report: Callable[[str], None], *, snap: bool) -> None:
    """Set the lights that a file of labels has for pictures by their names; others are searched, and counted."""
    labels = read_labels(path)
    if snap:
        labels = {name: msgspec.structs.replace(lights, snap=True) for name, lights in labels.items()}
    batches = [part for part in parts if isinstance(part, Batch)]
    for batch in batches:
        batch.files = tuple(file.with_lights(labels.get(file.path.name, file.by_hand)) for file in batch.files)
    files = [file for batch in batches for file in batch.files]
    left = sum(file.path.name not in labels for file in files)
    if left == len(files):
        raise UserError(f"{path}: has the lights of no picture here; the first that it names is {next(iter(labels))}")
    if left:
        report(f"{path}: has no lights for {left} of {len(files)} pictures, which are searched.")


class Batch:
    """Pictures that do not belong together, in order; the error of the first is raised where none can be had."""

    def __init__(
        self,
        sources: Sequence[str],
        camera: Camera | None,
        dock: Dock | None,
        report: Callable[[str], None],
        rotate_deg: int = 0,
    ) -> None:
        self._report, self.left_out = report, 0
        self._told_tags: set[int] = set()
        files, refused = list[PictureFile](), list[InputError]()
        for source in sources:
            try:
                for path in list_pictures(source):
                    try:
                        own_camera, own_dock = camera_and_dock(path, camera, dock)
                        file = PictureFile(path, own_camera.rotated(rotate_deg), own_dock, rotate_deg)
                        files.append(file.with_lights(lights_beside(path)))
                    except InputError as error:
                        refused.append(error)
            except SourceError as error:
                refused.append(error)
        if not files and refused and not isinstance(refused[0], FileError):  # an argument is wrong or missing
            raise refused[0]
        for error in refused:
            self.skip(str(error))
        self.files = tuple(files)

    def run(self, work: Callable[[Picture], Result]) -> Iterator[tuple[Picture, Result]]:
        """Yield each picture with what ``work`` makes of it; what is unreadable or refused (ValueError) is skipped."""
        for file in self.files:
            try:
                picture = file.read()
                self.tell_orientation(picture.tag, file.path)
                result = work(picture)
            except ValueError as error:
                self.skip(str(error) if str(file.path) in str(error) else f"{file.path}: {error}")
            else:
                yield picture, result

    def tell_orientation(self, tag: int, path: Path) -> None:
        """Report a picture's tag of orientation, each kind once."""
        if tag not in self._told_tags and (sentence := orientation_sentence(tag, str(path))):
            self._report(sentence)
        self._told_tags.add(tag)

    def skip(self, text: str) -> None:
        """Report why a picture could not be read."""
        self.left_out += 1
        self._report(text)


def expand(sources: Sequence[str]) -> list[Path]:
    """Picture files that the sources stand for, see :func:`dockpose.sources.list_pictures` for both ways and errors."""
    return [path for source in sources for path in list_pictures(source)]


def load_sample(name: str) -> Picture:
    """Read a sample scene's picture, with its camera, dock and truth."""
    path = sample_path(name)
    beside = read_sidecar(path)
    if beside.camera is None or beside.dock is None:
        raise FileError(f"{path.with_suffix('.yaml')}: a sample scene needs the keys camera and dock")
    return Picture(path, *read_tagged(path)[:2], beside.camera, beside.dock, beside.truth)


def camera_and_dock(path: Path, camera: Camera | None, dock: Dock | None) -> tuple[Camera, Dock]:
    """Find the camera and the dock of a file; where None is given, the YAML beside it says."""
    if path.is_file():
        with contextlib.suppress(OSError), path.open("rb") as file:
            start = file.read(MOST_START_BYTES)
            if kind := kind_in_words(start, RESULTS) or (kind_of(str(path)) is Kind.PICTURE and name_of(start)):
                raise FileError(f"{path}: is {kind}")
    if camera is None or dock is None:
        if not path.is_file():
            raise FileError(f"{path}: there is no such file")
        beside = read_sidecar(path)
        camera, dock = camera or beside.camera, dock or beside.dock
    return known(str(path), camera, dock, f", or {path.stem}.yaml beside it")


def known(name: str, camera: Camera | None, dock: Dock | None, hint: str = "") -> tuple[Camera, Dock]:
    """Return the camera and the dock, and ask for what is missing, about ``name``."""
    if camera is None:
        raise UnknownError(f"{name}: which camera? Give --camera C.yaml{hint}")
    if dock is None:
        raise UnknownError(f"{name}: how large is the dock? Give --dock-diameter in metres{hint}")
    return camera, dock


def save_dock(dock: Dock, path: str | Path, camera: Camera | None = None) -> None:
    """Write a dock file that :func:`load_dock` reads back to the same numbers, with the camera where one is given."""
    content = {"dock": msgspec.to_builtins(dock)} | ({"camera": msgspec.to_builtins(camera)} if camera else {})
    write_whole(Path(path), to_yaml(content).encode())
