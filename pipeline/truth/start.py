"""Where the search for clocks, mount and dock begins: every offset is tried."""

import numpy as np
from dockpose.truth.curve import Curve
from dockpose.truth.model import Frames, Setup
from scipy.fft import next_fast_len
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

_STEP_S = 0.1
_MOST_STEPS = 60_000
_STARTS = 6
_NOISE = 0.02  # of positions, as a share of the range: beside it numbers of 1 and lengths of 10 m are taken as likely
_LIKELY = np.repeat([1.0, 10.0], [9, 6])
_JUMP = 0.1  # of the range, from the median of neighbours: another dock


def starts(frames: Frames, curve: Curve, offset_s: float | None) -> list[Setup]:
    """Setups with the offsets of the clocks under which positions agree best, the likeliest first.

    R'(d - p) - t = M x, with any matrix M for the rotation, is linear in M, lever t and place d; the sums of its normal
    equations are correlations, so that Fourier transforms give them for all offsets (Lewis 1995). M is then brought to
    the nearest rotation (Umeyama 1991).
    """
    places = frames.positions_m[0]
    near = np.linalg.norm(places - median_filter(places, size=(9, 1), mode="nearest"), axis=1)
    some = frames.some(np.flatnonzero(near < _JUMP * np.linalg.norm(places, axis=1)))
    x, count, begin, middle_m = some.positions_m[0], len(some.times_s), some.times_s[0], curve.middle_m
    step = max(_STEP_S, (some.times_s[-1] - begin + np.ptp(curve.times_s)) / _MOST_STEPS)
    bins = np.floor((some.times_s - begin) / step).astype(int)
    each = np.column_stack([np.ones(count), x, (x[:, :, None] * x[:, None]).reshape(-1, 9)])
    each = np.column_stack([each / (x**2).sum(axis=1, keepdims=True), np.ones(count)])
    at = curve.at(np.arange(curve.times_s[0], curve.times_s[-1] + step / 2, step) + step / 2)
    p, to_body = at.position_m - middle_m, at.rotation.transpose(0, 2, 1)
    q = np.einsum("nij,nj->ni", to_body, p)
    moved = np.column_stack([np.ones(len(p)), to_body.reshape(-1, 9), q, p, (p**2).sum(axis=1)])
    size = next_fast_len(bins[-1] + 1 + len(p))
    one = np.conj(np.fft.rfft([np.bincount(bins, column, bins[-1] + 1) for column in each.T], size))
    two = np.fft.rfft((moved * at.is_measured[:, None]).T, size)
    lags = np.arange(-bins[-1], len(p))

    def sums(i: slice, j: slice, *shape: int) -> np.ndarray:
        return np.moveaxis(np.fft.irfft(one[i, None] * two[None, j], size)[..., lags % size], 2, 0).reshape(-1, *shape)

    first, second, squares, clock = slice(0, 1), slice(1, 4), slice(4, 13), slice(13, 14)
    weight, frames_in = sums(first, first, 1, 1), sums(clock, first, 1)[:, 0]
    A, b = np.zeros((len(lags), 15, 15)), np.zeros((len(lags), 15))
    A[:, :9, :9] = np.einsum("ac,lbd->labcd", np.eye(3), sums(squares, first, 3, 3)).reshape(-1, 9, 9)
    A[:, :9, 9:12] = np.einsum("ac,lb->labc", np.eye(3), sums(second, first, 3)).reshape(-1, 9, 3)
    A[:, :9, 12:] = -sums(second, slice(1, 10), 3, 3, 3).transpose(0, 2, 1, 3).reshape(-1, 9, 3)
    A[:, 9:12, 9:12] = A[:, 12:, 12:] = weight * np.eye(3)
    A[:, 9:12, 12:] = -sums(first, slice(1, 10), 3, 3)
    A = np.triu(A) + np.triu(A, 1).transpose(0, 2, 1) + np.diag((_NOISE / _LIKELY) ** 2)
    b[:, :9] = -sums(second, slice(10, 13), 3, 3).transpose(0, 2, 1).reshape(-1, 9)
    b[:, 9:12], b[:, 12:] = -sums(first, slice(10, 13), 3), sums(first, slice(13, 16), 3)
    solved = np.linalg.solve(A, b[:, :, None])[:, :, 0]
    off = (sums(first, slice(16, 17), 1)[:, 0] - (b * solved).sum(axis=1)) / np.maximum(weight[:, 0, 0], 1e-12)
    # As likelihood has it, where frames that the trajectory does not cover may be anywhere.
    cost = np.where(frames_in < min(30, count / 2), np.inf, frames_in * np.log(np.clip(off, 1e-9, 1)))
    if offset_s is not None:
        cost = np.abs(curve.times_s[0] - begin + lags * step - offset_s)
    least = np.flatnonzero((cost <= np.roll(cost, 1)) & (cost <= np.roll(cost, -1)) & np.isfinite(cost))
    found = []
    for best in least[np.argsort(cost[least])][: 1 if offset_s is not None else _STARTS]:
        left, _, right = np.linalg.svd(solved[best, :9].reshape(3, 3))
        mount = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        lag_s = float(curve.times_s[0] - begin + lags[best] * step) if offset_s is None else offset_s
        at = curve.at(some.times_s + lag_s)
        normals = -Rotation.from_euler("YX", some.angles_rad[0][:, ::-1]).as_matrix()[:, :, 2]
        normal = np.einsum("nij,jk,nk->ni", at.rotation, mount, normals)[at.is_measured].sum(axis=0)
        normal = normal / np.linalg.norm(normal) if np.any(normal) else np.array([0.0, 0.0, -1.0])
        dock_m = solved[best, 12:] + middle_m
        levers = np.einsum("nji,nj->ni", at.rotation, dock_m - at.position_m) - x @ mount.T
        lever_m = np.median(levers[at.is_measured], axis=0) if at.is_measured.any() else solved[best, 9:12]
        found.append(Setup(lag_s, 0.0, mount, lever_m, dock_m, normal))
    return found
