"""Docks as they were seen beside a measured trajectory: clocks, mount and dock found, errors and what they mean."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.pose.known import AGREES_RAD
from dockpose.truth.curve import Curve
from dockpose.truth.fit import Fit, fit, refined
from dockpose.truth.model import DRIFT, LEVER, NORMAL, OFFSET, PLACE, SCALE, TURN, Frames
from dockpose.truth.report import Judged, trajectory_errors, unseen
from dockpose.truth.sight import camera_poses, views_of, with_errors
from dockpose.truth.trajectory import DockTrack, Placement, Trajectory
from scipy.spatial.transform import Rotation

_FEWEST = 30  # frames with a dock, in each half, and rows of the trajectory
_BLOCK_S = 10.0
_OUT = 25.0  # squared length in standard deviations, of five numbers, beyond which a candidate does not fit
_ELSEWHERE = 0.05  # of the range: a position that is farther off is of another dock


@dataclass(frozen=True)
class TrajectoryComparison:
    """What a measured trajectory says of docks that were seen.

    Attributes
    ----------
    offset_s, offset_sigma_s : float or None, seconds
        Added to the results' times it gives the trajectory's, at the first frame. None: cannot be told, or was given.
    drift_ppm, drift_sigma_ppm : float or None, millionths of a second per second
        By how much the offset grows.
    mount, dock_in_world : Placement
        The camera in the tracked body, and the dock, without roll, in the trajectory's frame.
    scale, scale_sigma : float or None
        True lengths over estimated ones, a share: true diameter over that which was searched with.
    notes : tuple of str
        A sentence on each thing that the motion cannot tell, that was left out or assumed.
    errors : (N, 5) float array, metres and radians
        Estimated less true x, y, z, theta_x, theta_y of each frame; NaN where there is no dock or no truth.
    sigmas : (N, 5) float array, metres and radians
        Standard errors that the results claim for these.
    true_positions_m, true_normals : (N, 3) float array, metres
        The dock in the camera by the trajectory; NaN where it has a gap.
    camera_m, true_camera_m : (N, 3) float array, metres
        The camera in the trajectory's frame, by the results and by the trajectory.
    clock_residuals_s : (N,) float array, seconds
        By which time each frame alone is off; NaN where the motion is too slow to say.
    is_fitted : (N,) bool array
        Whether a frame was fitted; the others were reported.
    is_wrong_pose, is_wrong_dock : (N,) bool array
        Whether the other candidate fits and the chosen one does not; whether neither does.
    views : (N,) str array
        "whole", "partly" or "not" as the ring is in the picture by the trajectory; "" where that is not known.
    report : dict
        Statistics of the frames reported, by names that carry their units.
    """

    offset_s: float | None
    offset_sigma_s: float | None
    drift_ppm: float | None
    drift_sigma_ppm: float | None
    mount: Placement
    dock_in_world: Placement
    scale: float | None
    scale_sigma: float | None
    notes: tuple[str, ...]
    errors: np.ndarray
    sigmas: np.ndarray
    true_positions_m: np.ndarray
    true_normals: np.ndarray
    camera_m: np.ndarray
    true_camera_m: np.ndarray
    clock_residuals_s: np.ndarray
    is_fitted: np.ndarray
    is_wrong_pose: np.ndarray
    is_wrong_dock: np.ndarray
    views: np.ndarray
    report: dict[str, Any] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Plain values with their units in the names; None for what is not known."""
        numbers = ("offset_s", "offset_sigma_s", "drift_ppm", "drift_sigma_ppm")
        return {
            **{name: getattr(self, name) for name in numbers},
            "mount": self.mount.to_dict(),
            "dock_in_world": self.dock_in_world.to_dict(),
            "scale": self.scale,
            "scale_sigma": self.scale_sigma,
            "notes": list(self.notes),
            **self.report,
        }


