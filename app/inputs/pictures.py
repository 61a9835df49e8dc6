"""The pictures of one command, each with its camera and dock; those that cannot be read are told and passed over."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.sidecar import read_sidecar
from dockpose.camera.files import FileError
from dockpose.camera.image import decode

EXIT_ALL_READ, EXIT_SOME_UNREADABLE = 0, 1
Result = TypeVar("Result")


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture that was read.

    Attributes
    ----------
    path : of its file.
    image : (H, W) grey or (H, W, 3) BGR array of uint8 or uint16.
    sha256 : of the file.
    camera, dock : that belong to it.
    """

    path: Path
    image: np.ndarray
    sha256: str
    camera: Camera
    dock: Dock


@dataclass(frozen=True)
class Job:
    """A picture file that is to be read, with its camera and dock."""

    path: Path
    camera: Camera
    dock: Dock


class Batch:
    """Picture files, in order.

    Parameters
    ----------
    paths : of the files.
    camera, dock : for all pictures; where None, each picture's own, from the YAML beside it.

    Attributes
    ----------
    jobs : the pictures that are to be read.

    Raises
    ------
    UserError
        if a picture has no camera or dock.
    """

    def __init__(self, paths: Sequence[Path], camera: Camera | None, dock: Dock | None) -> None:
        self._all_read = True
        jobs = [self._job(path, camera, dock) for path in paths]
        self.jobs = tuple(job for job in jobs if job is not None)

    @property
    def exit_status(self) -> int:
        """0 where every picture so far was read, 1 where some could not be."""
        return EXIT_ALL_READ if self._all_read else EXIT_SOME_UNREADABLE

    def run(self, work: Callable[[Picture], Result]) -> Iterator[tuple[Picture, Result]]:
        """Read picture after picture and yield each with what ``work`` makes of it.

        A picture that cannot be read, or that ``work`` refuses with a ValueError, is told on standard error.
        """
        for job in self.jobs:
            try:
                picture = read_job(job)
                result = work(picture)
            except ValueError as error:
                self.pass_over(str(error) if str(job.path) in str(error) else f"{job.path}: {error}")
            else:
                yield picture, result

    def _job(self, path: Path, camera: Camera | None, dock: Dock | None) -> Job | None:
        if camera is None or dock is None:
            try:
                sidecar = read_sidecar(path)
            except FileError as error:
                self.pass_over(str(error))
                return None
            camera, dock = camera or sidecar.camera, dock or sidecar.dock
        if camera is None and path.is_file():
            raise UserError(f"{path}: which camera? Give --camera C.yaml, or {path.stem}.yaml beside the picture")
        if dock is None and path.is_file():
            raise UserError(f"{path}: how large is the dock? Give --dock-diameter in metres")
        if camera is None or dock is None:
            self.pass_over(f"{path}: there is no such file")
            return None
        return Job(path, camera, dock)

    def pass_over(self, text: str) -> None:
        """Tell why a picture could not be read."""
        self._all_read = False
        say(text)


def say(text: str) -> None:
    """Tell something on standard error."""
    print(f"dockpose: {text}", file=sys.stderr)


def read_job(job: Job) -> Picture:
    """Read and decode a picture. Raises a ValueError that names the file where it cannot be."""
    try:
        data = job.path.read_bytes()
    except OSError as error:
        raise FileError(f"{job.path}: cannot be read ({error.strerror or error})") from error
    image = decode(data, str(job.path))
    return Picture(job.path, image, hashlib.sha256(data).hexdigest(), job.camera, job.dock)
