"""What a threshold method lost of the lights: those that it missed, those that ran together, and what is no light."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.numbers import count
from dockpose.app.state.view import View
from dockpose.lights.growing import distances
from dockpose.paper.rivals import RIVALS
from dockpose.pose.known import pose_error
from dockpose.simulate import Scene, truth_of

_PAPER = "hats", "hats_local", *RIVALS
_LEAST_PX = 2.0  # that a group reaches from its middle, however small it is
# Standard errors within which ranges are one, and tilts are those of the same of the two poses.
_ALIKE, _TILT_ALIKE = 0.5, 3.0


@dataclass(frozen=True)
class Losses:
    """Of so many lights that are known: how many have no group, how many share one, and groups beside them all."""

    lights: int
    missed: int
    joined: int
    strays: int

    def in_words(self) -> str:
        """Return them as a line."""
        lost = [f"{self.missed} missed"] if self.missed else []
        lost += [f"{self.joined} run together"] if self.joined else []
        return f"{count(self.lights, 'light')}: {', '.join(lost) or 'all apart'}; {count(self.strays, 'stray')}"


def ranks(found: Mapping[str, Estimate], view: View) -> dict[str, int]:
    """Return ranks from 1: methods that are right first, then those that found a dock, by lights and how near they lie.

    Results that the picture cannot tell apart share a rank, in the paper's order.
    """

    def order(name: str) -> tuple[bool, bool, int, float]:
        one = found[name]
        rms_px = None if one.selected is None else one.selected.rms_px
        lights = -(one.lights_on_ring or 0)
        return not _is_right(one, view), one.selected is None, lights, np.inf if rms_px is None else rms_px

    leaders: list[str] = []
    rank = dict.fromkeys(found, 0)
    for name in sorted(found, key=order):
        alike = (number for number, best in enumerate(leaders) if _is_alike(found[name], found[best], view))
        rank[name] = next(alike, len(leaders)) + 1
        if rank[name] > len(leaders):
            leaders.append(name)
    in_order = sorted(dict.fromkeys([*_PAPER, *found]).keys(), key=lambda name: rank.get(name, 0))
    return {name: rank[name] for name in in_order if name in rank}


def _is_right(found: Estimate, view: View) -> bool:
    error = pose_error(found.selected, view.known_pose)
    return error is not None and error.agrees


def _is_alike(one: Estimate, best: Estimate, view: View) -> bool:
    """Whether results are as right, ranges within half of the best one's standard error, tilts of the same pose."""
    first, second = best.selected, one.selected
    if first is None or second is None:
        return first is second
    sigmas_m, sigmas_rad = first.sigma_total_position_m, first.sigma_total_theta_rad
    if sigmas_m is None or sigmas_rad is None or _is_right(one, view) != _is_right(best, view):
        return False
    ranges_m = [np.linalg.norm(pose.position_m) for pose in (first, second)]
    turns_rad = [(pose.theta_x_rad, pose.theta_y_rad) for pose in (first, second)]
    is_as_far = abs(ranges_m[1] - ranges_m[0]) <= _ALIKE * sigmas_m[2]
    return bool(
        is_as_far and (np.abs(np.subtract(turns_rad[0], turns_rad[1])) <= _TILT_ALIKE * np.array(sigmas_rad)).all()
    )


def losses(
    found: Mapping[str, Estimate], best: Estimate, scene: Scene | None = None, set_px: np.ndarray | None = None
) -> dict[str, Losses]:
    """Return what each method lost of lights set by hand (N, 2), a scene's, or those that the best one found."""
    if set_px is not None:
        lights_px = set_px
    elif scene is not None:
        truth = truth_of(scene)
        lights_px = truth.lights_px[truth.visible]
    elif best.selected is None or best.markers is None or best.ring is None:
        return {}
    else:
        lights_px = best.markers.points_px[best.ring.on_ring]
    return {name: lost_of(one, lights_px) for name, one in found.items()}


def lost_of(found: Estimate, lights_px: np.ndarray) -> Losses:
    """What is lost of lights (N, 2): each belongs to the nearest group that reaches as far as its middle."""
    lights = len(lights_px)
    if found.markers is None or not len(found.markers):
        return Losses(lights, lights, 0, 0)
    reach_px = np.maximum(np.sqrt(found.markers.areas_px / np.pi), _LEAST_PX)
    off = distances(lights_px, found.markers.points_px) / reach_px
    group = np.where(off.min(axis=1) <= 1, off.argmin(axis=1), -1)
    shared = np.bincount(group[group >= 0], minlength=len(found.markers))
    return Losses(
        lights=lights,
        missed=int((group < 0).sum()),
        joined=int(shared[shared > 1].sum()),
        strays=int((shared == 0).sum()),
    )
