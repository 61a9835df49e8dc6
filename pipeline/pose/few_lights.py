"""The dock's pose from three or four lights, too few for an ellipse, where their spacing is known."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.choice import Choice, choice_of
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import Fit, light_rays, refine
from dockpose.pose.spacing import Placement
from dockpose.pose.uncertainty import log_odds

FEWEST = 3
MOST_HYPOTHESES = 3000
_COLLINEAR = 1e-3  # smaller to larger spread of the points
_DIFFERENT_RAD = math.radians(1.0)
_DIFFERENT_SHARE = 0.01  # of the range


def poses_from_few_lights(points_px: Any, camera: Camera, dock: Dock, near: CirclePose | None = None) -> Choice:
    """Find the pose of a dock from three or four of its lights.

    Parameters
    ----------
    points_px : (N, 2) centres of the lights in the picture, N of 3 or 4 (more are allowed, but an ellipse is faster).
    camera : that took it.
    dock : its diameter, and its lights: how many they are, or their angles.
    near : a pose that the dock cannot be far from, as of the picture before; of poses that explain the lights equally
        well the nearest to it comes first.

    Returns
    -------
    Up to two different poses that explain the lights best, the likelier first. Their probabilities are of all that were
    tried, so that they may fall short of 1; three lights fit exactly whichever lights they are, so that without
    ``near`` the choice among them is open unless the dock has no more than three, and often even then.

    Raises
    ------
    NoEllipseError
        if the points are fewer than three, not all different, not finite or on a line, the spacing is not known, or no
        pose explains them.

    Notes
    -----
    Seen from the front lights follow each other around the picture as around the dock, so that the first point is one
    of the lights and the others are later ones in order. Each such assignment gives starting poses by IPPE (Collins and
    Bartoli 2014) for four points, by AP3P (Ke and Roumeliotis 2017) for three; all are refined together.
    """
    points = as_points("points_px", points_px, 2)
    _check(points, dock)
    middle = points.mean(axis=0)
    order = np.argsort(np.arctan2(*(points - middle).T[::-1]), kind="stable")
    assignments = _assignments(len(points), dock)
    rays = light_rays(points[order], camera)
    known = dock.light_angles_rad()
    starts = [(row, R, t) for row in assignments for R, t in _starting_poses(rays.tangents, known[row], dock.radius)]
    if not starts:
        raise NoEllipseError("no pose of the dock explains the lights")
    rows = np.array([row for row, _, _ in starts])
    rotations, positions = np.array([R for _, R, _ in starts]), np.array([t for _, _, t in starts])
    if camera.port is not None:
        rays = light_rays(points[order], camera, float(np.median(positions[:, 2])))
    fit = refine(rotations, positions, known[rows], dock.radius, rays)
    kept = _different(fit, near)
    if not kept:
        raise NoEllipseError("no pose of the dock explains the lights")
    probabilities = _probabilities(fit, kept)
    best = kept[:2]
    lights = np.empty((len(best), len(points)), dtype=int)
    lights[:, order] = rows[best]
    period = 2 * math.pi if dock.angles_deg else 2 * math.pi / len(known)
    placement = Placement(lights, np.zeros(len(best)), known[lights], [True] * len(best), period)
    chosen = Fit(
        *(getattr(fit, name)[best] for name in ("rotations", "positions_m", "squares_px2", "covariances")),
        numbers=fit.numbers,
        points=fit.points,
    )
    return choice_of(chosen, probabilities[: len(best)], placement, "spacing", camera)


def _check(points: np.ndarray, dock: Dock) -> None:
    if not np.isfinite(points).all():
        raise NoEllipseError("a point is not finite")
    if dock.lights is None:
        raise NoEllipseError("the number of lights is not known, without which an ellipse needs 5 of them")
    different = len(set(map(tuple, points.tolist())))
    if different < max(FEWEST, len(points)):
        raise NoEllipseError(f"a pose needs {FEWEST} different lights, there are {different} in {len(points)}")
    if len(points) > dock.lights:
        raise NoEllipseError(f"there are {len(points)} lights, but the dock has {dock.lights}")
    small, large = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[::-1]
    if small < _COLLINEAR * large:
        raise NoEllipseError("the points lie on a line")


def _assignments(count: int, dock: Dock) -> list[list[int]]:
    """Lights that the points can be, in their order around the picture; evenly spaced, the first is light 0."""
    total = dock.lights or 0
    firsts = range(total) if dock.angles_deg else range(1)
    around = np.argsort(np.mod(dock.light_angles_rad(), 2 * math.pi))
    if len(firsts) * math.comb(total - 1, count - 1) > MOST_HYPOTHESES:
        raise NoEllipseError(f"{count} of {total} lights can be too many different ones")
    return [
        around[[(first + step) % total for step in (0, *rest)]].tolist()
        for first, rest in product(firsts, combinations(range(1, total), count - 1))
    ]


def _starting_poses(
    tangents: np.ndarray, angles_rad: np.ndarray, radius_m: float
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rotations and positions of docks in front of the camera, facing it, whose lights are seen at the tangents."""
    model = radius_m * np.column_stack([np.cos(angles_rad), np.sin(angles_rad), np.zeros(len(angles_rad))])
    if len(model) == FEWEST:
        _, turns, shifts = cv2.solveP3P(model, tangents, np.eye(3), None, cv2.SOLVEPNP_AP3P)
    else:
        _, turns, shifts, _ = cv2.solvePnPGeneric(model, tangents, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    poses = []
    for turn, shift in zip(turns, shifts, strict=True):
        R, t = cv2.Rodrigues(turn)[0], shift.ravel()
        if np.isfinite(t).all() and np.isfinite(R).all() and t[2] > radius_m and R[:, 2] @ t > 0:
            poses.append((R, t))
    return poses


def _different(fit: Fit, near: CirclePose | None) -> list[int]:
    """Refined poses in front of the camera that face it, best first, each differing from those before."""
    excess = fit.squares_px2 / max(float(fit.squares_px2.min()), 1e-3)
    if near is None:
        merit = excess
    else:
        away = 1 + fit.rotations[:, :, 2] @ near.normal
        away += np.linalg.norm(fit.positions_m - near.position_m, axis=1) / near.position_m[2]
        merit = np.where(excess < 10, away, 10 + excess)
    kept: list[int] = []
    for k in np.argsort(merit, kind="stable").tolist():
        position, normal = fit.positions_m[k], fit.rotations[k, :, 2]
        if not np.isfinite(position).all() or position[2] <= 0 or normal @ position <= 0:
            continue
        same = any(
            np.linalg.norm(fit.rotations[other, :, 2] - normal) < _DIFFERENT_RAD
            and np.linalg.norm(fit.positions_m[other] - position) < _DIFFERENT_SHARE * position[2]
            for other in kept
        )
        if not same:
            kept.append(k)
    return kept


def _probabilities(fit: Fit, kept: list[int]) -> list[float]:
    """Of each pose that was kept, by how well it explains the lights."""
    best = min(kept, key=lambda k: float(fit.squares_px2[k]))
    weights = [math.exp(log_odds(float(fit.squares_px2[k]), float(fit.squares_px2[best]), fit.numbers)) for k in kept]
    return [weight / sum(weights) for weight in weights]
