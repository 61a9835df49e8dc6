"""EPnP and its peers on the lights of a colour-coded dock, to set beside the poses found by the ellipse."""

from __future__ import annotations

from dockpose import Estimate
from dockpose.pose.circle import CirclePose
from dockpose.pose.pnp import METHODS, NoPoseError, solve

NAMES = {"epnp": "EPnP", "ippe": "IPPE", "sqpnp": "SQPnP", "iterative": "Iterative PnP"}


def peer_poses(found: Estimate) -> dict[str, CirclePose | str]:
    """Pose by each method, or a sentence why there is none; empty where the dock has no coloured lights."""
    choice, markers, ring = found.choice, found.markers, found.ring
    if not found.dock.colours or choice is None or choice.lights is None or markers is None or ring is None:
        return {}
    points_px = markers.points_px[ring.on_ring]
    poses: dict[str, CirclePose | str] = {}
    for method in METHODS:
        try:
            poses[NAMES.get(method, method)] = solve(points_px, choice.lights, found.camera, found.dock, method)
        except NoPoseError as error:
            poses[NAMES.get(method, method)] = str(error)
    return poses
