"""Where a dock's lights really are, from many views of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.learned.aligning import aligned
from dockpose.pose.learned.bundle import Bundle, with_focal
from dockpose.pose.learned.views import FEWEST_LIGHTS, DockView, place_view, tells_roll
from scipy.special import chdtrc

FEWEST_VIEWS = 8  # of fewer, the scatter between views says little of the errors
_ROUNDS = 6  # of fitting and numbering anew, at the most
_UNSURE_SHARE = 0.002  # of the diameter: offsets with a larger standard error are not known
_SIGNIFICANT = 1e-3  # chance that even lights look so uneven


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
    ring = msgspec.structs.replace(dock, lamp_depth_m=0.0)  # offsets are those within it, wherever it stands
    placed = [each for each in (place_view(view, camera, ring) for view in views) if each is not None]
    if len(placed) < FEWEST_VIEWS:
        raise LearningError(
            f"can't tell where the lights are: {len(placed)} of {len(views)} views show {FEWEST_LIGHTS} or more lights "
            f"of the dock clearly, and {FEWEST_VIEWS} are needed, better 60"
        )
    start = aligned(placed, ring)
    if start is None:
        raise LearningError(
            "can't tell which light is which from one picture to the next, since the lights look evenly spaced within "
            "the noise: give a video, in which the dock is followed, or come nearer"
        )
    fit = Bundle(start, camera, ring, fit_focal)
    for _ in range(_ROUNDS):
        fit.solve()
        if not fit.renumber(views):
            break
    learned = _result(fit, dock)
    known = [tells_roll(view, learned.camera, learned.dock) for view in views]
    whole = msgspec.structs.replace(learned.dock, lamp_depth_m=dock.lamp_depth_m)
    return replace(learned, dock=whole, roll_share=sum(known) / len(known))


def _result(fit: Bundle, dock: Dock) -> LearnedDock:
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
    if not np.median(sigmas[:, :2]) < limit:
        raise LearningError(
            f"can't tell where the lights are (to {1000 * np.median(sigmas[:, :2]):.1f} mm at best), because the "
            "dock is too far away or the views are too few"
        )
    q = fit.basis.T @ fit.offsets_m.ravel()
    statistic = float(q @ np.linalg.solve(fit.covariance[:free, :free], q))
    return LearnedDock(
        dock=msgspec.structs.replace(fit.learned, lights_sigma_m=math.sqrt(float((sigmas**2).mean()))),
        sigmas_m=sigmas,
        camera=with_focal(fit.camera, fit.focal),
        sigma_focal=math.sqrt(fit.covariance[-1, -1]) if fit.fit_focal else None,
        views=len(fit.placed),
        residual_px=fit.noise_px,
        nominal_px=fit.nominal_px,
        is_uneven=bool(chdtrc(free, statistic) < _SIGNIFICANT),
        roll_share=0.0,
    )
