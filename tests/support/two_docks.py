"""Films in which a second dock comes into view while the first one stays; drawn here, not by the simulator."""

import numpy as np
from dockpose import Dock, Tracker
from dockpose.pose.circle import rotation_from_angles

from tests.support.scenes import CAMERA, DOCK

RADIUS_M, ENTERS = 0.15, 5
UNKNOWN = Dock(diameter=2 * RADIUS_M)


def drawn(docks, seed):
    """A noisy picture of docks: (N, 3) lights in metres, their peak in levels and their radius in metres."""
    rng = np.random.default_rng(seed)
    picture = rng.normal(20, 1.5, (CAMERA.height, CAMERA.width))
    y, x = np.mgrid[:25, :25] - 12
    for lights_m, level, size_m in docks:
        for (u, v), z in zip(CAMERA.project(lights_m), lights_m[:, 2], strict=True):
            column, row = round(u), round(v)
            if not (12 <= column < CAMERA.width - 13 and 12 <= row < CAMERA.height - 13):
                continue
            spread = 2 * (0.8**2 + (CAMERA.fx * size_m / z) ** 2)
            spot = level * np.exp(-((x - u + column) ** 2 + (y - v + row) ** 2) / spread)
            picture[row - 12 : row + 13, column - 12 : column + 13] += spot
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def lights_m(position_m, angles_rad, count=10):
    around = 2 * np.pi * np.arange(count) / count + 0.2
    ring = RADIUS_M * np.column_stack([np.cos(around), np.sin(around), 0 * around])
    return ring @ rotation_from_angles(*angles_rad).T + position_m


def run(seed, kind, frames, leaves):
    """Pictures, and where the first dock is in each: another comes in beside it, and from ``leaves`` on it is gone."""
    rng = np.random.default_rng(seed)
    start, drift = rng.uniform([-0.45, -0.1, 1.8], [-0.3, 0.1, 2.2]), rng.uniform(-0.01, 0.01, 3)
    angles, others = rng.uniform(-0.4, 0.4, (2, 2))
    z = start[2] * (rng.uniform(0.65, 0.8) if kind == "nearer" else rng.uniform(0.95, 1.05))
    level = 230 if kind == "brighter" else 130
    count = int(rng.integers(12, 17)) if kind == "more lights" else 10
    for frame in range(frames):
        first = start + drift * frame
        beside = np.array([z * rng.uniform(0.20, 0.22) + max(0, ENTERS - frame) * 0.2, -start[1], z])
        docks = [(lights_m(first, angles), 130, 0.004)] if leaves is None or frame < leaves else []
        docks.append((lights_m(beside, others, count), level, 0.006 if kind == "brighter" else 0.004))
        yield drawn(docks, [seed, frame]), first


def follow(seed, kind, frames=12, leaves=None, *, follow_lights=False):
    """What the tracker makes of such a run, frame by frame, and how far it is off the first dock."""
    tracker = Tracker(CAMERA, UNKNOWN if kind == "more lights" else DOCK, follow_lights=follow_lights)
    for frame, (image, first_m) in enumerate(run(seed, kind, frames, leaves)):
        tracked = tracker.see(image, 0.1 * frame)
        off_m = np.inf if tracked.pose is None else float(np.linalg.norm(tracked.pose.position_m - first_m))
        yield tracked, off_m


def stays(followed):
    """Whether the track that the first dock began lasts, and shows that dock in each frame."""
    return all(tracked.track.age == frame + 1 and off_m < 0.1 for frame, (tracked, off_m) in enumerate(followed))
