"""``dockpose compare``: every threshold method on the same pictures, each up to the pose that it leads to."""

import argparse
import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dockpose import Estimate, Settings
from dockpose.app.commands.arguments import camera_of, dock_of, masks_of, turned
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, put, say
from dockpose.app.commands.export import check_out, write_out
from dockpose.app.commands.output import open_lines, write_line
from dockpose.app.drawing.numbers import chance, number, pose_cells
from dockpose.app.errors import UserError, blaming
from dockpose.app.inputs.pictures import Batch, Picture, known, take_labels
from dockpose.app.inputs.sequences import FrameSource, resolve
from dockpose.app.processing.comparison import compare
from dockpose.app.processing.judged import HEAD, Judged, Known, judged, known_by_hand, summary
from dockpose.files import FileError
from dockpose.pose.known import KnownPose, pose_error
from dockpose.sidecar import read_sidecar
from dockpose.simulate import load_scene, truth_of
from dockpose.sources import Kind, kind_of
from dockpose.text import printable

_OF_LINE = ("status", "message", "candidates", "selected", "elapsed_ms")
_HEAD = ("method", "level", "groups", "on ring", "z cm", "theta x", "theta y", "chance", "ms")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose compare``; prints a table of each picture unless a file is asked for. Returns the exit status."""
    settings, camera, dock = Settings(masks=masks_of(arguments)), camera_of(arguments), dock_of(arguments)
    live = next((source for source in arguments.sources if kind_of(source) in (Kind.CAMERA, Kind.STREAM)), None)
    if live is not None:
        raise UserError(f"{live}: does not end; compare takes pictures and recordings, and estimate --record makes one")
    if arguments.out is not None:
        check_out(arguments.out)
    rows: list[Judged] = []
    parts = resolve(arguments.sources, camera, dock, say, topic=arguments.topic, rotate_deg=arguments.rotate)

    if arguments.lights_at is not None:
        with blaming("--lights-at "):
            take_labels(parts, arguments.lights_at, say, snap=False)

    def work(picture: Picture) -> dict[str, Estimate]:
        return compare(picture.image, picture.camera, picture.dock, settings)

    with contextlib.ExitStack() as files:
        json_file = open_lines(arguments.json, "--json", files)

        def write(picture: Picture, found: Mapping[str, Estimate], frame: int = 0, label: str = "") -> None:
            if json_file is not None:
                write_line(json_file, to_line(picture, found, frame) | turned(arguments))
            else:
                truth = _truth(picture.path, arguments.rotate)
                put(*table(f"{picture.path}{label and f' {label}'}", found, truth).split("\n"))

        all_read = all(part is not None for part in parts)
        for part in parts:
            if isinstance(part, Batch):
                both = part.run(lambda picture: (_known(picture, arguments.rotate), work(picture)))
                for picture, (known, found) in both:
                    write(picture, found)
                    if known is not None:
                        rows += judged(str(picture.path), found, known)
                all_read &= part.left_out == 0
            elif part is not None:
                all_read &= _compare_frames(
                    part, lambda one, frame: write(one, work(one), frame, f"frame_{frame + 1:04d}")
                )
    _write_judged(rows, arguments)
    return EXIT_ALL_READ if all_read else EXIT_SOME_UNREADABLE


def _write_judged(rows: Sequence[Judged], arguments: argparse.Namespace) -> None:
    """Print, or write, how the methods did on pictures whose lights are known."""
    pictures = len({row.picture for row in rows})
    if pictures > 1 and arguments.json is None:
        put(*columns(f"{pictures} pictures whose lights are known", [HEAD, *summary(rows)]))
    if arguments.out is not None and not rows:
        raise UserError(f"--out {arguments.out}: of no picture the lights are known; set them in NAME.yaml (lights_px)")
    if arguments.out is not None:
        from dockpose.app.export.judged import judged_files  # what draws takes a while to import

        write_out(judged_files(rows), arguments.out, arguments.protected)


def _known(picture: Picture, rotate_deg: int) -> Known | None:
    """What is known of the lights of a picture: those set by hand, or those of the scene that it was rendered from."""
    if picture.by_hand is not None:
        return known_by_hand(picture.estimate(Settings()))
    try:
        truth = truth_of(load_scene(picture.path.with_suffix(".yaml")))
    except (FileError, ValueError):
        return None
    pose = _truth(picture.path)
    return None if rotate_deg else Known(truth.lights_px[truth.visible], pose)


def _compare_frames(source: FrameSource, work: Callable[[Picture, int], None]) -> bool:
    """Compare on each frame of a sequence, given with its index; whether all could be read."""
    try:
        with source.open(say) as frames:
            camera, dock = known(source.name, frames.camera, frames.dock)
            for frame in frames:
                work(Picture(Path(frame.name), frame.image, "", camera, dock), frame.index)
            return not (frames.skipped or frames.is_cut_short)
    except UserError:
        raise
    except ValueError as error:
        say(str(error) if source.name in str(error) else f"{source.name}: {error}")
        return False


def to_line(picture: Picture, found: Mapping[str, Estimate], frame: int = 0) -> dict[str, Any]:
    """One picture's comparison as a JSON object; unknown values are None, never left out."""
    methods = {}
    for name, one in found.items():
        line = one.to_dict()
        methods[name] = {key: (line["threshold"] or {}).get(key) for key in ("level", "groups")}
        methods[name] |= {"on_ring": one.lights_on_ring, **{key: line[key] for key in _OF_LINE}}
    return {"source": str(picture.path), "frame": frame, "sha256": picture.sha256 or None, "methods": methods}


def table(title: str, found: Mapping[str, Estimate], truth: KnownPose | None = None) -> str:
    """Return a table in plain text, a row a method, under a title; the last column says how far off, or why."""
    return "\n".join(columns(title, [(*_HEAD, ""), *(_cells(name, one, truth) for name, one in found.items())])) + "\n"


def columns(title: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a title and lines of columns; the first of these, and one without a head, stands at the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    signs = ["<" if at == 0 or not head else ">" for at, head in enumerate(rows[0])]
    lines = [printable(title)]
    for row in rows:
        cells = (f"{cell:{sign}{wide}}" for cell, wide, sign in zip(row, widths, signs, strict=True))
        lines.append("  ".join(("", *cells)).rstrip())
    return lines


def _cells(name: str, found: Estimate, truth: KnownPose | None) -> tuple[str, ...]:
    pose, error = found.selected, pose_error(found.selected, truth)
    numbers = ["-"] * 4 if pose is None else [*pose_cells(pose)[2:], chance(pose) or "-"]
    level = None if found.threshold is None else found.threshold.level
    groups = None if found.markers is None else len(found.markers)
    counts = ("-" if count is None else str(count) for count in (level, groups, found.lights_on_ring))
    remark = found.message if pose is None else "pose found"
    if error is not None:
        remark = f"{'right' if error.agrees else 'wrong'}: {error}"
    return (name, *counts, *numbers, number(found.elapsed_ms), remark)


def _truth(path: Path, rotate_deg: int = 0) -> KnownPose | None:
    """The truth by the YAML beside a picture, in the turned camera; None where there is none or it cannot be read."""
    try:
        truth = read_sidecar(path).truth
        return None if truth is None else truth.rotated(rotate_deg)
    except FileError:
        return None
