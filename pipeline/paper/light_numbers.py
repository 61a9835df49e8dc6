"""Figure 17 of the paper: error of the pose against the number of lights, by the ellipse, EPnP, its peers, and ours."""

import math
from dataclasses import dataclass

import numpy as np
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.paper.lights.levels import poses_of_all
from dockpose.paper.tables import CAMERA, DIAMETER_M
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles
from dockpose.pose.pnp import METHODS, NoPoseError, solve
from dockpose.pose.solve import find_poses
from dockpose.study.draw import tilted_normal
from dockpose.study.judge import nearest, pose_errors

NOISE_PX = 0.3
RANGE_M, OFF_AXIS, TILT_DEG = (0.7, 2.5), 0.1, 40.0
RING_OF = 12  # lights, as the paper's coloured dock has, of which some are seen
WHO = ("ellipse", *METHODS, "ours")
TRIALS = 400
WRONG_DEG = 10.0  # off by more, it is a different pose


@dataclass(frozen=True)
class Errors:
    """Errors over many random poses, by method, of ``WHO``; infinite where a method gave no pose."""

    position: dict[str, np.ndarray]  # distance between the true and the estimated centre
    angle_deg: dict[str, np.ndarray]  # angle between the true and the estimated normal

    def quantile(self, what: str, who: str, share: float = 0.5) -> float:
        """Of ``position`` or ``angle_deg``, without interpolation, so that infinite ones do no harm."""
        return float(np.quantile(getattr(self, what)[who], share, method="inverted_cdf"))

    def wrong(self, who: str) -> float:
        """Share of poses that are turned by more than 10 degrees, or missing."""
        return float((self.angle_deg[who] > WRONG_DEG).mean())


def errors_with(seen: int, lights: int, seed: int, trials: int = TRIALS) -> Errors:
    """Errors where ``seen`` of ``lights`` evenly spaced lights are seen, each with 0.3 px of noise."""
    # The ellipse's is that of its better pose; EPnP and its peers are given which light is which, our method is not.
    known = Dock(DIAMETER_M, lights)
    found: dict[str, list[tuple[float, float]]] = {who: [] for who in WHO}
    for trial in range(trials):
        rng = np.random.default_rng([seed, 9, seen, lights, trial])
        position, theta = _random_pose(rng)
        rotation = rotation_from_angles(*theta)
        numbers = np.sort(rng.choice(lights, seen, replace=False))
        angles = known.light_angles_rad()[numbers] + rng.uniform(0, 2 * math.pi)
        ring = known.radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(seen)])
        points = CAMERA.project(position + ring @ rotation.T) + rng.normal(0, NOISE_PX, (seen, 2))
        true = CirclePose(position, -rotation[:, 2], np.zeros(2))
        for who in WHO:
            pose = _pose_by(who, points, numbers, known, -rotation[:, 2])
            off_m, angle_deg = (math.inf, math.inf) if pose is None else pose_errors(pose, true)
            found[who].append((100 * off_m / float(np.linalg.norm(position)), angle_deg))
    return Errors(
        {who: np.array([one for one, _ in errors]) for who, errors in found.items()},
        {who: np.array([other for _, other in errors]) for who, errors in found.items()},
    )


def _random_pose(rng: np.random.Generator) -> tuple[np.ndarray, tuple[float, float]]:
    """Position, and theta_x and theta_y in radians, of a dock in view that is tilted up to 40 degrees."""
    range_m = rng.uniform(*RANGE_M)
    position = range_m * np.array([*rng.uniform(-OFF_AXIS, OFF_AXIS, 2), 1.0])
    tilt, around = math.radians(rng.uniform(0, TILT_DEG)), rng.uniform(0, 2 * math.pi)
    return position, angles_of(tilted_normal(np.array([0.0, 0.0, 1.0]), tilt, around))


def _pose_by(who: str, points: np.ndarray, numbers: np.ndarray, dock: Dock, normal: np.ndarray) -> CirclePose | None:
    try:
        if who == "ours":
            choice = find_poses(points, CAMERA, dock)[1]
            return choice.candidates[choice.selected]
        if who == "ellipse":
            poses = poses_of_all(points, CAMERA, dock)
            return nearest(poses, normal) if poses else None
        return solve(points, numbers, CAMERA, dock, who)
    except (NoEllipseError, NoPoseError):
        return None
