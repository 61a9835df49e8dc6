"""The trajectory of a dock over the frames of a sequence, for charts and for the path in 3D."""

import math

import numpy as np
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracked

MOST_POINTS = 20_000  # beyond which the oldest are dropped; a live source may run for hours
COLUMNS = ("time_s", "x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "eccentricity", "probability", "lost")
_NOMINAL_HZ = 10.0  # of frames without times


class Trajectory:
    """What was found in each frame, by its number; the columns are ``COLUMNS``."""

    def __init__(self) -> None:
        self._rows: dict[int, tuple[float, ...]] = {}

    def __len__(self) -> int:
        return len(self._rows)

    def note(self, frame: Frame, tracked: Tracked) -> None:
        """Record a frame, replacing any earlier entry."""
        pose, ellipse = tracked.pose, tracked.estimate.ellipse
        place = (math.nan,) * 3 if pose is None else tuple(pose.position_m.tolist())
        thetas = (math.nan,) * 2 if pose is None else (math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad))
        chance = tracked.track.probability
        self._rows[frame.index] = (
            frame.index / _NOMINAL_HZ if frame.time_s is None else frame.time_s,
            *place,
            *thetas,
            math.nan if ellipse is None else ellipse.eccentricity,
            math.nan if chance is None else chance,
            float(tracked.track.lost or tracked.track.predicted),
        )
        while len(self._rows) > MOST_POINTS:
            del self._rows[next(iter(self._rows))]

    def rows(self, first: int = 0, last: int | None = None) -> list[tuple[int, tuple[float, ...]]]:
        """Return the frames from ``first`` to ``last`` that are known, in order, with the columns of each."""
        if last is not None:
            return [(index, self._rows[index]) for index in range(first, last + 1) if index in self._rows]
        return [(index, self._rows[index]) for index in sorted(self._rows) if index >= first]

    def table(self, at_most: int) -> np.ndarray:
        """Rows (N, len(COLUMNS)) in order of time, evenly thinned to ``at_most``; NaN where unknown.

        Of the frames that one row stands for, one without a dock is preferred.
        """
        rows = np.array([self._rows[index] for index in sorted(self._rows)]).reshape(-1, len(COLUMNS))
        step = math.ceil(len(rows) / at_most)
        if step <= 1:
            return rows
        lost = COLUMNS.index("lost")
        starts = np.arange(0, len(rows), step)
        return np.array([max(rows[start : start + step], key=lambda row: row[lost]) for start in starts])

    def path_m(self, at_most: int) -> np.ndarray:
        """Positions (N, 3) of the dock's centre, in the camera's frame, where it was seen."""
        table = self.table(at_most)
        return table[~np.isnan(table[:, 1]) & (table[:, COLUMNS.index("lost")] == 0), 1:4]
