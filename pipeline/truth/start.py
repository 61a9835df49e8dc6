"""Where the search for clocks, mount and dock begins: every offset is tried, and many rotations of the camera."""

import numpy as np
from dockpose.truth.curve import Curve
from dockpose.truth.model import Frames, Setup
from scipy.fft import next_fast_len
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

_STEP_S = 0.1
_MOST_STEPS = 60_000
_NOISE = 0.02  # of positions, as a share of the range: beside it numbers of 1 and lengths of 10 m are taken as likely
_LIKELY = np.repeat([1.0, 10.0], [9, 6])
_JUMP = 0.1  # of the range, from the median of neighbours: another dock


def starts(frames: Frames, curve: Curve, offset_s: float | None, given: np.ndarray | None) -> list[Setup]:
    """Setups from which to search, by :func:`scanned` and by each rotation that maps axes to axes, or a given one."""
    lag_s, mount, some = scanned(frames, curve, offset_s)
    at, (seen_m, _) = curve.at(some.times_s + lag_s), some.positions_m
    to_body, known = at.rotation.transpose(0, 2, 1), at.is_measured & np.isfinite(some.positions_m[0]).all(axis=1)
    x, y = some.angles_rad[0].T
    normals = -Rotation.from_euler("YX", np.nan_to_num(np.column_stack([y, x]))).as_matrix()[:, :, 2]
    found = []
    for rotation in [mount, *Rotation.create_group("O").as_matrix()] if given is None else [given]:
        # Of R'(d - p) - t = C x: lever t and place d, a little pulled to nothing.
        by = np.concatenate([to_body, np.broadcast_to(-np.eye(3), to_body.shape)], axis=2)[known].reshape(-1, 6)
        body = seen_m @ rotation.T + np.einsum("nij,nj->ni", to_body, at.position_m)
        solved = np.linalg.lstsq(
            np.vstack([by, 1e-3 * np.eye(6)]), np.concatenate([body[known].ravel(), np.zeros(6)]), rcond=None
        )[0]
        normal = np.einsum("nij,jk,nk->ni", at.rotation, rotation, normals)[known].mean(axis=0)
        normal /= max(float(np.linalg.norm(normal)), 1e-9)
        found.append(Setup(lag_s, 0.0, rotation, solved[3:], solved[:3], normal))
    return found


def scanned(frames: Frames, curve: Curve, offset_s: float | None) -> tuple[float, np.ndarray, Frames]:
    """Offset in seconds and rotation (3, 3) of the camera under which positions agree best, and frames with no jumps.

    R'(d - p) - t = M x, with any matrix M for the rotation, is linear in M, lever t and place d; the sums of its normal
    equations are correlations, so that Fourier transforms give them for all offsets (Lewis 1995).
    """
    places = frames.positions_m[0]
    near = median_filter(places, size=(9, 1), mode="nearest")
    range_m = np.linalg.norm(places, axis=1)
    some = frames.some(np.linalg.norm(places - near, axis=1) < _JUMP * range_m)
    range_m = np.linalg.norm(some.positions_m[0], axis=1)
    ends = (some.times_s[0], some.times_s[-1], curve.times_s[0], curve.times_s[-1])
    step = max(_STEP_S, (ends[1] - ends[0] + ends[3] - ends[2]) / _MOST_STEPS)
    bins = np.floor((some.times_s - ends[0]) / step).astype(int)
    x, count = some.positions_m[0], bins[-1] + 1
    pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    sums = np.column_stack([np.ones(len(x)), x, *(x[:, a] * x[:, b] for a, b in pairs)]) / range_m[:, None] ** 2
    seen = np.stack([np.bincount(bins, one, count) for one in (*sums.T, np.ones(len(x)))])
    when = np.arange(ends[2], ends[3] + step / 2, step)
    at, middle = curve.at(when + step / 2), curve.at(curve.times_s[::100]).position_m.mean(axis=0)
    p = at.position_m - middle
    to_body = at.rotation.transpose(0, 2, 1)
    q = np.einsum("nij,nj->ni", to_body, p)
    moved = np.column_stack([np.ones(len(p)), to_body.reshape(-1, 9), q, p, (p**2).sum(axis=1)])
    size = next_fast_len(count + len(when))
    one = np.conj(np.fft.rfft(seen, size))
    two = np.fft.rfft((moved * at.is_measured[:, None]).T, size)
    lags = np.arange(-(count - 1), len(when))
    pick = lags % size

    def sum_of(i: int, j: int) -> np.ndarray:
        return np.fft.irfft(one[i] * two[j], size)[pick]

    A, b = np.zeros((len(lags), 15, 15)), np.zeros((len(lags), 15))
    weight = sum_of(0, 0)
    for c in range(3):
        A[:, 9 + c, 9 + c] = A[:, 12 + c, 12 + c] = weight
        b[:, 9 + c], b[:, 12 + c] = -sum_of(0, 10 + c), sum_of(0, 13 + c)
        for e in range(3):
            A[:, 9 + c, 12 + e] = A[:, 12 + e, 9 + c] = -sum_of(0, 1 + 3 * c + e)
            b[:, 3 * c + e] = -sum_of(1 + e, 10 + c)
            A[:, 3 * c + e, 9 + c] = A[:, 9 + c, 3 * c + e] = sum_of(1 + e, 0)
            for f in range(3):
                A[:, 3 * c + e, 12 + f] = A[:, 12 + f, 3 * c + e] = -sum_of(1 + e, 1 + 3 * c + f)
    for index, (e, f) in enumerate(pairs):
        for c in range(3):
            A[:, 3 * c + e, 3 * c + f] = A[:, 3 * c + f, 3 * c + e] = sum_of(4 + index, 0)
    A[:, range(15), range(15)] += (_NOISE / _LIKELY) ** 2
    solved = np.linalg.solve(A, b[:, :, None])[:, :, 0]
    frames_in = sum_of(10, 0)
    cost = (sum_of(0, 16) - (b * solved).sum(axis=1)) / np.maximum(weight, 1e-12)
    offsets = ends[2] - ends[0] + lags * step
    cost[frames_in < max(30, frames_in.max() / 2)] = np.inf
    best = int(np.argmin(cost) if offset_s is None else np.argmin(np.abs(offsets - offset_s)))
    left, _, right = np.linalg.svd(solved[best, :9].reshape(3, 3))
    flip = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    return float(offsets[best]) if offset_s is None else offset_s, left @ flip @ right, some
