"""Where a command's results go: lines of JSON, a table, pictures, a video. What cannot be written is a UserError."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TextIO

import cv2
import msgspec
import numpy as np
from dockpose.app.errors import UserError, writing
from dockpose.app.export.recordings.mcap_file import PoseFile
from dockpose.app.export.recordings.messages import Seen
from dockpose.app.export.recordings.rerun_file import RerunFile
from dockpose.app.export.rows import CSV_COLUMNS, to_row
from dockpose.app.export.video import is_video_file
from dockpose.app.state.trust import NO_POSE, Trust


@dataclass(frozen=True)
class Destinations:
    """Where results go; None for nowhere.

    Attributes
    ----------
    json : str or None
        File for a line a frame; "-" for standard output.
    csv : str or None
        File for a row a frame.
    annotate : Path or None
        Folder for annotated pictures; or of one sequence a video, by its ending.
    out : Path or None
        File NAME.mcap for messages of ROS 2.
    rerun : Path or None
        File NAME.rrd for the viewer Rerun.
    """

    json: str | None = None
    csv: str | None = None
    annotate: Path | None = None
    out: Path | None = None
    rerun: Path | None = None

    @property
    def recordings(self) -> list[Path]:
        """The files that hold all frames of one source with their times."""
        return [path for path in (self.out, self.rerun) if path is not None]

    @property
    def is_video(self) -> bool:
        """Whether the annotated pictures are to become a video."""
        return self.annotate is not None and is_video_file(self.annotate)


class ResultWriter:
    """Writes the results frame by frame, so that a run that is stopped keeps all that it did.

    Parameters
    ----------
    to : Destinations
        Where to write.
    files : ExitStack
        Closes what is opened here.
    before_each : callable
        Called before a frame is written; may raise.

    Attributes
    ----------
    frames : int
        How many were written.
    """

    def __init__(
        self, to: Destinations, files: contextlib.ExitStack, before_each: Callable[[], None] = lambda: None
    ) -> None:
        self.to, self._before_each = to, before_each
        self._json = open_text(to.json, files)
        self._csv = open_text(to.csv, files)
        self._table = None if self._csv is None else csv.DictWriter(self._csv, CSV_COLUMNS)
        if self._table is not None and self._csv is not None:
            self._table.writeheader()
            self._csv.flush()
        self.frames = 0

    def write(
        self,
        line: dict[str, Any],
        label: str,
        trust: Trust,
        draw: Callable[[], object],
        held: HeldLines | None = None,
    ) -> None:
        """Write one frame.

        Parameters
        ----------
        line : dict
            Its JSON object.
        label : str
            What to call it on the screen, where its message is printed if nothing else is written.
        trust : Trust
            How far to trust it, which is printed after the message.
        draw : callable
            Writes its annotated picture; called where those are wanted.
        held : HeldLines, optional
            Keeps the JSON object until :meth:`record` is called for it; else that is done at once.
        """
        self._before_each()
        if held is None:
            self.record(line)
        else:
            held.add(line)
        if self.to.annotate is not None:
            draw()
        elif self._json is None and self._csv is None:
            trusted = "" if trust.verdict == NO_POSE else f" {trust.sentence}"
            is_open = line["status"] == "not_a_ring" and line["dock"]["lights"] is None
            hint = " Give --lights N if you know how many the dock has." if is_open else ""
            print(f"{label}: {line['message']}{trusted}{hint}", flush=True)
        self.frames += 1

    def record(self, line: dict[str, Any]) -> None:
        """Write a frame's JSON object and row."""
        if self._json is not None:
            write_line(self._json, line)
        if self._table is not None and self._csv is not None:
            self._table.writerow(to_row(line))
            self._csv.flush()


class Recordings:
    """The files of :attr:`Destinations.recordings`, open; what they share is made once for all.

    Parameters
    ----------
    to : Destinations
        Which files there are.
    source : str
        Name of the source.
    files : ExitStack
        Closes them.
    tell : callable
        Told what is to be known of their times.
    """

    def __init__(self, to: Destinations, source: str, files: contextlib.ExitStack, tell: Callable[[str], None]) -> None:
        self._with_drawing = to.out is not None
        self._files: list[PoseFile | RerunFile] = []
        for path, kind in ((to.out, PoseFile), (to.rerun, RerunFile)):
            if path is not None:
                self._files.append(files.enter_context(kind(path, source, tell)))

    def write(
        self,
        seen: Seen,
        times_s: tuple[float | None, float | None],
        original: Callable[[], np.ndarray],
        drawn: Callable[[], np.ndarray],
    ) -> None:
        """Add a frame.

        Parameters
        ----------
        seen : Seen
            The frame.
        times_s : tuple of 2 (float or None), seconds
            Since the source began, and since 1970.
        original, drawn : callable
            Return its picture, and the annotated one.
        """
        if self._files:
            picture = drawn() if self._with_drawing else None
            seen = dataclasses.replace(seen, picture=picture, original=original())
        for file in self._files:
            file.write(seen, *times_s)


class HeldLines:
    """JSON objects that cannot be written yet, in a temporary file, since a recording may have very many."""

    def __init__(self) -> None:
        self._file: IO[bytes] = tempfile.TemporaryFile(prefix="dockpose-")  # noqa: SIM115  # closed when read

    def add(self, line: dict[str, Any]) -> None:
        """Keep one more."""
        self._file.write(to_json(line).encode() + b"\n")

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield them in order, once."""
        self._file.seek(0)
        with self._file:
            yield from map(json.loads, self._file)


def open_text(target: str | None, files: contextlib.ExitStack) -> TextIO | None:
    """Open a file to write, to be closed with ``files``; "-" is standard output, None nothing."""
    if target is None or target == "-":
        return sys.stdout if target else None
    with writing(target):
        return files.enter_context(open(target, "w", encoding="utf-8", newline=""))


def write_line(file: TextIO, line: dict[str, Any]) -> None:
    """Write one JSON object as one line, at once, in plain ASCII, which every terminal can show."""
    file.write(to_json(line) + "\n")
    file.flush()


def to_json(line: dict[str, Any]) -> str:
    """JSON of an object in plain ASCII; NaN and infinity are null."""
    try:
        text = msgspec.json.encode(line)  # in a twentieth of the standard library's time
    except UnicodeEncodeError:  # a file's name need not be text
        return json.dumps(line, allow_nan=False)
    return text.decode() if text.isascii() else json.dumps(msgspec.json.decode(text))


class PictureFolder:
    """A folder for pictures made from others, which is made if need be.

    Parameters
    ----------
    folder : Path
        Where to write.
    originals : sequence of Path
        The pictures that results are made from; none of them is ever overwritten, nor is another result.
    """

    def __init__(self, folder: Path, originals: Sequence[Path]) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"{folder}: cannot be made ({error.strerror or error})") from error
        self._folder = folder
        self._taken = {path.resolve() for path in originals}

    def write(self, name: str, picture: np.ndarray) -> None:
        """Write a picture as NAME.png, or NAME-2.png where an original or another result has that name."""
        path, number = self._folder / f"{name}.png", 1
        while path.resolve() in self._taken:
            number += 1
            path = self._folder / f"{name}-{number}.png"
        self._taken.add(path.resolve())
        with writing(path):
            path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
