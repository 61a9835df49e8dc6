"""What depends on a threshold's level: groups, ellipse, pose, centre, and whether they are right (Figs. 3, 14, 16)."""

from collections.abc import Sequence
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
from dockpose.simulate import Scene, Truth, render
from dockpose.study.judge import pose_errors
from dockpose.thresholds import LEVELS, Histogram, Threshold, histogram_of
from dockpose.thresholds.hats import background_mode, hats

SAME_LIGHT_PX = 4.0  # a group so near to a light is that light
RIGHT_DEG, RIGHT_SHARE = 5.0, 0.03  # of the angle, and of the range


def are_the_lights(points_px: np.ndarray, lights_px: np.ndarray) -> bool:
    """Whether points (N, 2) are the lights (M, 2), each once, and nothing else."""
    if len(points_px) != len(lights_px):
        return False
    near = np.linalg.norm(points_px[:, None] - lights_px[None], axis=2) < SAME_LIGHT_PX
    return bool((near.sum(axis=0) == 1).all() and (near.sum(axis=1) == 1).all())


def group_centres(histogram: Histogram, level: int, min_area_px: int) -> np.ndarray:
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


def is_right(pose: CirclePose, truth: Truth) -> bool:
    """Whether a pose is the true one, within ``RIGHT_DEG`` and ``RIGHT_SHARE`` of the range."""
    distance_m, angle_deg = pose_errors(pose, truth)
    return distance_m < RIGHT_SHARE * float(truth.position_m[2]) and angle_deg < RIGHT_DEG


def pose_is_right(found: Estimate, truth: Truth) -> bool:
    """Whether the chosen pose is right; not where there is none."""
    return found.selected is not None and is_right(found.selected, truth)


def any_level_shows_the_lights(histogram: Histogram, lights_px: np.ndarray, min_area_px: int) -> bool:
    """Whether at any level that keeps at most a fifth of the picture the groups are exactly the lights."""
    shares = histogram.counts.cumsum() / histogram.counts.sum()
    floor = int(np.searchsorted(shares, 0.8)) + 1
    counts = histogram.bright(floor).groups_at_every_level(min_area_px)
    levels = np.flatnonzero(counts == len(lights_px)).tolist()
    return any(are_the_lights(group_centres(histogram, level, min_area_px), lights_px) for level in levels)


MIN_AREA_PX = Settings().min_area_px
FEWER = 2 / 3  # of the lights are left at the higher of two levels, at most
PARAMETERS = ("centre x", "centre y", "semi-major axis", "semi-minor axis", "angle", "eccentricity")


@dataclass(frozen=True)
class Picture:
    """A rendered picture with what the threshold methods need of it."""

    image: np.ndarray  # (H, W)
    scene: Scene
    truth: Truth
    histogram: Histogram
    hats: Threshold
    groups: np.ndarray  # (256,): number of groups of at least the minimum area at every level

    @property
    def lights(self) -> int:
        """How many lights are visible."""
        return int(self.truth.visible.sum())


@dataclass(frozen=True)
class AtLevel:
    """What a picture shows at a level."""

    level: int
    kept: float  # share of the picture that is at or above it
    groups: int  # of at least the minimum area
    found: Estimate
    distance_m: float  # of the chosen pose from the true one; NaN where there is none
    angle_deg: float  # between their normals
    is_right: bool  # whether the chosen pose is the true one


def picture_of(scene: Scene) -> Picture:
    """Render a scene, and count its groups at every level."""
    image, truth = render(scene)
    histogram = histogram_of(to_grey(image))
    groups = histogram.bright(0).groups_at_every_level(MIN_AREA_PX)
    return Picture(image, scene, truth, histogram, hats(histogram, MIN_AREA_PX), groups)


def at_level(picture: Picture, level: int) -> AtLevel:
    """Search a picture at a fixed level."""
    scene = picture.scene
    found = estimate(picture.image, scene.camera, scene.dock, Settings(method="fixed", level=level), fall_back=False)
    kept = float((picture.histogram.levels >= level).mean())
    errors = (np.nan, np.nan) if found.selected is None else pose_errors(found.selected, picture.truth)
    return AtLevel(level, kept, int(picture.groups[level]), found, *errors, pose_is_right(found, picture.truth))


def merged_level(picture: Picture) -> int:
    """The highest level below HATS's at which groups have run together: at most half as many as lights are left."""
    below = np.flatnonzero(picture.groups[: picture.hats.level] <= picture.lights / 2)
    return int(below[-1]) if len(below) else 0


def flooded_level(picture: Picture) -> int:
    """The level above the background's most frequent one, at which noise keeps about half of the background."""
    return background_mode(picture.histogram.counts) + 1


