"""``dockpose simulate``: a scene file in, pictures or a video with their truth out."""

import argparse
import contextlib
import csv
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from dockpose import estimate
from dockpose.app.commands.console import EXIT_ALL_READ, check_stopped, say
from dockpose.app.commands.output import LineFile, open_lines
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.export.video import VideoFile, is_video_file
from dockpose.app.inputs.protected import Protected
from dockpose.app.state.scene import DEFAULT_SCENE
from dockpose.files import remove
from dockpose.simulate import Approach, FilmPlan, Lights, RenderedFrame, Scene, film
from dockpose.simulate.files import (
    TRUTH_COLUMNS,
    TUM_COLUMNS,
    load_sequence,
    save_picture,
    save_sequence,
    truth_row,
    tum_line,
)
from dockpose.simulate.parts import Background

_STILL_RATE_HZ = 10.0
_FRAME_NAME = re.compile(r"frame_(\d+)\.(?:png|yaml)")
_TRUTH_HEAD = f"{','.join(TRUTH_COLUMNS)}\r\n".encode()

# LEDs as bright as they must be to be seen from 20 m.
_BRIGHT = {"lights": Lights(level=2e5), "background": Background(level=10.0, gradient_y=-6.0)}
DEFAULT = FilmPlan(scene=msgspec.structs.replace(DEFAULT_SCENE, **_BRIGHT), motion=Approach(frames=60))


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose simulate``; returns the exit status. What was written stays where it cannot go on."""
    out, sequence = arguments.out, _sequence(arguments.scene, arguments.seed, arguments.frames)
    table, scene = out / "truth.csv", out / "scene.yaml"
    if is_video_file(out):
        table, scene = out.with_suffix(".csv"), out.with_suffix(".yaml")
    beside = [table, scene, *([] if arguments.truth is None else [table.with_suffix(f".{arguments.truth}")])]
    _check_files(out, beside, sequence, arguments.protected)
    with writing(f"--out {out}"), contextlib.ExitStack() as files:
        rows, write = _begin(out, table, scene, sequence, files)
        lines = open_lines(str(beside[2]) if beside[2:] else None, "--truth", files)
        if lines is not None:
            lines.write(f"# {TUM_COLUMNS}\n")
        frames = film(sequence, lambda image, camera: estimate(image, camera, sequence.scene.dock).selected)
        progress = files.enter_context(FrameProgress("simulate", total=sequence.frames, unit="pictures"))
        for frame in frames:
            check_stopped()
            write(frame)
            progress.step()
            rows.writerow(truth_row(frame))  # after each picture, so that an interrupted run leaves both
            if lines is not None:
                lines.write(tum_line(frame))
    say(f"{count(sequence.frames, 'picture')} in {out}, the truth in {' and '.join(map(str, beside[::2]))}")
    return EXIT_ALL_READ


def _sequence(path: str | None, seed: int | None, frames: int | None) -> FilmPlan:
    with blaming("--scene "):
        sequence = DEFAULT if path is None else load_sequence(path)
    with blaming("--"):
        sequence = sequence if seed is None else sequence.with_seed(seed)
        return sequence if frames is None else sequence.with_frames(frames)


def _check_files(out: Path, beside: Sequence[Path], sequence: FilmPlan, protected: Protected) -> None:
    """Raise UserError where a file would be replaced that is read, or that is of no earlier run."""
    if is_video_file(out):
        check_place(out, "--out")
        others = [out, *beside[1:]]
    else:
        there = sorted(out.iterdir()) if out.is_dir() else []
        numbered = {path: name for path in there if (name := _FRAME_NAME.fullmatch(path.name))}
        for path, name in numbered.items():
            if int(name[1]) > sequence.frames:
                raise UserError(f"--out {out}: holds {path.name} of a longer run; empty it, or choose another folder")
        others = [*beside[1:], *numbered]
    is_earlier = False
    if beside[0].is_file():
        with beside[0].open("rb") as file:
            is_earlier = file.read(len(_TRUTH_HEAD)) in (b"", _TRUTH_HEAD)
    for path in (beside[0], *others):
        if path != out:
            protected.check(f"--out {out}: its {path.name}", path)
        if path.is_file() and not is_earlier:
            raise UserError(f"--out {out}: {path} is there already, of no earlier run; give another name, or rename it")
    if is_video_file(out):
        _check_video(out, sequence.scene)


def _check_video(path: Path, scene: Scene) -> None:
    """Raise UserError where a video of that kind cannot hold the scene's pictures."""
    is_mp4, bits, is_colour = path.suffix.lower() == ".mp4", scene.sensor.bits, scene.sensor.colour != "grey"
    if bits != 8 and (is_mp4 or is_colour):
        other = "a folder" if is_colour else "NAME.mkv or a folder"
        raise UserError(f"--out {path}: stores 8 bits, the scene's sensor has {bits}; use {other}")
    if is_mp4 and (scene.camera.width % 2 or scene.camera.height % 2):
        size = f"{scene.camera.width} x {scene.camera.height}"
        raise UserError(f"--out {path}: an MP4 needs an even width and height, the camera has {size} pixels")


def _begin(
    out: Path, table: Path, scene: Path, sequence: FilmPlan, files: contextlib.ExitStack
) -> "tuple[csv.DictWriter[str], Callable[[RenderedFrame], None]]":
    """Write the scene, and open the table of the truth, and what takes the pictures."""
    if not is_video_file(out):
        out.mkdir(parents=True, exist_ok=True)
    lines = LineFile(str(table), "--out")
    if is_video_file(out):
        files.callback(_remove_without, out, (table, scene))
    files.callback(lines.close)
    rows = csv.DictWriter(lines, TRUTH_COLUMNS)
    rows.writeheader()
    save_sequence(sequence, scene)
    if not is_video_file(out):
        return rows, lambda frame: save_picture(frame.image, frame.scene, frame.truth, out, f"frame_{frame.number:04d}")
    rate_hz = _STILL_RATE_HZ if sequence.motion is None else sequence.motion.rate_hz
    video = files.enter_context(VideoFile(out, rate_hz))
    return rows, lambda frame: video.write(frame.image, frame.time_s)


def _remove_without(video: Path, beside: Sequence[Path]) -> None:
    """Remove what belongs to a video that was not written, which would only mislead."""
    if not video.exists():
        for path in beside:
            remove(path)
