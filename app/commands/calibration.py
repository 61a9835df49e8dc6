"""What is measured once: a camera file from a board's pictures or video, a dock file from a video of the dock."""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from dockpose.app.commands.arguments import camera_of, dock_of, two_numbers
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, kept_at_stop, put, say
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.errors import UserError, blaming, check_place, writing
from dockpose.app.export.parts import sentences
from dockpose.app.export.words import MEDIA, camera_lines, outcome
from dockpose.app.inputs.pictures import expand, known, save_dock
from dockpose.app.inputs.sequences import typed
from dockpose.app.processing.calibration import dock_views
from dockpose.camera.board import Board
from dockpose.camera.calibrate import LENS_CHOICES, UNREADABLE, BoardView, Gathering, calibrate_gathered
from dockpose.camera.coverage import Coverage
from dockpose.camera.files import FORMATS, load_camera, save_camera
from dockpose.camera.fitting import CalibrationError, fit_port
from dockpose.pose.learned.learning import LearnedDock, LearningError, learn_dock
from dockpose.pose.learned.views import DockView
from dockpose.sources import Kind, kind_of, list_pictures, open_frames
from dockpose.sources.boards import Looked, gather, grey_pictures, is_of_frames, squares_in

_OF_FOUR = "tangential"
_RULE = "light   outwards mm     along mm        off plane mm"
KNOWN = {"lens": {"choices": LENS_CHOICES}, "in": {"choices": MEDIA}, "format": {"choices": FORMATS}}


def run_calibrate(arguments: argparse.Namespace) -> int:
    """Run ``dockpose calibrate``; returns the exit status. A line a picture and the outcome go to standard output."""
    board = _board(arguments)
    check_place(arguments.out, "--out", is_new=True)
    if arguments.camera is not None:
        return _run_port(arguments, board)
    gathering, looked = gathered(arguments.sources, board)
    try:
        done = calibrate_gathered(gathering, arguments.lens)
        if arguments.format == "kalibr" and len(done.camera.distortion) > 4:
            say(f"--format kalibr has four coefficients: the lens is fitted as --lens {_OF_FOUR}")
            done = calibrate_gathered(gathering, _OF_FOUR)
    except CalibrationError as error:
        seen = "" if looked is None else f" ({looked.in_words(len(gathering.sightings))})"
        raise UserError(f"{' '.join(arguments.sources)}: {error}{seen}") from error
    with writing(f"--out {arguments.out}"):
        save_camera(done.camera, arguments.out, arguments.format)
    about = camera_lines(done, arguments.medium)
    return _tell(done.views, looked, len(done.views), [*about, f"The camera is in {arguments.out}."])


def _run_port(arguments: argparse.Namespace, board: Board) -> int:
    """Find the port of a camera that is known in air; returns the exit status."""
    if arguments.medium != "water":
        raise UserError(f"--camera {arguments.camera} is for pictures through its port under water: say --in water")
    if arguments.format != "dockpose":
        raise UserError(f"--format {arguments.format} has no place for a port; leave it out")
    with blaming("--camera: "):
        camera = load_camera(arguments.camera)
    gathering, looked = gathered(arguments.sources, board)
    try:
        if gathering.size is not None:
            camera = camera.for_size(*gathering.size)
        found = fit_port(gathering.sightings, camera)
    except ValueError as error:
        raise UserError(f"{' '.join(arguments.sources)}: {error}") from error
    with writing(f"--out {arguments.out}"):
        save_camera(found.camera, arguments.out)
    errors = {each.name: error for each, error in zip(gathering.sightings, found.errors_px.tolist(), strict=True)}
    views = [replace(view, error_px=errors.get(name)) for name, view in gathering.views.items()]
    about = sentences("calibration.txt", "port", found, float(np.sqrt((found.errors_px**2).mean())))
    return _tell(views, looked, len(errors), [*about, f"The camera with its port is in {arguments.out}."])


def _tell(views: Sequence[BoardView], looked: Looked | None, used: int, about: Sequence[str]) -> int:
    """Print what became of each picture, and then about the camera; returns the exit status."""
    width = max(len(view.name) for view in views)
    frames = [] if looked is None else [f"{looked.in_words(used)}."]
    put(*(f"{view.name:{width}}  {outcome(view)}" for view in views), *frames, *about)
    return EXIT_SOME_UNREADABLE if any(view.dropped == UNREADABLE for view in views) else EXIT_ALL_READ


