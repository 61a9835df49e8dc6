"""Where a dock's lights really are, from many views of it, by bundle adjustment of all of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.learned.views import FEWEST_LIGHTS, DockView, Placed, aligned, is_same, place_view, tells_roll
from dockpose.pose.refine import light_rays
from scipy.special import chdtrc

FEWEST_VIEWS = 8  # of fewer, the scatter between views says little of the errors
_ROUNDS = 6  # of fitting and numbering anew, at the most
_UNSURE_SHARE = 0.002  # of the diameter: offsets with a larger standard error are not known
_SIGNIFICANT = 1e-3  # chance that even lights look so uneven

_STEPS = 12  # at the most
_SETTLED_M = 1e-6  # a thousandth of a millimetre, below all that is measured
_OUTLIER = 2.5  # residuals beyond this many standard deviations count less
_FOCAL_STEP = 1e-4  # of the derivative, as a share
# Squares of the noise by which another numbering must be better than the one by the dock's roll, which is seldom wrong;
# otherwise noise would choose it.
_CLEARLY = 25.0


class LearningError(ValueError):
    """The views do not tell where the lights are; the text says why."""


@dataclass(frozen=True)
class LearnedDock:
    """A dock whose lights' places were learned."""

    dock: Dock  # the dock, with ``offsets_m``
    sigmas_m: np.ndarray  # (lights, 3): standard errors of the offsets
    camera: Camera  # the camera, with its focal lengths where they were fitted
    sigma_focal: float | None  # standard error of the focal length, as a share of it
    views: int  # number of views that were used
    residual_px: float  # standard deviation of the lights about where the learned dock has them, along x or y
    nominal_px: float  # the same with the lights in their nominal places
    is_uneven: bool  # whether the lights are off their places by more than chance
    roll_share: float  # share of the views in which the unevenness tells the roll over the whole turn


def learn_dock(views: Sequence[DockView], camera: Camera, dock: Dock, *, fit_focal: bool = False) -> LearnedDock:
    """Learn where the lights of a dock really are, about their mean circle (Triggs et al. 2000)."""
    if dock.lights is None or dock.angles_deg or dock.offsets_m:
        raise LearningError("the dock must be given by its diameter and its number of evenly spaced lights")
    # Offsets are those within the ring, wherever it stands.
    ring = msgspec.structs.replace(dock, lamp_depth_m=0.0, extra_lights_m=())
    shown = [(view, each) for view in views if (each := place_view(view, camera, ring)) is not None]
    if len(shown) < FEWEST_VIEWS:
        raise LearningError(
            f"can't tell where the lights are: {len(shown)} of {len(views)} views show {FEWEST_LIGHTS} or more lights "
            f"of the dock clearly, and {FEWEST_VIEWS} are needed, better 60"
        )
    starts = aligned([each for _, each in shown], ring)
    if not starts:
        raise LearningError(
            "can't tell which light is which from one picture to the next, since the lights look evenly spaced within "
            "the noise: give a video, in which the dock is followed, or come nearer"
        )
    fits = [Bundle(start, camera, ring, fit_focal) for start in starts]
    for fit in fits:
        for _ in range(_ROUNDS):
            fit.solve()
            if not fit.renumber([view for view, _ in shown]):
                break
    learned = _result(min(fits, key=lambda fit: fit.noise_px), dock, views)
    whole = msgspec.structs.replace(learned.dock, lamp_depth_m=dock.lamp_depth_m, extra_lights_m=dock.extra_lights_m)
    return replace(learned, dock=whole)


