"""Where a command's results go: lines of JSON, a table, pictures, a video. What cannot be written is a UserError."""

import argparse
import contextlib
import csv
import dataclasses
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose.app.commands.console import check_stopped, put, put_text
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import check_folder, check_place, unwritable, writing
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
        self._json = open_lines(to.json, "--json", files)
        csv_file = open_lines(to.csv, "--csv", files)
        self._table = None if csv_file is None else csv.DictWriter(csv_file, CSV_COLUMNS)
        tum_file = open_lines(to.tum, "--tum", files)
        self.tum = None if tum_file is None else TumFile(tum_file)
        self.frames = self.docks = 0
        self.left_out = self.dropped = 0  # frames that could not be read; of live sources that came too fast
        self.failures = list[str]()
        self._is_silent = to.quiet or "-" in (to.json, to.csv, to.tum)
        self._has_files = any((to.json, to.csv, to.tum, to.annotate))
        self._folders: dict[Path, PictureFolder] = {}

    def folder(self, path: Path) -> "PictureFolder":
        """The folder for annotated pictures of that path, one and the same for all sources."""
        if path not in self._folders:
            self._folders[path] = PictureFolder(path, self.to.protected)
        return self._folders[path]

    def bag(self, source: str, files: contextlib.ExitStack, tell: Callable[[str], None]) -> "Bag":
        """What opens ``--out`` with the first frame of one source, to be closed with ``files``."""

        @functools.cache
        def opened() -> PoseFile | None:
            if self.to.out is None:
                return None
            bag = PoseFile(self.to.out, source, tell, has_pictures=not self.to.no_pictures)
            return files.enter_context(contextlib.closing(bag))

        return opened

    def write(
        self,
        line: dict[str, Any],
        label: str,
        seen: Seen,
        read: Callable[[], Frame],
        keep: Callable[[np.ndarray], object],
        bag: "Bag",
    ) -> None:
        """Write a frame, which ``read`` returns again, and whose annotated picture ``keep`` takes."""
        check_stopped()
        if line["status"] == "method_failed":
            self.failures.append(line["message"])
        if self._json is not None:
            write_line(self._json, line)
        if self._table is not None:
            if self.frames == 0:
                self._table.writeheader()
            self._table.writerow(to_row(line))
        if self.tum is not None:
            self.tum.write(line)
        if self.to.annotate is not None:
            keep(annotate(read().picture(), seen.found, headline=headline_of(seen.trust)))
        # Of a sequence, whose progress is shown, the files tell; of pictures by themselves a line tells too.
        if not self._is_silent and (seen.track is None or not self._has_files):
            put(f"{label}: {_sentences(line, seen.trust)}")
        self.frames += 1
        self.docks += line["status"] == "ok"
        if (file := bag()) is not None:
            if not self.to.no_pictures:
                frame = read()
                is_kept = (frame.encoded or b"").startswith(AS_THEY_CAME)
                seen = dataclasses.replace(seen, picture=frame.encoded if is_kept else to_png(frame.image))
            file.write(seen, line["time_s"], line["time_unix_s"])

    def miss(self, left_out: int, dropped: int) -> None:
        """Count frames of a source that could not be read, and that came too fast."""
        self.left_out += left_out
        self.dropped += dropped

    def put_sum(self, noun: str) -> None:
        """Say in how many of several pictures or frames a dock was found, and how many are missing."""
        if self._is_silent or self.frames + self.left_out < (2 if noun == "pictures" else 1):
            return
        out = f"; {self.left_out} left out" if self.left_out else ""
        out += f"; {self.dropped} more dropped, which came too fast" if self.dropped else ""
        put(f"{self.docks} of {self.frames + self.left_out} {noun} show a dock{out}")
        if self.tum is not None:
            put(f"--tum {self.to.tum}: {self.tum.summary()}")


def _sentences(line: dict[str, Any], trust: Trust) -> str:
    trusted = "" if trust.verdict == NO_POSE else f" {trust.sentence}"
    is_open = line["status"] == "not_a_ring" and line["dock"]["lights"] is None
    hint = " Give --lights N if you know how many the dock has." if is_open else ""
    return f"{line['message']}{trusted}{hint}"


_CLOCKS = ("time_unix_s", "time_s")
Bag = Callable[[], PoseFile | None]


class TumFile:
    """Chosen poses as SLAM tools read them (TUM's format), a pose a line, all by one clock."""

    def __init__(self, file: "Lines") -> None:
        self._file, self._is_begun = file, False
        self._clock: str | None = None
        self.poses = self.without_pose = self.without_time = 0

    def write(self, line: dict[str, Any]) -> None:
        """Write the pose of a frame's JSON object, if it has one that was measured in it, and a time."""
        if not self._is_begun:
            self._file.write("# time_s x_m y_m z_m qx qy qz qw of T_camera_dock\n")
            self._is_begun = True
        pose = None if (line["track"] or {}).get("predicted") else line["chosen"]
        if pose is None:
            self.without_pose += 1
            return
        self._clock = self._clock or next((clock for clock in _CLOCKS if line[clock] is not None), None)
        if self._clock is None or line[self._clock] is None:
            self.without_time += 1
            return
        self._file.write(" ".join(map(repr, (line[self._clock], *pose["position_m"], *pose["quaternion_xyzw"]))) + "\n")
        self.poses += 1

    def summary(self) -> str:
        """How many poses it has, and why others are missing, in words."""
        text = count(self.poses, "pose")
        text += f"; left out: {count(self.without_pose, 'frame')} without a chosen pose" if self.without_pose else ""
        return f"{text}; left out: {count(self.without_time, 'pose')} without a time" if self.without_time else text


class StandardOutput:
    """Standard output, for lines."""

    def write(self, text: str) -> None:
        """Write whole lines. Raises UserError where that cannot be done."""
        put_text(text)


class LineFile:
    """A file that has whole lines only, each on it as soon as it is written; what was there stays until the first."""

    def __init__(self, path: str, option: str) -> None:
        self._path, self._name, self._count = Path(path), f"{option} {path}", 0
        check_place(self._path, option, in_place=True)
        self._file: GrowingFile | None = None

    def write(self, text: str) -> None:
        """Write a line with its end; where that fails, the file keeps those before it, and the fault is reported."""
        if self._file is None:
            with writing(self._name):
                self._file = GrowingFile(self._path)
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
        if self._file is not None:
            with writing(self._name):
                self._file.close()


Lines = LineFile | StandardOutput  # what lines are written to, each of which is there at once


def open_lines(target: str | None, option: str, files: contextlib.ExitStack) -> Lines | None:
    """The file for lines that an option names, to be closed with ``files``; "-" is standard output, None nothing."""
    if target is None:
        return None
    if target == "-":
        return StandardOutput()
    file = LineFile(target, option)
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
