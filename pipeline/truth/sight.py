"""What the camera should have seen by a trajectory, and where it is by what it saw."""

from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.pose.known import AGREES_RAD, AGREES_SHARE
from dockpose.pose.uncertainty import cross
from dockpose.truth.model import Frames, Setup
from dockpose.truth.trajectory import DockTrack

_LEAST_M2 = 1e-14  # beside variances, so that those of exact numbers can be inverted


def with_errors(results: DockTrack) -> tuple[DockTrack, list[str]]:
    """The docks with a standard error where none is known, and a sentence that says so."""
    known = np.isfinite(results.positions_m).all(axis=1)
    range_m, lacking = np.linalg.norm(results.positions_m, axis=1), 0
    changed: dict[str, Any] = {}
    for name in ("covariances", "covariances_total"):
        if getattr(results, name) is not None:
            whole = getattr(results, name) + _LEAST_M2 * np.eye(5)
            bad = ~np.isfinite(whole).all(axis=(1, 2))
            bad[~bad] = np.linalg.eigvalsh(whole[~bad])[:, 0] <= 0
            guess = np.where(np.isnan(range_m), 1.0, AGREES_SHARE * range_m)[:, None] * [1, 1, 1, 0, 0]
            guess[:, 3:] = AGREES_RAD
            changed[name] = np.where(bad[:, None, None], guess[:, :, None] ** 2 * np.eye(5), whole)
            lacking = max(lacking, int((bad & known).sum()))
    said = f"{lacking} docks have no standard errors: {100 * AGREES_SHARE:g} % of the range and "
    said += f"{np.degrees(AGREES_RAD):g} degrees are taken, and their intervals say nothing."
    return replace(results, **changed), [said] if lacking else []


def views_of(results: DockTrack, places_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """How much of the ring is in the picture, (N,)."""
    views = np.full(len(places_m), "", dtype="<U6")
    if results.camera is None or results.dock is None:
        return views
    known = np.flatnonzero(np.isfinite(places_m[:, 0]))
    around = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    across = np.cross(normals[known], [0.0, 1.0, 0.0])
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-9)[:, None]
    up = np.cross(normals[known], across)
    ring = results.dock.radius * (np.cos(around)[:, None] * across[:, None] + np.sin(around)[:, None] * up[:, None])
    points = places_m[known, None] + ring
    ahead = points[..., 2] > 0
    px = results.camera.project(np.where(ahead[..., None], points, [0.0, 0.0, 1.0]).reshape(-1, 3)).reshape(-1, 12, 2)
    inside = (
        ahead & (px >= -0.5).all(axis=2) & (px < [results.camera.width - 0.5, results.camera.height - 0.5]).all(axis=2)
    )
    views[known] = np.where(inside.all(axis=1), "whole", np.where(inside.any(axis=1), "partly", "not"))
    return views


def camera_poses(
    setup: Setup, frames: Frames, places_m: np.ndarray, normals: np.ndarray, results: DockTrack
) -> tuple[np.ndarray, np.ndarray]:
    """The camera in the world (N, 4, 4) by the trajectory, and by the docks seen, with the roll that suits best."""
    at = frames.curve.at(frames.times_s + setup.offset_s + setup.drift * (frames.times_s - frames.middle_s))
    true, seen = np.tile(np.eye(4), (2, len(places_m), 1, 1))
    true[:, :3, :3] = at.rotation @ setup.mount
    true[:, :3, 3] = np.where(at.is_measured[:, None], at.position_m + at.rotation @ setup.lever_m, np.nan)
    # The least rotation from one normal to the other.
    both, cosine = np.cross(normals, results.normals), (normals * results.normals).sum(axis=1)
    by = cross(both)
    least = np.eye(3) + by + by @ by / np.maximum(1 + cosine, 1e-9)[:, None, None]
    seen[:, :3, :3] = true[:, :3, :3] @ least.transpose(0, 2, 1)
    seen[:, :3, 3] = setup.dock_m - np.einsum("nij,nj->ni", seen[:, :3, :3], results.positions_m)
    return true, seen
