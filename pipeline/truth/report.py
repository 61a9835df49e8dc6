"""Statistics of docks beside the truth: errors, intervals, wrong poses, frames without a dock."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from dockpose.study.statistics import wilson
from dockpose.truth.curve import Curve
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, norm

FIVE = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg")
TILTS_DEG = (0, 15, 30, 45, 60, 90)
_UNITS = np.array([1, 1, 1, np.degrees(1), np.degrees(1)])
_SHARES = (0.5, 0.8, 0.95)
_WORST, _APART_S = 10, 1.0
_NEAR = 1.35  # half the width over which neighbours are taken, in that of the smoothing
_FAR = 8.0  # typical errors, beyond which a frame is none of its neighbours
_SEEN = 2.0  # standard errors from which slow errors stand out from what the truth is off


@dataclass(frozen=True)
class Judged:
    """Frames beside the truth, N of them; NaN where there is no dock or no truth."""

    times_s: np.ndarray
    errors: np.ndarray  # (N, 5): metres and radians
    covariances: np.ndarray  # (N, 5, 5): as claimed
    noise: np.ndarray  # (N, 5, 5): of the truth
    places_m: np.ndarray  # (N, 3): of the dock in the camera, by the truth
    tilts_rad: np.ndarray  # (N,)
    angles_rad: np.ndarray  # (N,): between the normals
    is_reported: np.ndarray
    is_wrong_pose: np.ndarray
    is_wrong_dock: np.ndarray
    views: np.ndarray

    def squares(self, width_s: float) -> np.ndarray:
        """Squared errors (N, 5), less what the truth is off, such that their means are those against a perfect truth.

        What a smoothed truth is off changes slowly. Where slow errors do not stand out from it, errors against
        parabolas through a frame's neighbours count instead (Savitzky and Golay 1964), as if all frequencies had alike.
        """
        noise, squares = np.diagonal(self.noise, axis1=1, axis2=2), self.errors**2
        right = np.isfinite(squares[:, 0]) & ~self.is_wrong_pose & ~self.is_wrong_dock & self.is_reported
        typical = np.median(np.abs(self.errors[right]), axis=0) if right.any() else np.inf
        right &= (np.abs(np.nan_to_num(self.errors)) <= _FAR * typical).all(axis=1)
        step_s = float(np.median(np.diff(self.times_s)))
        half = int(np.clip(round(_NEAR * width_s / step_s), 3, 25))
        around = np.arange(len(right))[:, None] + np.arange(-half, half + 1)
        inside = np.clip(around, 0, len(right) - 1)
        since = (self.times_s[inside] - self.times_s[:, None]) / (half * step_s)
        weights = right[inside] & (inside == around) & (np.abs(since) < 1.5)
        powers = since[..., None] ** [0, 1, 2] * weights[..., None]
        inverse = np.linalg.inv(powers.transpose(0, 2, 1) @ powers + 1e-6 * np.eye(3))
        smooth = (inverse[:, :1] @ powers.transpose(0, 2, 1) @ np.nan_to_num(self.errors)[inside])[:, 0]
        rows = right & (weights.sum(axis=1) > half) & (inverse[:, 0, 0] < 0.5)
        if not rows.any():
            return squares - noise
        fast = (self.errors - smooth) ** 2 / (1 - inverse[:, :1, 0])
        off, fast_mean = noise[rows].mean(axis=0), fast[rows].mean(axis=0)
        slower = squares[rows].mean(axis=0) - off - fast_mean
        most = off * (1 + _SEEN * np.sqrt(8 * width_s / (step_s * rows.sum())))
        hidden = (off > 0.1 * fast_mean) & (slower < most)
        return np.where(
            hidden & right[:, None],
            np.where(rows[:, None], fast, squares * fast_mean / squares[rows].mean(axis=0)),
            squares - noise,
        )

    def report(self, curve: Curve) -> dict[str, Any]:
        """All statistics of the frames that are reported."""
        squares, range_m = self.squares(curve.width_s), np.linalg.norm(self.places_m, axis=1)
        has_truth = self.is_reported & np.isfinite(range_m)
        seen = has_truth & np.isfinite(self.errors[:, 0])
        step_m = _even(float(np.ptp(range_m[has_truth])) / 5) if has_truth.any() else 1.0
        first = np.floor(np.nanmin(range_m, initial=np.inf, where=has_truth) / step_m) if has_truth.any() else 0
        ranges = [(step_m * (first + i), step_m * (first + i + 1)) for i in range(8)]
        bands = {
            "range": [(one, (range_m >= one[0]) & (range_m < one[1]), "_m") for one in ranges],
            "tilt": [
                (one, (np.degrees(self.tilts_rad) >= one[0]) & (np.degrees(self.tilts_rad) < one[1]), "_deg")
                for one in pairwise(TILTS_DEG)
            ],
        }
        return {
            **self._errors(seen, squares),
            "right": self._errors(seen & ~self.is_wrong_pose & ~self.is_wrong_dock, squares),
            **{
                f"by_{name}": [
                    {f"from{unit}": low, f"to{unit}": high, **self._errors(seen & which, squares)}
                    for (low, high), which, unit in each
                    if (has_truth & which).any()
                ]
                for name, each in bands.items()
            },
            "frames": {
                "all": len(self.times_s),
                "fitted": int((~self.is_reported).sum()),
                "reported": int(self.is_reported.sum()),
                "with_truth": int(has_truth.sum()),
                "wrong_dock": int((seen & self.is_wrong_dock).sum()),
                "without_dock": _counted(has_truth & ~seen, has_truth),
                "without_dock_by_view": {
                    view: _counted(has_truth & ~seen & (self.views == view), has_truth & (self.views == view))
                    for view in ("whole", "partly", "not")
                },
            },
            "wrong_pose": {
                **_counted(seen & self.is_wrong_pose, seen),
                "longest_s": self._longest_s(seen),
            },
            "truth_noise": _named(np.sqrt(np.diagonal(self.noise, axis1=1, axis2=2)[seen].mean(axis=0))),
            "worst_frames": self._worst(seen),
        }

    def _errors(self, which: np.ndarray, squares: np.ndarray) -> dict[str, Any]:
        """Errors of some frames, how often the intervals hold, and how often there is a dock and the right pose."""
        if not which.any():
            return {"count": 0, "rms": None, "median": None, "most_95": None, "within": None, "nees": None}
        mean = np.maximum(np.nanmean(squares[which], axis=0), 0)
        off = np.abs(self.errors[which]) * np.sqrt(mean / (self.errors[which] ** 2).mean(axis=0))
        claimed = self.covariances[which] + self.noise[which]
        sigmas = np.sqrt(np.diagonal(claimed, axis1=1, axis2=2))
        errors = self.errors[which]
        nees = (errors * np.linalg.solve(claimed, errors[:, :, None])[:, :, 0]).sum(axis=1) / 5
        return {
            "count": int(which.sum()),
            "rms": _above_noise(np.sqrt(mean)),
            "median": _above_noise(np.median(off, axis=0)),
            "most_95": _above_noise(np.quantile(off, 0.95, axis=0)),
            "within": {
                str(share): _named((np.abs(errors) < norm.ppf((1 + share) / 2) * sigmas).mean(axis=0), is_share=True)
                for share in _SHARES
            },
            "nees": {"median": float(np.median(nees)) / (chi2.ppf(0.5, 5) / 5), "mean": float(nees.mean())},
            "wrong_pose": _counted(which & self.is_wrong_pose, which),
        }

    def _longest_s(self, seen: np.ndarray) -> float:
        """For how long the wrong pose was chosen without a break."""
        wrong = self.is_wrong_pose[seen].astype(int)
        ends = np.flatnonzero(np.diff(np.concatenate([[0], wrong, [0]])))
        times, step_s = self.times_s[seen], float(np.median(np.diff(self.times_s)))
        return max((float(times[b - 1] - times[a]) + step_s for a, b in ends.reshape(-1, 2)), default=0.0)

    def _worst(self, seen: np.ndarray) -> list[dict[str, float]]:
        distances_m = np.linalg.norm(self.errors[:, :3], axis=1)
        share = np.where(seen, distances_m / np.linalg.norm(self.places_m, axis=1) + self.angles_rad, -np.inf)
        return [
            {
                "row": row,
                "time_s": float(self.times_s[row]),
                "distance_m": float(distances_m[row]),
                "angle_deg": float(np.degrees(self.angles_rad[row])),
            }
            for row in np.argsort(-share)[: min(_WORST, int(seen.sum()))].tolist()
        ]


def trajectory_errors(times_s: np.ndarray, seen: np.ndarray, true: np.ndarray) -> dict[str, float | None]:
    """Absolute and relative errors of camera poses (N, 4, 4) in the world against true ones (Sturm et al. 2012)."""
    off = np.linalg.inv(true) @ seen
    later = np.searchsorted(times_s, times_s + _APART_S - 1e-6)
    pairs = (later < len(times_s)) & (times_s[np.minimum(later, len(times_s) - 1)] - times_s < 1.1 * _APART_S)
    i, j = np.flatnonzero(pairs), later[pairs]
    relative = np.linalg.inv(np.linalg.inv(true[i]) @ true[j]) @ np.linalg.inv(seen[i]) @ seen[j]
    return {
        "absolute_m": _rms(np.linalg.norm(off[:, :3, 3], axis=1)),
        "relative_apart_s": _APART_S,
        "relative_m": _rms(np.linalg.norm(relative[:, :3, 3], axis=1)),
        "relative_deg": _rms(np.degrees(Rotation.from_matrix(relative[:, :3, :3]).magnitude()))
        if pairs.any()
        else None,
    }


def unseen(report: dict[str, Any]) -> list[str]:
    """A sentence where the trajectory is worse than what it shall judge."""
    noise, rms = report["truth_noise"], report["right"]["rms"]
    worse = [name for name in noise if rms is not None and noise[name] > (rms[name] or 0.0)]
    if not worse:
        return []
    text = ", ".join(f"{name.rpartition('_')[0]} by {noise[name]:.2g} {name.rpartition('_')[2]}" for name in worse)
    return [
        f"The trajectory itself is off in {text}, more than the docks: how small their errors are, it hardly tells."
    ]


def _rms(values: np.ndarray) -> float | None:
    return float(np.sqrt((values**2).mean())) if len(values) > 0 else None


def _named(values: np.ndarray, is_share: bool = False) -> dict[str, float]:
    names = ("x", "y", "z", "theta_x", "theta_y") if is_share else FIVE
    return dict(zip(names, (values * (1 if is_share else _UNITS)).tolist(), strict=True))


def _above_noise(values: np.ndarray) -> dict[str, float | None]:
    """Values by their names; None where what the trajectory is off itself leaves nothing."""
    return {name: value or None for name, value in _named(values).items()}


def _counted(hits: np.ndarray, among: np.ndarray) -> dict[str, Any]:
    share = wilson(int(hits.sum()), int(among.sum()))
    known = share.count > 0
    return {
        "count": share.hits,
        "of": share.count,
        "share": share.value if known else None,
        "low": share.low if known else None,
        "high": share.high if known else None,
    }


def _even(length: float) -> float:
    """The next of 1, 2, 5, 10 and so on."""
    ten = 10.0 ** np.floor(np.log10(max(length, 1e-3)))
    return float(ten * next(one for one in (1, 2, 5, 10) if one * ten >= length * 0.999))
