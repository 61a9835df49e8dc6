"""``dockpose learn-dock``: a video of a dock in, a dock file with where its lights really are out."""

import argparse
from collections.abc import Iterator

import numpy as np
from dockpose.app.commands.arguments import add_options, camera_of, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, kept_at_stop, put
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.errors import UserError, check_place, writing
from dockpose.app.export.parts import sentences
from dockpose.app.inputs.sequences import typed
from dockpose.app.inputs.sidecar import known, save_dock
from dockpose.app.processing.calibration import dock_views
from dockpose.pose.learned.learning import LearnedDock, LearningError, learn_dock
from dockpose.pose.learned.views import DockView
from dockpose.sources import Kind, kind_of, list_pictures

_RULE = "light   outwards mm     along mm        off plane mm"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add those of ``dockpose learn-dock``."""
    add_options(parser, "learn-dock_source", "camera_and_dock", "learn-dock")


def run(arguments: argparse.Namespace) -> int:
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
    put(*report(learned, len(views)), uses)
    return EXIT_ALL_READ if all_read else EXIT_SOME_UNREADABLE


def report(learned: LearnedDock, views: int) -> Iterator[str]:
    """Lines that tell how far each light is off its place, with one sigma."""
    yield _RULE
    angles = learned.dock.light_angles_rad()
    offsets, sigmas = 1000 * np.array(learned.dock.offsets_m), 1000 * learned.sigmas_m
    for light, angle in enumerate(angles.tolist()):
        turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        own, sigma = turn @ offsets[light], np.sqrt(turn**2 @ sigmas[light] ** 2)
        yield f"{light:5}  " + "  ".join(f"{each:6.2f} ± {error:4.2f} " for each, error in zip(own, sigma, strict=True))
    yield from sentences("learned_dock.txt", "learned", learned, views, float(np.linalg.norm(offsets, axis=1).max()))