def losing_level(picture: Picture, share: float = 0.5) -> int:
    """The lowest level above HATS's at which at most this share of the lights is left."""
    above = np.flatnonzero(picture.groups[picture.hats.level :] <= share * picture.lights)
    return picture.hats.level + int(above[0]) if len(above) else LEVELS - 1


def centre_sweep(picture: Picture, levels: Sequence[int]) -> np.ndarray:
    """Errors (N, 3) of the dock's centre at each level in pixels: mass moment, ellipse, pose; NaN without a pose."""
    return np.array([centre_errors_px(at_level(picture, level).found, picture.truth.centre_px) for level in levels])


def centres(points_px: np.ndarray, ellipse: Ellipse, pose: CirclePose) -> np.ndarray:
    """The dock's centre (3, 2) by mass moment, ellipse and pose, from lights (N, 2) in the undistorted picture."""
    return np.array([points_px.mean(axis=0), ellipse.centre_px, pose.centre_px])


def centre_errors_px(found: Estimate, centre_px: np.ndarray) -> np.ndarray:
    """Distance (3,) in pixels of each of :func:`centres` from the dock's centre (2,) (Fig. 14 of the paper)."""
    if found.selected is None or found.ellipse is None or found.markers is None or found.ring is None:
        return np.full(3, np.nan)
    points = found.markers.points_px[found.ring.on_ring]
    undistorted = found.camera.virtual_pixels(points, float(found.selected.position_m[2]))
    return np.linalg.norm(centres(undistorted, found.ellipse, found.selected) - centre_px, axis=1)


@dataclass(frozen=True)
class TwoLevels:
    """The ellipse at two levels in pictures that differ in their noise, and in where the ring lies on the pixels."""

    levels: tuple[int, int]  # HATS's level of the first picture, and a higher one
    lights: np.ndarray  # (K, 2): groups of each picture at each
    # (6,): ``PARAMETERS`` of the exact image of the circle in the first picture: pixels, and degrees for the angle
    true_values: np.ndarray
    errors: np.ndarray  # (K, 2, 6): the fitted ones less the exact ones of each picture

    @property
    def mean_difference(self) -> np.ndarray:
        """Mean (6,) of the higher level's value less the lower one's."""
        return np.diff(self.errors, axis=1)[:, 0].mean(axis=0)

    @property
    def standard_error(self) -> np.ndarray:
        """Standard error (6,) of the mean difference."""
        return np.diff(self.errors, axis=1)[:, 0].std(axis=0, ddof=1) / np.sqrt(len(self.errors))


def two_levels(scene: Scene, pictures: int) -> TwoLevels:
    """Fit the ellipse to the mass moments at HATS's level and at a higher one with at most ``FEWER`` of the lights."""
    # The ring moves by up to half a pixel, lest the error by its place between pixels be the same in all pictures.
    first = picture_of(scene)
    levels = first.hats.level, losing_level(first, FEWER)
    rng = np.random.default_rng([scene.seed, *b"places"])
    lights, errors = [], []
    for number in range(pictures):
        image, truth = render(_moved(scene, number, rng.uniform(-0.5, 0.5, 2)))
        histogram = histogram_of(to_grey(image))
        points = [group_centres(histogram, level, MIN_AREA_PX) for level in levels]
        if min(map(len, points)) < MIN_POINTS:
            continue
        lights.append([len(part) for part in points])
        exact = _exact_values(truth)
        errors.append([np.subtract(ellipse_values(fit_ellipse(part)), exact) for part in points])
    return TwoLevels(levels, np.array(lights), _exact_values(first.truth), np.array(errors))


def _moved(scene: Scene, number: int, shift_px: np.ndarray) -> Scene:
    """The scene with new noise, its dock moved across by so many pixels."""
    x, y, z = scene.pose.position_m
    dx, dy = (shift_px * z / [scene.camera.fx, scene.camera.fy]).tolist()
    pose = msgspec.structs.replace(scene.pose, position_m=(x + dx, y + dy, z))
    return msgspec.structs.replace(scene, pose=pose, seed=scene.seed + number)


def _exact_values(truth: Truth) -> np.ndarray:
    assert truth.ellipse is not None
    return np.array(ellipse_values(truth.ellipse))


def ellipse_values(ellipse: Ellipse) -> tuple[float, ...]:
    """Return an ellipse's ``PARAMETERS``: pixels, and degrees for the angle."""
    angle = float(np.degrees(ellipse.angle_rad))
    return (*ellipse.centre_px, *ellipse.semi_axes_px, angle, ellipse.eccentricity)