def _result(fit: "Bundle", dock: Dock, views: Sequence[DockView]) -> LearnedDock:
    """The learned dock. Raises LearningError where the views do not tell it."""
    free = fit.basis.shape[1]
    sigmas = np.sqrt(np.einsum("ij,jk,ik->i", fit.basis, fit.covariance[:free, :free], fit.basis))
    sigmas = sigmas.reshape(-1, 3)
    limit = _UNSURE_SHARE * dock.diameter
    if not np.median(sigmas[:, 2]) < limit:
        raise LearningError(
            f"can't tell how far lights stand off the dock's plane (to {1000 * np.median(sigmas[:, 2]):.1f} mm at "
            "best), because the views are too alike: take some with the dock turned by 20 to 40 degrees, to different "
            "sides"
        )
    if not np.median(sigmas) < limit:
        raise LearningError(
            f"can't tell where the lights are (to {1000 * np.median(sigmas):.1f} mm at best), because the "
            "dock is too far away or the views are too few"
        )
    q = fit.basis.T @ fit.offsets_m.ravel()
    statistic = float(q @ np.linalg.solve(fit.covariance[:free, :free], q))
    # Views were numbered so that they agree best: of all numberings chance makes one look so.
    numberings = (sum(not each.follows for each in fit.placed) - 1) * math.log(len(fit.offsets_m))
    camera = with_focal(fit.camera, fit.focal)
    learned = msgspec.structs.replace(fit.learned, lights_sigma_m=math.sqrt(float((sigmas**2).mean())))
    return LearnedDock(
        dock=learned,
        sigmas_m=sigmas,
        camera=camera,
        sigma_focal=math.sqrt(fit.covariance[-1, -1]) if fit.fit_focal else None,
        views=len(fit.placed),
        residual_px=fit.noise_px,
        nominal_px=fit.nominal_px,
        is_uneven=bool(chdtrc(free, statistic) < _SIGNIFICANT * math.exp(-min(numberings, 690.0))),
        roll_share=sum(tells_roll(view, camera, learned) for view in views) / len(views),
    )


def free_offsets(dock: Dock) -> np.ndarray:
    """Basis (3 lights, 3 lights - 7) of the offsets that leave the mean circle as it is."""
    angles = dock.light_angles_rad()
    zero, x, y = np.zeros_like(angles), np.cos(angles), np.sin(angles)
    held = [
        *([x, y, zero], [-y, x, zero]),  # larger, turned
        *np.broadcast_to(np.eye(3)[..., None], (3, 3, len(angles))),  # moved
        *([zero, zero, x], [zero, zero, y]),  # tilted
    ]
    columns = np.array([np.column_stack(each).ravel() for each in held]).T
    return np.linalg.svd(columns, full_matrices=True)[0][:, 7:]


