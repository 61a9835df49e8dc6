"""Whether the camera moves: groups that move together, as all does that stands in the water when the camera moves."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from dockpose.lights.growing import distances

FRAMES = 8  # over which groups are followed
MOVED_PX = 2.0  # over so many frames; less is no motion
_STRIDE_PX = 20.0  # a group moves no farther from one frame to the next, or is lost
_LEAST = 5  # groups that move together, as many as a ring needs; and at least half of those that move
_OFF_PX, _OFF_SHARE = 0.5, 0.1  # of how far they moved: by so much a scene differs from a flat one that only turns
_MOST = 400  # groups; of so many none can be followed


@dataclass(frozen=True)
class Motion:
    """How the picture moved: points p, as complex numbers, were at (p - shift) / turn so many frames before."""

    turn: complex
    shift: complex
    points_px: np.ndarray  # (N, 2): where the groups are now that moved together

    def moves_px(self, points_px: np.ndarray) -> np.ndarray:
        """How far (N,) points (N, 2) of the scene would have moved away from where they are now."""
        places = points_px[:, 0] + 1j * points_px[:, 1]
        return np.abs(places * (self.turn - 1) + self.shift)


class Paths:
    """Follows groups from frame to frame, each to the nearest one if that is nearest to no other."""

    def __init__(self) -> None:
        self._paths: list[deque[complex]] = []

    def see(self, points_px: np.ndarray) -> Motion | None:
        """How the picture moved by the next groups (N, 2)."""
        if len(points_px) > _MOST:
            self._paths = []
            return None
        ends = self.ends_px()
        kept: list[deque[complex]] = []
        free = np.ones(len(points_px), dtype=bool)
        if len(ends) and len(points_px):
            apart = distances(ends, points_px)
            nearest, back = apart.argmin(axis=1), apart.argmin(axis=0)
            for number in np.flatnonzero(back[nearest] == np.arange(len(ends))).tolist():
                point = nearest[number]
                if apart[number, point] < _STRIDE_PX:
                    self._paths[number].append(complex(*points_px[point].tolist()))
                    kept.append(self._paths[number])
                    free[point] = False
        self._paths = kept + [deque([complex(*point)], maxlen=FRAMES + 1) for point in points_px[free].tolist()]
        return self._motion()

    def ends_px(self) -> np.ndarray:
        """Where (N, 2) each path's group was seen last."""
        return np.array([(path[-1].real, path[-1].imag) for path in self._paths]).reshape(-1, 2)

    def _motion(self) -> Motion | None:
        long = [path for path in self._paths if len(path) > FRAMES and abs(path[-1] - path[0]) > MOVED_PX]
        least = max(_LEAST, (len(long) + 1) // 2)
        if len(long) < least:
            return None
        before = np.array([path[0] for path in long], dtype=np.complex128)
        now = np.array([path[-1] for path in long], dtype=np.complex128)
        together, turn, shift = _moved_together(before, now, least)
        if not len(together):
            return None
        return Motion(turn, shift, now[together].view(float).reshape(-1, 2))


def _moved_together(before: np.ndarray, now: np.ndarray, least: int) -> tuple[np.ndarray, complex, complex]:
    """Numbers (K,) of points (N,) complex that moved as one, ``least`` or more or else none, and the turn and shift."""
    together = np.arange(len(now))
    while len(together) >= least:
        old, new = before[together], now[together]
        centred = old - old.mean()
        turn = np.vdot(centred, new) / max(np.vdot(centred, centred).real, 1e-9)
        shift = new.mean() - turn * old.mean()
        off = np.abs(new - turn * old - shift)
        if off.max() <= _OFF_PX + _OFF_SHARE * np.median(np.abs(new - old)):
            return together, complex(turn), complex(shift)
        together = np.delete(together, off.argmax())
    return np.empty(0, dtype=int), 0j, 0j
