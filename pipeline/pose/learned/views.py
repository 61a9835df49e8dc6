"""Views of a dock: lights and their numbers, alike from view to view, and how they depend on pose and places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.choice import refine_with_offsets
from dockpose.pose.circle import CirclePose
from dockpose.pose.placement import Placement, place
from dockpose.pose.refine import Fit, LightRays, angles_on_planes, light_rays, on_planes, refine
from dockpose.pose.uncertainty import cross

FEWEST_LIGHTS = 5  # in a view; fewer leave too little beside its pose
# Of the numbering of many views.
_ROUNDS = 20  # at the most; it ends when no chain turns
_STARTS = 8  # chains that it begins from, the longest
_CLEAR = 0.25  # of a light's spacing: the farthest that the dock may seem to roll from one frame to the next
_LIKE = 0.7  # correlation of the unevenness seen by one half of the views and by the other


@dataclass(frozen=True)
class DockView:
    """A view of the dock, with its lights found."""

    name: str  # of the picture
    points_px: np.ndarray  # (N, 2): centres of the lights
    poses: tuple[CirclePose, ...]  # the candidates
    # whether it was taken so soon after the view before it that the dock has hardly rolled between them
    follows: bool = False


@dataclass(frozen=True)
class Placed:
    """A view with one pose, and its lights numbered."""

    rays: LightRays  # rays of its lights
    rotation: np.ndarray  # (3, 3): from the dock's frame, roll included, to the camera's
    position_m: np.ndarray  # (3,): the dock's centre
    lights: np.ndarray  # (N,): number of each light
    points_px: np.ndarray  # (N, 2): the lights in the picture
    follows: bool  # as in :class:`DockView`

    def turned(self, turns: int, count: int) -> Placed:
        """The same view with its lights numbered from another one on."""
        angle = -turns * 2 * math.pi / count
        return replace(self, rotation=self.rotation @ about_z(angle), lights=(self.lights + turns) % count)

    def residuals_px(self, points_m: np.ndarray) -> np.ndarray:
        """Pixels (2 N,) between lights seen and the dock's lights at points (lights, 3)."""
        seen = points_m[self.lights] @ self.rotation.T + self.position_m
        off = seen[:, :2] / seen[:, 2:] - self.rays.tangents * (1 - self.rays.starts_m / seen[:, 2])[:, None]
        return np.einsum("nij,nj->ni", np.broadcast_to(self.rays.slopes_px, (len(off), 2, 2)), off).ravel()

    def derivatives(self, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Those of the residuals by the pose (2 N, 6) and by each light's own place (N, 2, 3)."""
        seen = points_m[self.lights] @ self.rotation.T + self.position_m
        z = seen[:, 2]
        by_seen = np.zeros((len(seen), 2, 3))
        by_seen[:, 0, 0] = by_seen[:, 1, 1] = 1 / z
        by_seen[:, :, 2] = -seen[:, :2] / z[:, None] ** 2 - self.rays.tangents * (self.rays.starts_m / z**2)[:, None]
        by_point = np.broadcast_to(self.rays.slopes_px, (len(seen), 2, 2)) @ by_seen @ self.rotation
        # A turn w about the dock's axes moves a point p by w x p.
        by_pose = np.concatenate([by_point @ self.rotation.T, -by_point @ cross(points_m[self.lights])], axis=2)
        return by_pose.reshape(-1, 6), by_point


def place_view(view: DockView, camera: Camera, dock: Dock) -> Placed | None:
    """The view with the better of its poses refined, lights numbered from any; None where they do not fit the dock."""
    fitted = _fitted(view, camera, dock)
    if fitted is None:
        return None
    rays, placement, fit = fitted
    squares = np.where(placement.fits, fit.squares_px2, np.inf)
    if dock.offsets_m:
        fit, placement = refine_with_offsets(fit.rotations, fit.positions_m, placement, dock, rays)
        squares = np.where(placement.fits, fit.squares_px2, np.inf)
    best = int(np.argmin(squares))
    rotation = fit.rotations[best] @ about_z(float(placement.rolls_rad[best]))
    return Placed(rays, rotation, fit.positions_m[best], placement.lights[best], view.points_px, view.follows)


def tells_roll(view: DockView, camera: Camera, dock: Dock) -> bool:
    """Whether the offsets of the dock's lights tell its roll over the whole turn in a view."""
    fitted = _fitted(view, camera, dock)
    if fitted is None:
        return False
    rays, placement, fit = fitted
    _, known = refine_with_offsets(fit.rotations, fit.positions_m, placement, dock, rays)
    return known.period_rad > placement.period_rad


def _fitted(view: DockView, camera: Camera, dock: Dock) -> tuple[LightRays, Placement, Fit] | None:
    """Both poses of a view refined to the dock's lights, without their offsets; None where these do not fit."""
    if len(view.points_px) < FEWEST_LIGHTS:
        return None
    rays = light_rays(view.points_px, camera, float(view.poses[0].position_m[2]))
    R, t = np.array([pose.rotation for pose in view.poses]), np.array([pose.position_m for pose in view.poses])
    placement = place(angles_on_planes(rays, R, t), dock)
    return (rays, placement, refine(R, t, placement.angles_rad, dock.radius, rays)) if any(placement.fits) else None


def about_z(angle: float) -> np.ndarray:
    """Rotation (3, 3) by an angle in radians about the third axis."""
    return cv2.Rodrigues(np.array([0.0, 0.0, angle]))[0]


def is_same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two rotations differ by less than a few degrees."""
    return float(np.trace(one.T @ other)) > 3 - 0.01


def aligned(placed: Sequence[Placed], dock: Dock) -> list[list[Placed]]:
    """Ways to number the lights alike in all views, by the roll and by unevenness; none where halves of them differ."""
    count = dock.lights or 0
    followed = _chained(placed, count)
    of_chain = np.cumsum([index == 0 or not each.follows for index, each in enumerate(followed)]) - 1
    if of_chain[-1] == 0:
        return [followed]
    shifts = np.stack([_shifts(each, dock) for each in followed])
    patterns = [shifts[of_chain == chain] for chain in range(of_chain[-1] + 1)]
    if not _halves_agree(patterns, count):
        return []
    return [
        [each.turned(turns[chain], count) for each, chain in zip(followed, of_chain.tolist(), strict=True)]
        for turns, _ in _turns(patterns, count)
    ]


def _chained(placed: Sequence[Placed], count: int) -> list[Placed]:
    """The views, with those that follow another numbered so that the roll changes least."""
    step = 2 * math.pi / count
    done: list[Placed] = []
    for each in placed:
        if done and each.follows:
            between = done[-1].rotation.T @ each.rotation
            rolled = math.atan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1])
            turns = round(rolled / step)
            # A roll about half-way between two numberings leaves open which.
            each = replace(each.turned(turns, count), follows=abs(rolled / step - turns) < _CLEAR)
        done.append(each)
    return done


def _shifts(each: Placed, dock: Dock) -> np.ndarray:
    """Shift (lights, 2) of each light in the dock's plane, outwards and along the ring, in metres; NaN for unseen."""
    (flat,) = on_planes(each.rays, each.rotation[None], each.position_m[None])
    angles = dock.light_angles_rad()[each.lights]
    out = np.column_stack([np.cos(angles), np.sin(angles)])
    off = flat - dock.radius * out
    shifts = np.full((dock.lights or 0, 2), np.nan)
    shifts[each.lights, 0] = (off * out).sum(axis=1)
    shifts[each.lights, 1] = off[:, 1] * out[:, 0] - off[:, 0] * out[:, 1]
    return shifts


def _turns(patterns: Sequence[np.ndarray], count: int) -> list[tuple[list[int], np.ndarray]]:
    """Turns of the chains of views (M, lights, 2) that make them agree, and their mean (lights, 2); the best first.

    What a light's depth does to its picture depends on the view: the best in the plane need not be the right one.
    """
    found: dict[float, tuple[list[int], np.ndarray]] = {}
    longest = sorted(range(len(patterns)), key=lambda index: -np.isfinite(patterns[index]).sum())[:_STARTS]
    for start in longest:
        mean, turns = _middle(patterns[start]), [0] * len(patterns)
        for _ in range(_ROUNDS):
            costs = np.array([[_cost(pattern, mean, turn) for turn in range(count)] for pattern in patterns])
            after = [int(turn) for turn in costs.argmin(axis=1)]
            mean = _middle(np.concatenate([np.roll(p, turn, axis=1) for p, turn in zip(patterns, after, strict=True)]))
            if after == turns:
                break
            turns = after
        total = sum(_cost(pattern, mean, turn) for pattern, turn in zip(patterns, turns, strict=True))
        found[total] = turns, mean
    return [found[total] for total in sorted(found)]


def _middle(pattern: np.ndarray) -> np.ndarray:
    """Mean (lights, 2) over views; 0 for lights that none of them shows."""
    seen = np.isfinite(pattern)
    return np.where(seen, pattern, 0.0).sum(axis=0) / np.maximum(1, seen.sum(axis=0))


def _cost(pattern: np.ndarray, mean: np.ndarray, turn: int) -> float:
    return float(np.nansum((np.roll(pattern, turn, axis=1) - mean) ** 2))


def _halves_agree(patterns: Sequence[np.ndarray], count: int) -> bool:
    """Whether every other chain shows the same unevenness as those between them."""
    if len(patterns) < 4:
        return True
    one, other = (_turns(half, count)[0][1].ravel() for half in (patterns[::2], patterns[1::2]))
    likeness = [float(one @ np.roll(other.reshape(-1, 2), turn, axis=0).ravel()) for turn in range(count)]
    return max(likeness) > _LIKE * float(np.linalg.norm(one) * np.linalg.norm(other))