class Bundle:
    """Poses of all views, offsets of all lights and the focal length, adjusted together."""

    def __init__(self, placed: list[Placed], camera: Camera, dock: Dock, fit_focal: bool) -> None:
        self.placed, self.camera, self._dock, self.fit_focal = placed, camera, dock, fit_focal
        self.basis = free_offsets(dock)
        self.offsets_m, self.focal = np.zeros((dock.lights or 0, 3)), 1.0
        self.noise_px = self.nominal_px = _scatter(self._residuals(), 6 * len(placed))
        self.covariance = np.zeros((0, 0))

    @property
    def learned(self) -> Dock:
        """The dock with the offsets found so far."""
        return msgspec.structs.replace(self._dock, offsets_m=tuple(map(tuple, self.offsets_m.tolist())))

    def _residuals(self) -> list[np.ndarray]:
        points = self._dock.light_points() + self.offsets_m
        return [each.residuals_px(points) for each in self.placed]

    def solve(self) -> None:
        """Gauss-Newton steps with weights that fall for outliers, until the lights have settled."""
        for _ in range(_STEPS):
            if self._step() < _SETTLED_M:
                break

    def _step(self) -> float:
        points, count = self._dock.light_points() + self.offsets_m, len(self.offsets_m)
        size = self.basis.shape[1] + self.fit_focal
        left, right, kept, gradients = np.zeros((size, size)), np.zeros(size), [], []
        longer = with_focal(self.camera, self.focal * (1 + _FOCAL_STEP))
        for each in self.placed:
            r, (P, L) = each.residuals_px(points), each.derivatives(points)
            J = np.zeros((len(r), size))
            own = np.zeros((len(r), 3 * count))
            for row, light in enumerate(each.lights.tolist()):
                own[2 * row : 2 * row + 2, 3 * light : 3 * light + 3] = L[row]
            J[:, : self.basis.shape[1]] = own @ self.basis
            if self.fit_focal:
                rays = light_rays(each.points_px, longer, float(each.position_m[2]))
                after = replace(each, rays=rays._replace(slopes_px=each.rays.slopes_px)).residuals_px(points)
                J[:, -1] = (after - r) / _FOCAL_STEP
            lengths = np.repeat(np.hypot(r[::2], r[1::2]), 2) / (_OUTLIER * max(self.noise_px, 1e-9))
            root = np.sqrt(1 / np.maximum(1.0, lengths))
            r, P, J = r * root, P * root[:, None], J * root[:, None]
            solved = np.linalg.lstsq(P, np.column_stack([J, r]), rcond=None)[0]
            J_rest, r_rest = J - P @ solved[:, :-1], r - P @ solved[:, -1]
            left += J_rest.T @ J_rest
            right += J_rest.T @ r_rest
            gradients.append(J_rest.T @ r_rest)
            kept.append(solved)
        values, vectors = np.linalg.eigh(left)
        inverse = (vectors / np.maximum(values, 1e-9 * values[-1])) @ vectors.T
        step = -inverse @ right
        if self.fit_focal:
            self.focal *= 1 + max(-0.1, min(0.1, float(step[-1])))
        camera = with_focal(self.camera, self.focal)
        for index, (each, solved) in enumerate(zip(self.placed, kept, strict=True)):
            move = -(solved[:, -1] + solved[:, :-1] @ step)
            position, turn = each.position_m + move[:3], cv2.Rodrigues(move[3:])[0]
            rays = light_rays(each.points_px, camera, float(position[2])) if self.fit_focal else each.rays
            self.placed[index] = replace(each, rays=rays, position_m=position, rotation=each.rotation @ turn)
        change = (self.basis @ step[: self.basis.shape[1]]).reshape(-1, 3)
        self.offsets_m = self.offsets_m + change
        residuals = self._residuals()
        self.noise_px = _scatter(residuals, 6 * len(self.placed) + size)
        U = np.array(gradients)
        scatter = inverse @ (U.T @ U) @ inverse
        own = self.noise_px**2 * inverse
        # The pictures' errors may be alike within each, see dockpose.camera.bundle.sigmas.
        larger = np.sqrt(np.maximum(1.0, np.diag(scatter) / np.diag(own)))
        self.covariance = own * np.outer(larger, larger)
        return float(np.abs(change).max())

    def renumber(self, views: Sequence[DockView]) -> bool:
        """Choose each view's pose and numbering anew, by the offsets found; whether any changed."""
        camera, dock, changed = with_focal(self.camera, self.focal), self.learned, False
        for index, (view, before) in enumerate(zip(views, self.placed, strict=True)):
            after = place_view(view, camera, dock)
            if after is None or (
                np.array_equal(after.lights, before.lights) and is_same(after.rotation, before.rotation)
            ):
                continue
            points = dock.light_points()
            old, new = before.residuals_px(points), after.residuals_px(points)
            followed = before.follows or any(each.follows for each in self.placed[index + 1 : index + 2])
            margin = _CLEARLY * self.noise_px**2 if followed else 0.0
            if (new**2).sum() < (old**2).sum() - margin:
                self.placed[index], changed = after, True
        return changed


def with_focal(camera: Camera, share: float) -> Camera:
    """The camera with its focal lengths multiplied by a share."""
    return camera if share == 1.0 else msgspec.structs.replace(camera, fx=camera.fx * share, fy=camera.fy * share)


def _scatter(residuals: list[np.ndarray], parameters: int) -> float:
    """Standard deviation of residuals, robustly: from their median length, which outliers hardly change."""
    joined = np.concatenate(residuals)
    freedom = max(0.1, 1 - parameters / len(joined))
    lengths2 = joined[::2] ** 2 + joined[1::2] ** 2
    return float(math.sqrt(np.median(lengths2) / (2 * math.log(2)) / freedom))
