"""What a threshold method lost of the lights: those that it missed, those that ran together, and what is no light."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.numbers import count
from dockpose.app.state.view import View
from dockpose.lights.growing import distances
from dockpose.pose.known import pose_error
from dockpose.simulate import Scene, truth_of

_LEAST_PX = 2.0  # that a group reaches from its middle, however small it is


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


def best_first(found: Mapping[str, Estimate], view: View) -> list[str]:
    """Return the methods' names: those right first, then those that found a dock, by lights and how near they lie."""

    def rank(name: str) -> tuple[bool, bool, int, float]:
        one = found[name]
        pose, error = one.selected, pose_error(one.selected, view.known_pose)
        is_right = error is not None and error.agrees
        rms_px = None if pose is None else pose.rms_px
        return not is_right, pose is None, -(one.lights_on_ring or 0), np.inf if rms_px is None else rms_px

    return sorted(found, key=rank)


def losses(found: Mapping[str, Estimate], best: Estimate, scene: Scene | None = None) -> dict[str, Losses]:
    """Return what each method lost of a scene's lights, or of those that the best one found, where there are any."""
    if scene is not None:
        truth = truth_of(scene)
        lights_px = truth.lights_px[truth.visible]
    elif best.selected is None or best.markers is None or best.ring is None:
        return {}
    else:
        lights_px = best.markers.points_px[best.ring.on_ring]
    return {name: _lost(one, lights_px) for name, one in found.items()}


def _lost(found: Estimate, lights_px: np.ndarray) -> Losses:
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