def compare_trajectory(
    results: DockTrack,
    truth: Trajectory,
    *,
    mount: Placement | None = None,
    dock_in_world: Placement | None = None,
    offset_s: float | None = None,
) -> TrajectoryComparison:
    """Compare docks that were seen with a measured trajectory of the camera's carrier.

    Every other ten seconds are fitted, the others reported, so that the fit does not flatter; what is found of clocks,
    mount, dock and scale is then fitted to all.

    Parameters
    ----------
    results : DockTrack
        The docks.
    truth : Trajectory
        What another system has measured.
    mount : Placement, optional
        The camera in the tracked body, which is then held; a part that is None is searched for.
    dock_in_world : Placement, optional
        The dock in the trajectory's frame, likewise.
    offset_s : float, seconds, optional
        The offset of the clocks at the first frame, likewise.

    Returns
    -------
    TrajectoryComparison
        What was found.

    Raises
    ------
    ValueError
        If the trajectory has no attitudes, is too short, or does not match the docks.

    Notes
    -----
    Robot-world and hand-eye calibration (Zhuang, Roth and Sudhakar 1994, IEEE Trans. Robotics and Automation 10), with
    the clocks. The trajectory is smoothed as its own noise asks for (Reinsch 1967). Errors of the trajectory are those
    of Sturm et al. 2012, "A benchmark for the evaluation of RGB-D SLAM systems".
    """
    if truth.quaternions_xyzw is None:
        raise ValueError(f"{truth.name} has no attitudes; without them nothing tells where the dock is in the camera")
    if len(truth.times_s) < _FEWEST:
        raise ValueError(f"{truth.name} has {len(truth.times_s)} poses; {_FEWEST} are needed")
    results, filled = with_errors(results)
    curve = Curve(truth)
    frames = Frames.of(results, curve)
    if offset_s is not None:
        frames = replace(frames, middle_s=float(results.times_s[0]))
    middle_s = frames.middle_s - float(results.times_s[0])
    given = _given(mount, dock_in_world, offset_s)
    block_s = min(_BLOCK_S, float(np.ptp(results.times_s)) / 6)
    is_fitted = (results.times_s - results.times_s[0]) // block_s % 2 == 0
    known = np.isfinite(results.positions_m).all(axis=1)
    if (known & is_fitted).sum() < _FEWEST:
        raise ValueError(f"the results have {known.sum()} frames with a dock; {2 * _FEWEST} are needed")
    best = fit(frames.some(np.flatnonzero(known)), curve, given)
    half = refined(frames.some(np.flatnonzero(known & is_fitted)), best.setup, best.free)
    _check_match(truth, frames, half)
    scaled, plain = frames.against(half.setup), frames.against(replace(half.setup, log_scale=0.0))
    there = scaled.is_measured[:, None]
    places_m, normals = np.where(there, plain.places_m, np.nan), np.where(there, plain.normals, np.nan)
    errors, range_m = -plain.off[0], np.linalg.norm(places_m, axis=1)
    angles_rad = 2 * np.arcsin(np.clip(np.linalg.norm(results.normals - normals, axis=1) / 2, 0, 1))
    fits = scaled.squares < _OUT * half.spread
    is_wrong_pose = ~fits[:, 0] & fits[:, 1] & (angles_rad > AGREES_RAD)
    far = np.linalg.norm(errors[:, :3], axis=1) > _ELSEWHERE * range_m
    is_wrong_dock = ~fits.any(axis=1) & far
    claimed = results.covariances if results.covariances_total is None else results.covariances_total
    sight = -(places_m * normals).sum(axis=1) / range_m
    judged = Judged(
        results.times_s,
        errors,
        claimed,
        plain.noise,
        places_m,
        np.arccos(np.clip(sight, -1, 1)),
        angles_rad,
        ~is_fitted,
        is_wrong_pose,
        is_wrong_dock,
        views_of(results, places_m, normals),
    )
    true, seen = camera_poses(half.setup, frames, places_m, normals, results)
    rows = ~is_fitted & np.isfinite(errors[:, 0])
    report = {**judged.report(curve), "trajectory": trajectory_errors(results.times_s[rows], seen[rows], true[rows])}
    offset, drift = _clocks(best, middle_s, offset_s)
    return TrajectoryComparison(
        *offset,
        *drift,
        *_placements(best, mount, dock_in_world),
        *_scale(best),
        (*truth.notes, *_notes(best, given), *filled, *unseen(report)),
        errors,
        np.sqrt(np.diagonal(claimed, axis1=1, axis2=2)),
        places_m,
        normals,
        seen[:, :3, 3],
        true[:, :3, 3],
        scaled.clock_residuals_s(),
        is_fitted,
        is_wrong_pose,
        is_wrong_dock,
        judged.views,
        report,
    )


def _given(mount: Placement | None, dock: Placement | None, offset_s: float | None) -> dict[str, Any]:
    """Fields of the setup that are given."""
    found: dict[str, Any] = {} if offset_s is None else {"offset_s": float(offset_s)}
    for name, one in (("mount", mount), ("dock_in_world", dock)):
        for part, size in (("position_m", 3), ("quaternion_xyzw", 4)):
            value = None if one is None else getattr(one, part)
            if value is not None and (np.shape(value) != (size,) or not np.isfinite(value).all()):
                raise ValueError(f"{name}.{part} is {value}; it must be {size} finite numbers")
    if mount is not None and mount.quaternion_xyzw is not None:
        found["mount"] = Rotation.from_quat(mount.quaternion_xyzw).as_matrix()
    if mount is not None and mount.position_m is not None:
        found["lever_m"] = np.asarray(mount.position_m, float)
    if dock is not None and dock.position_m is not None:
        found["dock_m"] = np.asarray(dock.position_m, float)
    if dock is not None and dock.quaternion_xyzw is not None:
        found["normal"] = -Rotation.from_quat(dock.quaternion_xyzw).as_matrix()[:, 2]
    return found


