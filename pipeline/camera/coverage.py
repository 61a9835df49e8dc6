"""How much of the picture, of tilts and of distances the boards cover, and what to photograph next."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose.camera.board import Sighting

ENOUGH_PICTURES = 12
_CELLS = 3
_ALIKE_SHARE = 0.05  # of the longer side: boards whose outlines are nearer than this are alike
_SEEN_TWICE = 2  # pictures whose board reaches into a part of the picture
_TILTED_DEG, _TILTED_PICTURES = 15.0, 2
_NEAR_AND_FAR = 1.4  # largest distance of the board, relative to the smallest
_PLACES = (("upper left", "top", "upper right"), ("left", "middle", "right"), ("lower left", "bottom", "lower right"))


@dataclass(frozen=True)
class Coverage:
    """What boards in pictures cover."""

    pictures: int  # number of boards
    # (3, 3): in how many pictures the board reaches into each part of the picture, from the upper left
    cells: np.ndarray
    # (N, 2): how far each board is turned: its right edge away from the camera, its lower edge away from the camera
    tilts_deg: np.ndarray
    distances: np.ndarray  # (N,): distances of the boards, relative to the nearest

    @property
    def wanted(self) -> tuple[str, ...]:
        """What is missing, in words, as "the board in the lower left"; empty where the pictures are enough."""
        empty = [_PLACES[row][column] for row, column in np.argwhere(self.cells < _SEEN_TWICE)]
        named = " and the ".join(filter(None, [", the ".join(empty[:-1]), *empty[-1:]]))
        wanted = [f"the board in the {named} of the picture"] if empty else []
        for axis, ways in enumerate((("left", "right"), ("top", "bottom"))):
            for sign, way in zip((-1, 1), ways, strict=True):
                tilted = sign * self.tilts_deg[:, axis] > _TILTED_DEG if self.pictures else np.zeros(0)
                if tilted.sum() < _TILTED_PICTURES:
                    wanted.append(f"the board tilted by 20 to 40 degrees, its {way} edge away from the camera")
        if self.pictures and self.distances.max() < _NEAR_AND_FAR:
            wanted.append("the board nearer and farther")
        if self.pictures < ENOUGH_PICTURES and not wanted:
            wanted.append(f"{ENOUGH_PICTURES - self.pictures} more")
        return tuple(wanted)

    @property
    def is_enough(self) -> bool:
        """Whether nothing is missing."""
        return not self.wanted

    @property
    def share(self) -> float:
        """Share (0 to 1) of the parts of the picture that boards have reached twice."""
        return float((self.cells >= _SEEN_TWICE).mean())


def coverage_of(sightings: Sequence[Sighting], size: tuple[int, int], focal_px: float | None = None) -> Coverage:
    """Work out what boards cover. ``size`` in pixels."""
    cells = np.zeros((_CELLS, _CELLS), dtype=int)
    tilts, distances = [], []
    focal = focal_px or float(max(size))
    K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
    for sighting in sightings:
        places = np.clip((sighting.picture_px / size * _CELLS).astype(int), 0, _CELLS - 1)
        reached = np.zeros_like(cells)
        reached[places[:, 1], places[:, 0]] = 1
        cells += reached
        _, turn, shift = cv2.solvePnP(
            sighting.board_m.astype(float), sighting.picture_px.astype(float), K, None, flags=cv2.SOLVEPNP_IPPE
        )
        away = cv2.Rodrigues(turn)[0][:, 2]
        away = away * np.sign(away[2])
        tilts.append(np.degrees([np.arctan2(-away[0], away[2]), np.arctan2(-away[1], away[2])]))
        distances.append(float(np.linalg.norm(shift)))
    relative = np.array(distances) / min(distances) if distances else np.zeros(0)
    return Coverage(len(sightings), cells, np.array(tilts).reshape(-1, 2), relative)


def first_alike(
    sighting: Sighting, others: Sequence[Sighting], extent_m: tuple[float, float], size: tuple[int, int]
) -> int:
    """Index of the first of other boards of that extent that lies as one does; how many they are where none does.

    Of two boards whose outlines are so near each other in a picture of that size, one tells as much as both.
    """
    columns, rows = extent_m
    outline_m = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]])
    own = sighting.seen_px(outline_m)
    for index, other in enumerate(others):
        theirs = other.seen_px(outline_m)
        halfway = np.roll(theirs, 2, axis=0)  # a chessboard may be seen turned by half a turn
        if min(np.linalg.norm(own - each, axis=1).max() for each in (theirs, halfway)) < _ALIKE_SHARE * max(size):
            return index
    return len(others)


def poses_of(sightings: Sequence[Sighting], size: tuple[int, int]) -> np.ndarray:
    """Number (N,) of each board's pose, from 0; boards that lie alike have the same."""
    columns_m, rows_m, _ = np.max([sighting.board_m.max(axis=0) for sighting in sightings], axis=0).tolist()
    first: list[Sighting] = []
    poses = []
    for sighting in sightings:
        poses.append(first_alike(sighting, first, (columns_m, rows_m), size))
        if poses[-1] == len(first):
            first.append(sighting)
    return np.array(poses)
