"""Boards in pictures, videos and live sources, gathered from frames as the command and the page do it."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import numpy as np
from dockpose.camera.board import Board, Sighting, count_squares
from dockpose.camera.calibrate import (
    ALIKE,
    LENS_CHOICES,
    NO_BOARD,
    Calibration,
    Gathering,
    calibrate_gathered,
    calibrate_pictures,
)
from dockpose.camera.coverage import Coverage, coverage_of
from dockpose.camera.image import orientation_sentence, to_grey, to_levels
from dockpose.checks import check_is, check_one_of
from dockpose.sources.frames import Callback, Frames, SourceError
from dockpose.sources.kinds import Kind, kind_of
from dockpose.sources.opening import open_frames
from dockpose.sources.pictures import list_pictures, read_tagged
from numpy.typing import ArrayLike

MOST_BOARDS = 40  # of a video; more tell hardly more
ENOUGH_LIVE = 15
_LOOKS_HZ, _MOST_LOOKS = 6.0, 600
_SORTS = {ALIKE: "were like others", NO_BOARD: "show no board"}
_LIVE = (Kind.CAMERA, Kind.STREAM)
_LOOKED_AT = 60  # frames of a video in which the board's size is looked for


@dataclass
class Looked:
    """How many frames were looked at, and what became of them."""

    frames: int = 0  # number of frames that were looked at
    left_out: Counter[str] = field(default_factory=Counter)  # how many were left out, by the reason in a few words
    last: Sighting | None = None  # the board in the newest frame
    grey: np.ndarray | None = None  # the newest frame (H, W)

    def see(self, gathering: Gathering, image: np.ndarray, name: str) -> Sighting | None:
        """Look for the board in one more frame, (H, W) or (H, W, 3); only frames that count stay in the gathering."""
        self.frames += 1
        self.grey = to_levels(to_grey(image))[0]
        self.last = gathering.add(name, self.grey, thorough=False)
        dropped = gathering.views[name].dropped
        if dropped:
            del gathering.views[name]
            self.left_out[_SORTS.get(dropped, dropped)] += 1
        for other in [other for other, view in gathering.views.items() if view.dropped == ALIKE]:
            del gathering.views[other]  # its place was taken by a sharper one
        return self.last

    def in_words(self, used: int) -> str:
        """For people: "310 frames looked at: 25 used, 200 were like others, 85 show no board"."""
        parts = [f"{used} used", *(f"{count} {why}" for why, count in self.left_out.most_common())]
        return f"{self.frames} frames looked at: {', '.join(parts)}"


def gather(
    frames: Frames,
    gathering: Gathering,
    on_look: Callable[[Looked, Coverage | None], None] = lambda looked, seen: None,
    prefix: str = "",
) -> Looked:
    """Gather boards from frames: to the end of a recording, or from a live source until they are enough."""
    looked = Looked()
    every = max(1, round((frames.rate_hz or 1.0) / _LOOKS_HZ), (frames.count or 0) // _MOST_LOOKS)
    every = 1 if frames.is_live else every
    for number, frame in enumerate(frames):
        if number % every:
            continue
        before = len(gathering.sightings)
        looked.see(gathering, frame.image, f"{prefix}frame {frame.index}")
        is_new = len(gathering.sightings) > before and gathering.size is not None
        covered = coverage_of(gathering.sightings, gathering.size) if is_new and gathering.size else None
        on_look(looked, covered)
        enough = ENOUGH_LIVE if frames.is_live else MOST_BOARDS
        if covered is not None and covered.is_enough and covered.pictures >= enough:
            break
    return looked


def is_of_frames(sources: Sequence[str]) -> bool:
    """Whether it is a video or a live source, rather than pictures. Raises SourceError where it is one of several."""
    is_any = any(kind_of(source) in (Kind.PAGES, Kind.VIDEO, Kind.BAG, *_LIVE) for source in sources)
    if is_any and len(sources) > 1:
        raise SourceError(f"{' '.join(sources)}: a video or live camera is calibrated alone")
    return is_any


def squares_in(sources: Sequence[str]) -> tuple[int, int]:
    """Columns and rows of the chessboard that pictures or a video show. Raises SourceError where none is seen whole."""
    name = " ".join(sources)
    if is_of_frames(sources):
        if kind_of(sources[0]) in _LIVE:
            raise SourceError(f"{name}: --board is needed for a live camera: columns x rows of squares, as 10x7")
        with open_frames(sources[0], grey=True) as frames:
            step = max(1, (frames.count or 0) // _LOOKED_AT)
            counts = count_squares(to_levels(to_grey(frame.image))[0] for frame in islice(frames, 0, None, step))
    else:
        paths = [path for source in sources for path in list_pictures(source)]
        if len(paths) == 1:
            read_tagged(paths[0])  # says what is amiss
        counts = count_squares(grey for _, grey in grey_pictures(paths) if grey is not None)
    if counts is None:
        raise SourceError(f"{name}: no chessboard is found whole; show all of it, or say --board, as 10x7")
    return counts


def grey_pictures(paths: Sequence[Path], tell: Callback = lambda text: None) -> Iterator[tuple[str, np.ndarray | None]]:
    """Names and grey pictures of 8 bits, None for what cannot be read; ``tell`` hears of tags of orientation."""
    known = {1}
    for path in paths:
        try:
            image, _, _, tag, _ = read_tagged(path)
        except (OSError, ValueError):
            yield path.name, None
            continue
        if tag not in known:
            known.add(tag)
            tell(orientation_sentence(tag, str(path)))
        yield path.name, to_levels(to_grey(image))[0]


def calibrate(
    source: str | os.PathLike[str] | Iterable[tuple[str, ArrayLike | None]],
    board: Board | None = None,
    lens: str = "auto",
    *,
    square_m: float | None = None,
) -> Calibration:
    """Calibrate a camera from pictures or a video of a board, as ``dockpose calibrate`` does.

    Parameters
    ----------
    source : str, path-like, or iterable of (str, (H, W) or (H, W, 3) array or None)
        A folder, picture, glob, video or live camera; or pictures by their names, None for one that cannot be read.
    board : Board, optional
        The board; without it the squares of a chessboard are counted in the pictures.
    lens : str
        Lens model, "auto" for the stiffest that the pictures do not speak against.
    square_m : float, metres, optional
        Side of a square, where no board is given.

    Returns
    -------
    Calibration
        The camera, the overall error and what became of each picture.

    Raises
    ------
    ValueError
        If neither or both of ``board`` and ``square_m`` are given, or the pictures do not determine a camera.
    """
    if (board is None) == (square_m is None):
        raise ValueError("board and square_m: give a Board, or the side of its squares in metres")
    if not isinstance(source, (str, os.PathLike)):
        if board is None:
            source = list(source)
            counts = count_squares(to_levels(to_grey(image))[0] for _, image in source if image is not None)
            if counts is None:
                raise ValueError("source shows no chessboard whole; give its Board")
            board = Board(*counts, square_m or 0.0)
        return calibrate_pictures(source, board, lens)
    check_one_of("lens", lens, LENS_CHOICES)
    sources = [os.fspath(source)]
    board = check_is("board", board or Board(*squares_in(sources), square_m or 0.0), Board)
    if not is_of_frames(sources):
        return calibrate_pictures(grey_pictures(list_pictures(sources[0])), board, lens)
    gathering = Gathering(board, distinct=True)
    with open_frames(sources[0], grey=True) as frames:
        gather(frames, gathering)
    return calibrate_gathered(gathering, lens)