def _check_match(truth: Trajectory, frames: Frames, half: Fit) -> None:
    """ValueError unless most docks are where the trajectory has them."""
    compared = frames.against(half.setup)
    off_m = np.linalg.norm(compared.off[0, :, :3], axis=1)
    known = np.isfinite(off_m)
    if known.sum() < 2 * _FEWEST:
        raise ValueError(f"{truth.name} covers {known.sum()} frames with a dock; {2 * _FEWEST} are needed")
    places_m = frames.positions_m[0, known]
    moved_m = float(np.median(np.linalg.norm(places_m - np.median(places_m, axis=0), axis=1)))
    typical_m, range_m = float(np.median(off_m[known])), float(np.median(np.linalg.norm(places_m, axis=1)))
    if typical_m > max(_ELSEWHERE * range_m, moved_m / 2):
        raise ValueError(
            f"{truth.name} does not match the docks: whatever clocks and mount are, half of them are "
            f"{typical_m:.2g} m or more from where it has them"
        )


def _clocks(
    best: Fit, middle_s: float, offset_s: float | None
) -> tuple[tuple[float | None, float | None], tuple[float | None, float | None]]:
    """Offset at the first frame and drift, each with its standard error."""
    setup, told, covariance = best.setup, best.told, best.covariance
    drift = (1e6 * setup.drift, 1e6 * float(np.sqrt(covariance[1, 1]))) if told[1] else (None, None)
    if offset_s is not None:
        return (float(offset_s), None), drift
    if not told[0]:
        return (None, None), drift
    by = np.array([1.0, -middle_s if told[1] else 0.0])
    return (float(by @ [setup.offset_s, setup.drift]), float(np.sqrt(by @ covariance[:2, :2] @ by))), drift


def _placements(best: Fit, mount: Placement | None, dock: Placement | None) -> tuple[Placement, Placement]:
    """Mount and dock with standard errors; what is given stays, what is not told is None."""
    setup, covariance = best.setup, best.covariance
    rotation = rotation_from_angles(*angles_of(setup.normal))
    own = np.diag([1.0, -1.0]) @ (rotation.T @ setup.basis)[[1, 0]]  # turns about x and y of the dock by steps
    variances, tilts = np.diag(covariance), np.diag(own @ covariance[NORMAL, NORMAL] @ own.T)
    mounted, turned = (Rotation.from_matrix(each).as_quat(canonical=True) for each in (setup.mount, rotation))
    parts = [
        (mount, "position_m", LEVER, setup.lever_m, variances[LEVER]),
        (mount, "quaternion_xyzw", TURN, mounted, variances[TURN]),
        (dock, "position_m", PLACE, setup.dock_m, variances[PLACE]),
        (dock, "quaternion_xyzw", NORMAL, turned, [*tilts, np.nan]),
    ]
    found = []
    for given, name, which, value, squares in parts:
        if given is not None and getattr(given, name) is not None:
            found += [getattr(given, name), None]
        elif best.told[which].all():
            sigma = np.sqrt(squares)
            found += [value, sigma if name == "position_m" else np.degrees(sigma)]
        else:
            found += [None, None]
    a, a_sigma, b, b_sigma, c, c_sigma, d, d_sigma = found
    return Placement(a, b, a_sigma, b_sigma), Placement(c, d, c_sigma, d_sigma)


def _scale(best: Fit) -> tuple[float | None, float | None]:
    if not best.told[SCALE]:
        return None, None
    scale = float(np.exp(best.setup.log_scale))
    return scale, scale * float(np.sqrt(best.covariance[SCALE, SCALE]))


def _notes(best: Fit, given: dict[str, Any]) -> list[str]:
    """A sentence on each thing that the motion cannot tell."""
    open_ = [
        ("the offset of the clocks", "offset_s", [OFFSET]),
        ("the drift of the clocks", "drift", [DRIFT]),
        ("how the camera is turned in the body", "mount", range(14)[TURN]),
        ("where the camera sits in the body", "lever_m", range(14)[LEVER]),
        ("where the dock is in the world", "dock_m", range(14)[PLACE]),
        ("how the dock is turned in the world", "normal", range(14)[NORMAL]),
        ("the scale", "scale", [SCALE]),
    ]
    said = []
    for text, name, which in open_:
        axes = [axis for axis, index in zip("xyz", which, strict=False) if not best.told[index]]
        if axes and name not in given:
            about = f" (about or along the axes {', '.join(axes)})" if name in ("mount", "lever_m", "dock_m") else ""
            said.append(f"The motion does not tell {text}{about}; it is left out.")
    if "normal" not in given:
        said.append("A plain ring does not show its roll: the dock's turn about its normal is set to none.")
    return said