def gathered(sources: Sequence[str], board: Board) -> tuple[Gathering, Looked | None]:
    """The boards in pictures, or in the frames of the one video or live source that was named."""
    with blaming(""):
        is_video = is_of_frames(sources)
    if not is_video:
        gathering = Gathering(board)
        paths = expand(sources)
        sought = f"looking for a board of {board.columns} x {board.rows} squares"
        with FrameProgress(sought, total=len(paths), unit="pictures") as progress:
            for name, grey in grey_pictures(paths, say):
                gathering.add(name, grey)
                progress.step()
        return gathering, None
    gathering = Gathering(board, distinct=True)
    with FrameProgress(sources[0]) as progress, open_frames(sources[0], progress.tell, grey=True) as frames:
        looked = Looked()
        if frames.is_live:
            progress.tell("show the board all over the picture, tilted, near and far; Ctrl+C when it is enough")

        def on_look(now: Looked, covered: Coverage | None) -> None:
            nonlocal looked
            looked = now
            progress.step()
            if covered is not None and frames.is_live:
                wanted = f"; now {covered.wanted[0]}" if covered.wanted else "; that is enough"
                progress.tell(f"{covered.pictures} views, {100 * covered.share:.0f} % of the picture{wanted}")

        with kept_at_stop():
            looked = gather(frames, gathering, on_look)
    return gathering, looked


def _board(arguments: argparse.Namespace) -> Board:
    if arguments.board is None:
        if arguments.charuco is not None:
            raise UserError("--board is needed with --charuco: columns x rows of squares, as 10x7")
        with blaming(""):
            counts = squares_in(arguments.sources)
        say(f"the board has {counts[0]} x {counts[1]} squares, as most pictures show; --board sets another size")
        arguments.board = f"{counts[0]}x{counts[1]}"
    counts = two_numbers(f"--board {arguments.board}", arguments.board, "columns x rows, as 10x7")
    with blaming(f"--board {arguments.board}, --square, --charuco, --marker: "):
        return Board(*counts, arguments.square, arguments.charuco, arguments.marker)


def run_learn_dock(arguments: argparse.Namespace) -> int:
    """Run ``dockpose learn-dock``; returns the exit status. The lights' offsets go to standard output."""
    check_place(arguments.out, "--out", is_new=True)
    kind = kind_of(arguments.source)
    paths = list_pictures(arguments.source) if kind in (Kind.PICTURE, Kind.FOLDER, Kind.GLOB) else ()
    source = typed(arguments.source, camera_of(arguments), dock_of(arguments), paths)
    camera, dock = known(source.name, source.camera, source.dock)
    views: list[DockView] = []
    with FrameProgress(arguments.source) as progress, source.open(progress.tell, grey=True) as frames:
        progress.total = frames.count
        with kept_at_stop():
            for view in dock_views(frames, camera, dock, lambda found: progress.step(frames.dropped)):
                views.append(view)
        all_read = not (frames.skipped or frames.is_cut_short)
    try:
        learned = learn_dock(views, camera, dock, fit_focal=arguments.fit_focal)
    except LearningError as error:
        raise UserError(f"{arguments.source}: {error}") from error
    with writing(f"--out {arguments.out}"):
        save_dock(learned.dock, arguments.out, learned.camera if arguments.fit_focal else None)
    uses = f"The dock is in {arguments.out}; estimate --dock {arguments.out} uses it."
    put(*_dock_report(learned, len(views)), uses)
    return EXIT_ALL_READ if all_read else EXIT_SOME_UNREADABLE


def _dock_report(learned: LearnedDock, views: int) -> Iterator[str]:
    """Lines that tell how far each light is off its place, with one sigma."""
    yield _RULE
    angles = learned.dock.light_angles_rad()
    offsets, sigmas = 1000 * np.array(learned.dock.offsets_m), 1000 * learned.sigmas_m
    for light, angle in enumerate(angles.tolist()):
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        own, sigma = turn @ offsets[light], np.sqrt(turn**2 @ sigmas[light] ** 2)
        yield f"{light:5}  " + "  ".join(f"{each:6.2f} ± {error:4.2f} " for each, error in zip(own, sigma, strict=True))
    yield from sentences("learned_dock.txt", "learned", learned, views, float(np.linalg.norm(offsets, axis=1).max()))
