"""What depends on a threshold's level: groups, ellipse, pose, centre, and whether they are right (Figs. 3, 14, 16)."""

from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import to_grey
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.pixels.bright import PixelGroups
from dockpose.pose.circle import CirclePose, circle_poses
from dockpose.settings import Settings
from dockpose.simulate import Scene, render
from dockpose.study.judge import is_right, pose_errors
from dockpose.thresholds import LEVELS, Histogram, histogram_of
from dockpose.thresholds.hats import hats

SAME_LIGHT_PX = 4.0  # a group so near to a light is that light
MIN_AREA_PX = Settings().min_area_px
FEWER = 2 / 3  # of the lights are left at the higher of two levels, at most
PARAMETERS = ("centre x", "centre y", "semi-major axis", "semi-minor axis", "angle", "eccentricity")


def are_the_lights(points_px: np.ndarray, lights_px: np.ndarray) -> bool:
    """Whether points (N, 2) are the lights (M, 2), each once, and nothing else."""
    if len(points_px) != len(lights_px):
        return False
    near = np.linalg.norm(points_px[:, None] - lights_px[None], axis=2) < SAME_LIGHT_PX
    return bool((near.sum(axis=0) == 1).all() and (near.sum(axis=1) == 1).all())


def group_centres(histogram: Histogram, level: int, min_area_px: int = MIN_AREA_PX) -> np.ndarray:
    """Mass moments (N, 2) in pixels of the groups that a level leaves; none is split, merged or left out."""
    if level >= LEVELS or (pixels := histogram.bright(level)).is_empty:
        return np.empty((0, 2))
    count, labels = pixels.groups()
    shapes = PixelGroups(pixels, labels, count).shapes()
    return shapes.moments[shapes.areas >= min_area_px]


def poses_of_all(points_px: np.ndarray, camera: Camera, dock: Dock) -> tuple[CirclePose, ...]:
    """Both poses of the ellipse through all points (N, 2), as the paper reads; none where there is no ellipse."""
    if len(points_px) < MIN_POINTS:
        return ()
    try:
        return circle_poses(fit_ellipse(camera.undistort(points_px)), camera, dock.diameter)
    except NoEllipseError:
        return ()


def any_level_shows_the_lights(histogram: Histogram, lights_px: np.ndarray) -> bool:
    """Whether at any level that keeps at most a fifth of the picture the groups are exactly the lights."""
    shares = histogram.counts.cumsum() / histogram.counts.sum()
    floor = int(np.searchsorted(shares, 0.8)) + 1
    counts = histogram.bright(floor).groups_at_every_level(MIN_AREA_PX)
    levels = np.flatnonzero(counts == len(lights_px)).tolist()
    return any(are_the_lights(group_centres(histogram, level), lights_px) for level in levels)


@dataclass(frozen=True)
class AtLevel:
    """What a picture shows at a level."""

    level: int
    kept: float  # share of the picture that is at or above it
    groups: int  # of at least the minimum area
    found: Estimate
    off: tuple[float, float]  # see :meth:`Picture.off`
    is_right: bool  # whether the chosen pose is the true one


class Picture:
    """A rendered picture with what the threshold methods need of it."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.image, self.truth = render(scene)
        self.lights_px = self.truth.lights_px[self.truth.visible]
        self.lights = len(self.lights_px)
        self.histogram = histogram_of(to_grey(self.image))
        self.hats = hats(self.histogram, MIN_AREA_PX)
        self.groups = self.histogram.bright(0).groups_at_every_level(MIN_AREA_PX)  # (256,): how many at each level

    def at(self, level: int) -> AtLevel:
        """Search the picture at a fixed level."""
        settings = Settings(method="fixed", level=level)
        found = estimate(self.image, self.scene.camera, self.scene.dock, settings, fall_back=False)
        kept = float((self.histogram.levels >= level).mean())
        right = is_right(found.selected, self.truth)
        return AtLevel(level, kept, int(self.groups[level]), found, self.off(found), right)

    def off(self, found: Estimate) -> tuple[float, float]:
        """How far the chosen pose is off in millimetres, and its normal in degrees; NaN where there is none."""
        if found.selected is None:
            return np.nan, np.nan
        off_m, off_deg = pose_errors(found.selected, self.truth)
        return 1000 * off_m, off_deg

    def losing_level(self, share: float = 0.5) -> int:
        """The lowest level above HATS's at which at most this share of the lights is left."""
        above = np.flatnonzero(self.groups[self.hats.level :] <= share * self.lights)
        return self.hats.level + int(above[0]) if len(above) else LEVELS - 1


def centre_errors_px(found: Estimate, centre_px: np.ndarray) -> np.ndarray:
    """Distance (3,) in pixels of mass moment, ellipse's and pose's centre from the dock's (2,) (Fig. 14)."""
    if found.selected is None or found.ellipse is None or found.markers is None or found.ring is None:
        return np.full(3, np.nan)
    points = found.markers.points_px[found.ring.on_ring]
    undistorted = found.camera.virtual_pixels(points, float(found.selected.position_m[2]))
    centres = np.array([undistorted.mean(axis=0), found.ellipse.centre_px, found.selected.centre_px])
    return np.linalg.norm(centres - centre_px, axis=1)


def two_levels(first: Picture, pictures: int) -> tuple[tuple[int, int], np.ndarray, np.ndarray]:
    """The ellipse through the mass moments at HATS's level and at a higher one with at most ``FEWER`` of the lights."""
    # Both levels, groups (K, 2) at each, and how far ``PARAMETERS`` are off (K, 2, 6), of K pictures with other noise.
    # The ring moves by up to half a pixel, lest the error by its place between pixels be the same in all of them.
    scene, levels = first.scene, (first.hats.level, first.losing_level(FEWER))
    rng = np.random.default_rng([scene.seed, *b"places"])
    lights, errors = [], []
    for number in range(pictures):
        x, y, z = scene.pose.position_m
        dx, dy = (rng.uniform(-0.5, 0.5, 2) * z / [scene.camera.fx, scene.camera.fy]).tolist()
        pose = msgspec.structs.replace(scene.pose, position_m=(x + dx, y + dy, z))
        image, truth = render(msgspec.structs.replace(scene, pose=pose, seed=scene.seed + number))
        histogram = histogram_of(to_grey(image))
        points = [group_centres(histogram, level) for level in levels]
        if min(map(len, points)) >= MIN_POINTS:
            lights.append([len(part) for part in points])
            exact = ellipse_values(truth.ellipse)
            errors.append([ellipse_values(fit_ellipse(part)) - exact for part in points])
    return levels, np.array(lights), np.array(errors)


def ellipse_values(ellipse: Ellipse | None) -> np.ndarray:
    """Return ``PARAMETERS`` (6,) of an ellipse in view: pixels, and degrees for the angle."""
    assert ellipse is not None
    angle = float(np.degrees(ellipse.angle_rad))
    return np.array([*ellipse.centre_px, *ellipse.semi_axes_px, angle, ellipse.eccentricity])
