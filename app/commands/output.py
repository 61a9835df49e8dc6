"""Where a command's results go: lines of JSON, a table, pictures, a video. What cannot be written is a UserError."""

import argparse
import contextlib
import csv
import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose.app.commands.console import check_stopped, put, put_text
from dockpose.app.drawing.annotated import annotate
from dockpose.app.errors import check_folder, unwritable, writing
from dockpose.app.export.data import CSV_COLUMNS, to_png, to_row
from dockpose.app.export.recordings.ros import AS_THEY_CAME, PoseFile, Seen
from dockpose.app.inputs.protected import Protected
from dockpose.app.state.trust import NO_POSE, Trust, headline_of
from dockpose.camera import mark
from dockpose.files import GrowingFile, write_whole
from dockpose.sources import Frame
from dockpose.text import as_text


class ResultWriter:
    """Writes the results frame by frame, so that a run that is stopped keeps all that it did."""

    def __init__(self, to: argparse.Namespace, files: contextlib.ExitStack) -> None:
        self.to = to  # the arguments that say where
        self._json = open_lines(to.json, files)
        csv_file = open_lines(to.csv, files)
        self._table = None if csv_file is None else csv.DictWriter(csv_file, CSV_COLUMNS)
        if self._table is not None:
            self._table.writeheader()
        self.frames = self.docks = 0
        self.failures = list[str]()
        self._is_silent = to.quiet or "-" in (to.json, to.csv)
        self._has_files = any((to.json, to.csv, to.annotate))
        self._folders: dict[Path, PictureFolder] = {}

    def folder(self, path: Path) -> "PictureFolder":
        """The folder for annotated pictures of that path, one and the same for all sources."""
        if path not in self._folders:
            self._folders[path] = PictureFolder(path, self.to.protected)
        return self._folders[path]

    def bag(self, source: str, files: contextlib.ExitStack, tell: Callable[[str], None]) -> PoseFile | None:
        """Open what ``--out`` names for the frames of one source, to be closed with ``files``."""
        if self.to.out is None:
            return None
        bag = PoseFile(self.to.out, source, tell, has_pictures=not self.to.no_pictures)
        return files.enter_context(contextlib.closing(bag))

    def write(
        self,
        line: dict[str, Any],
        label: str,
        seen: Seen,
        read: Callable[[], Frame],
        keep: Callable[[np.ndarray], object],
        bag: PoseFile | None,
    ) -> None:
        """Write a frame, which ``read`` returns again, and whose annotated picture ``keep`` takes."""
        check_stopped()
        if line["status"] == "method_failed":
            self.failures.append(line["message"])
        if self._json is not None:
            write_line(self._json, line)
        if self._table is not None:
            self._table.writerow(to_row(line))
        if self.to.annotate is not None:
            keep(annotate(read().picture(), seen.found, headline=headline_of(seen.trust)))
        # Of a sequence, whose progress is shown, the files tell; of pictures by themselves a line tells too.
        if not self._is_silent and (seen.track is None or not self._has_files):
            put(f"{label}: {_sentences(line, seen.trust)}")
        self.frames += 1
        self.docks += line["status"] == "ok"
        if bag is not None:
            if not self.to.no_pictures:
                frame = read()
                is_kept = (frame.encoded or b"").startswith(AS_THEY_CAME)
                seen = dataclasses.replace(seen, picture=frame.encoded if is_kept else to_png(frame.image))
            bag.write(seen, line["time_s"], line["time_unix_s"])

    def put_sum(self) -> None:
        """Say in how many of several pictures a dock was found."""
        if self.frames > 1 and not self._is_silent:
            put(f"{self.docks} of {self.frames} pictures show a dock")


def _sentences(line: dict[str, Any], trust: Trust) -> str:
    trusted = "" if trust.verdict == NO_POSE else f" {trust.sentence}"
    is_open = line["status"] == "not_a_ring" and line["dock"]["lights"] is None
    hint = " Give --lights N if you know how many the dock has." if is_open else ""
    return f"{line['message']}{trusted}{hint}"


class StandardOutput:
    """Standard output, for lines."""

    def write(self, text: str) -> None:
        """Write whole lines. Raises UserError where that cannot be done."""
        put_text(text)


class LineFile:
    """A file that has whole lines only, each on it as soon as it is written."""

    def __init__(self, path: str, name: str | None = None) -> None:
        self._name, self._count = name or path, 0
        with writing(self._name):
            self._file = GrowingFile(Path(path))

    def write(self, text: str) -> None:
        """Write a line with its end; where that fails, the file keeps those before it, and the fault is reported."""
        try:
            self._file.write(as_text(text).encode())
            self._file.mark()
        except BrokenPipeError:
            raise
        except OSError as error:
            kept = self._file.cut()
            raise unwritable(self._name, error, kept=f"{kept} (lines: {self._count})" if kept else "") from error
        self._count += 1

    def close(self) -> None:
        """Close the file."""
        with writing(self._name):
            self._file.close()


Lines = LineFile | StandardOutput  # what lines are written to, each of which is there at once


def open_lines(target: str | None, files: contextlib.ExitStack) -> Lines | None:
    """Open a file for lines, to be closed with ``files``; "-" is standard output, None nothing."""
    if target is None:
        return None
    if target == "-":
        return StandardOutput()
    file = LineFile(target)
    files.callback(file.close)
    return file


def write_line(file: Lines, line: dict[str, Any]) -> None:
    """Write one JSON object as one line, at once, in plain ASCII, which every terminal can show."""
    file.write(to_json(line) + "\n")


def to_json(line: dict[str, Any]) -> str:
    """JSON of an object in plain ASCII, whose text is as :func:`as_text` gives it; NaN and infinity are null."""
    try:
        text = msgspec.json.encode(line)  # in a twentieth of the standard library's time
    except UnicodeEncodeError:  # a file's name need not be text
        text = msgspec.json.encode(_with_text(line))
    return text.decode() if text.isascii() else json.dumps(msgspec.json.decode(text))


def _with_text(value: Any) -> Any:
    if isinstance(value, str):
        return as_text(value)
    if isinstance(value, dict):
        return {key: _with_text(one) for key, one in value.items()}
    return [_with_text(one) for one in value] if isinstance(value, (list, tuple)) else value


class PictureFolder:
    """A folder for pictures, made if need be, in which neither what is protected nor another result is overwritten."""

    def __init__(self, folder: Path, protected: Protected) -> None:
        check_folder(folder, str(folder))
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(folder, error, "cannot be made") from error
        self._folder, self._protected, self._taken = folder, protected, set[Path]()

    def write(self, name: str, picture: np.ndarray) -> None:
        """Write a picture that was drawn on as NAME.png, or NAME-2.png where an input or a result has that name."""
        path, number = self._folder / f"{name}.png", 1
        while path.resolve() in self._taken or self._protected.owner(path):
            number += 1
            path = self._folder / f"{name}-{number}.png"
        self._taken.add(path.resolve())
        with writing(path):
            write_whole(path, mark.to_png(picture))
