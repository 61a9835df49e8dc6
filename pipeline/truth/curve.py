"""A measured trajectory as a smooth curve, its noise as it shows in its own rows, and where it has gaps."""

from dataclasses import dataclass

import numpy as np
from dockpose.truth.trajectory import GAP, Trajectory
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded
from scipy.spatial.transform import Rotation

_GAP_S = 0.1  # in a shorter gap the curve is as well known as elsewhere
_WIDTHS = np.geomspace(1.5, 400, 30)  # widths of smoothing that are tried, in rows
_TRIED = 6000  # rows on which they are tried
_TIMES = 3  # what is left is smoothed again and added, which bends the curve less (twicing, Tukey 1977)
_OMEGA = np.linspace(0, np.pi, 4001)[1:]


@dataclass(frozen=True)
class Moment:
    """Where the body is at N times, and how it moves."""

    rotation: np.ndarray  # (N, 3, 3): body to world
    position_m: np.ndarray  # (N, 3)
    velocity_m_per_s: np.ndarray  # (N, 3): in the world
    turn_rad_per_s: np.ndarray  # (N, 3): about the body's axes
    is_measured: np.ndarray  # (N,): whether in no gap


class Curve:
    """Cubic smoothing splines through positions and quaternions (Reinsch 1967), smoothed as their noise asks for."""

    def __init__(self, truth: Trajectory) -> None:
        assert truth.quaternions_xyzw is not None
        self._start_s, times = truth.times_s[0], truth.times_s - truth.times_s[0]
        self.times_s = truth.times_s
        self.middle_m = truth.positions_m.mean(axis=0)
        steps = np.diff(times)
        self._gaps = np.flatnonzero(steps > max(GAP * float(np.median(steps)), _GAP_S))
        turns = truth.quaternions_xyzw / np.linalg.norm(truth.quaternions_xyzw, axis=1)[:, None]
        signs = np.sign((turns[1:] * turns[:-1]).sum(axis=1))
        turns = turns * np.concatenate([[1.0], np.cumprod(np.where(signs == 0, 1.0, signs))])[:, None]
        self._places, self.position_sigma_m, self.width_s = _smoothed(times, truth.positions_m)
        self._turns, turn_sigma, width_s = _smoothed(times, turns)
        self.turn_sigma_rad = 2 * turn_sigma  # of a quaternion of length 1 half the rotation shows
        self.width_s = max(self.width_s, width_s)

    def at(self, times_s: np.ndarray) -> Moment:
        """The body at times (N,) by the trajectory's clock."""
        after = np.searchsorted(self.times_s, times_s)
        measured = (after > 0) & (after < len(self.times_s)) & ~np.isin(after - 1, self._gaps)
        times = np.clip(times_s, self.times_s[0], self.times_s[-1]) - self._start_s
        place, velocity, turn, change = (one(times, nu) for one in (self._places, self._turns) for nu in (0, 1))
        length = np.linalg.norm(turn, axis=1)[:, None]
        turn, change = turn / length, change / length
        x, y, z, w = turn.T
        # Twice the vector part of the conjugate times the change.
        rows = [[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z]]
        spin = 2 * np.column_stack([sum(a * b for a, b in zip(row, change.T, strict=True)) for row in rows])
        return Moment(Rotation.from_quat(turn).as_matrix(), place, velocity, spin, measured)


def _smoothed(times: np.ndarray, values: np.ndarray) -> tuple[CubicSpline, float, float]:
    """Spline of values (N, K), the standard error that is left in each, and the width of smoothing in seconds.

    The width has the least risk (Mallows 1973), by the eigenvalues of a spline with even rows and the noise that the
    narrowest one leaves out.
    """
    step, part = float(np.median(np.diff(times))), slice(0, _TRIED)
    tried, noise = [], 0.0
    for width in _WIDTHS[max(2.0, len(times) / 10) > _WIDTHS]:
        out = (1 - 1 / (1 + width**4 * (2 - 2 * np.cos(_OMEGA)) ** 2 * 3 / (2 + np.cos(_OMEGA)))) ** _TIMES
        off = float(np.mean((values[part] - _through(times[part], values[part], (width * step) ** 4 / step)) ** 2))
        noise = noise or off / float((out**2).mean())
        left, bent = noise * float(((1 - out) ** 2).mean()), off - noise * float((out**2).mean())
        tried.append((left + bent, left + max(0.0, bent), width * step))
    _, risk, width_s = min(tried)
    return (
        CubicSpline(times, _through(times, values, width_s**4 / step), bc_type="natural"),
        float(np.sqrt(risk)),
        width_s,
    )


def _through(times: np.ndarray, values: np.ndarray, weight: float, times_more: int = _TIMES) -> np.ndarray:
    """Values (N, K) of the smoothing spline, whose squared curvature counts with a weight (Reinsch 1967)."""
    steps = np.diff(times)
    one, two = 1 / steps[:-1], 1 / steps[1:]
    middle = -(one + two)
    bands = np.zeros((3, len(middle)))  # of R + weight Q'Q, the lower ones
    bands[0] = (steps[:-1] + steps[1:]) / 3 + weight * (one**2 + middle**2 + two**2)
    bands[1, :-1] = steps[1:-1] / 6 + weight * (middle[:-1] * one[1:] + two[:-1] * middle[1:])
    bands[2, :-2] = weight * two[:-2] * one[2:]
    bends = solveh_banded(bands, np.diff(np.diff(values, axis=0) / steps[:, None], axis=0), lower=True)
    off = np.zeros_like(values)
    off[:-2] += weight * one[:, None] * bends
    off[1:-1] += weight * middle[:, None] * bends
    off[2:] += weight * two[:, None] * bends
    return values - off if times_more == 1 else values - off + _through(times, off, weight, times_more - 1)
