"""How others find a dock: printed tags, a printed ring, PnP on lights, and what a student writes in an afternoon."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from dockpose import estimate
from dockpose.lights.ellipse import Ellipse, NoEllipseError, fit_ellipse
from dockpose.pose.circle import CirclePose, circle_poses
from dockpose.pose.pnp import NoPoseError, solve
from dockpose.pose.refine import angles_on_planes, light_rays

from tests.bench.peers.scenes import INNER, SIDE_M, TAG_ID, Seen

SURE = 0.95
OUTER_M = 0.9 * SIDE_M
_AREA_OF_INNER = INNER**2 / (1 - INNER**2)  # of the white disc, over that of the black ring around it
_RIVAL_ERROR = 2.0  # the other of two poses is out where its corners or gaps are off by so many times as much


class Answer(NamedTuple):
    """A pose, and whether the method is sure which of two it is; a method that cannot tell says always that it is."""

    position_m: np.ndarray
    normal: np.ndarray
    is_sure: bool = True


def ours(seen: Seen) -> Answer | None:
    """The program as it comes."""
    found = estimate(seen.images["ring"], seen.camera, seen.dock)
    if found.status != "ok" or found.selected is None:
        return None
    chance = (found.selected.probability or 0.0) * (1.0 if found.detection is None else found.detection)
    return Answer(found.selected.position_m, found.selected.normal, chance > SURE)


def told_lights(seen: Seen) -> Answer | None:
    """SQPnP on the centres that the program finds, told by the truth which light is which."""
    found = estimate(seen.images["ring"], seen.camera, seen.dock)
    if found.markers is None:
        return None
    apart = np.hypot(*(found.markers.points_px[:, None] - seen.lights_px).transpose(2, 0, 1))
    pairs = [(int(row.argmin()), number) for number, row in enumerate(apart) if row.min() < 3]
    pairs = list(dict(pairs).items())
    if len(pairs) < 6:
        return None
    return _by_pnp(found.markers.points_px[[point for _, point in pairs]], [light for light, _ in pairs], seen)


def untold_lights(seen: Seen) -> Answer | None:
    """SQPnP on what Otsu's level leaves, if as many groups as lights, numbered as they lie around their mean."""
    points = _centres_by_otsu(seen.images["ring"])
    if len(points) != seen.dock.lights:
        return None
    off = points - points.mean(axis=0)
    return _by_pnp(points[np.argsort(np.arctan2(off[:, 1], off[:, 0]))], range(len(points)), seen)


def _by_pnp(points_px: np.ndarray, lights: Any, seen: Seen) -> Answer | None:
    try:
        pose = solve(points_px, list(lights), seen.camera, seen.dock, "sqpnp")
    except NoPoseError:
        return None
    return Answer(pose.position_m, pose.normal)


def student_otsu(seen: Seen) -> Answer | None:
    """Otsu's level, an ellipse through all groups, and of the circle's two poses the one with the more even gaps."""
    return _student(_centres_by_otsu(seen.images["ring"]), seen)


def student_blobs(seen: Seen) -> Answer | None:
    """OpenCV's blobs in place of Otsu's groups."""
    how = cv2.SimpleBlobDetector.Params()
    how.filterByColor, how.blobColor = True, 255
    how.filterByArea, how.minArea, how.maxArea = True, 3, 5000
    how.filterByConvexity = how.filterByInertia = how.filterByCircularity = False
    how.minThreshold, how.maxThreshold, how.minDistBetweenBlobs = 20, 250, 3
    blobs = cv2.SimpleBlobDetector.create(how).detect(seen.images["ring"])
    return _student(np.array([blob.pt for blob in blobs]).reshape(-1, 2), seen)


def _centres_by_otsu(image: np.ndarray) -> np.ndarray:
    _, binary = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    _, _, stats, centres = cv2.connectedComponentsWithStats(binary)
    return centres[1:][stats[1:, cv2.CC_STAT_AREA] >= 3]


def _student(points_px: np.ndarray, seen: Seen) -> Answer | None:
    if not 5 <= len(points_px) <= 500:
        return None
    (x, y), (wide, high), turn = cv2.fitEllipse(points_px.astype(np.float32))
    if not min(wide, high) > 0 or not math.isfinite(wide + high):
        return None
    poses = _of_circle(_ellipse(x, y, wide / 2, high / 2, math.radians(turn)), seen, seen.dock.diameter)
    if not poses:
        return None
    off, other = sorted(poses, key=lambda pose: _unevenness(points_px, pose, seen))
    is_sure = _unevenness(points_px, other, seen) > _RIVAL_ERROR * _unevenness(points_px, off, seen)
    return Answer(off.position_m, off.normal, is_sure)


def _unevenness(points_px: np.ndarray, pose: CirclePose, seen: Seen) -> float:
    """How far the points are from even spacing on a pose's plane: the phase's circular deviation."""
    rays = light_rays(points_px, seen.camera, float(pose.position_m[2]))
    angles = angles_on_planes(rays, pose.rotation[None], pose.position_m[None])
    return math.sqrt(-2 * math.log(abs(np.exp(1j * (seen.dock.lights or 0) * angles).mean()) + 1e-12))


def _ellipse(x: float, y: float, a: float, b: float, turn: float) -> Ellipse | None:
    angles = np.linspace(0, 2 * math.pi, 24, endpoint=False)
    along, aside = a * np.cos(angles), b * np.sin(angles)
    cos, sin = math.cos(turn), math.sin(turn)
    try:
        return fit_ellipse(np.column_stack([x + along * cos - aside * sin, y + along * sin + aside * cos]))
    except NoEllipseError:
        return None


def _of_circle(ellipse: Ellipse | None, seen: Seen, diameter_m: float) -> tuple[CirclePose, ...]:
    try:
        return () if ellipse is None else circle_poses(ellipse, seen.camera, diameter_m)
    except NoEllipseError:
        return ()


def aruco(seen: Seen) -> Answer | None:
    """OpenCV's detector, dictionary 4x4, corners refined to parts of a pixel."""
    return _by_opencv(seen, "aruco", cv2.aruco.DICT_4X4_50, cv2.aruco.CORNER_REFINE_SUBPIX, 6)


def apriltag_opencv(seen: Seen) -> Answer | None:
    """OpenCV's detector with dictionary and corners of AprilTag, 36h11."""
    return _by_opencv(seen, "apriltag", cv2.aruco.DICT_APRILTAG_36H11, cv2.aruco.CORNER_REFINE_APRILTAG, 8)


def apriltag(seen: Seen) -> Answer | None:
    """The detector of AprilTag 3, 36h11, at full resolution."""
    found = [one for one in _apriltag_detector().detect(seen.images["apriltag"]) if one.tag_id == TAG_ID]
    if len(found) != 1:
        return None
    # Its corners begin at the lower left, against the clock.
    return _of_square(found[0].corners[[3, 2, 1, 0]], 8, seen)


def _by_opencv(seen: Seen, target: str, name: int, refinement: int, cells: int) -> Answer | None:
    corners, numbers, _ = _opencv_detector(name, refinement).detectMarkers(seen.images[target])
    if numbers is None or numbers.ravel().tolist().count(TAG_ID) != 1:
        return None
    return _of_square(corners[numbers.ravel().tolist().index(TAG_ID)][0], cells, seen)


@cache
def _opencv_detector(name: int, refinement: int) -> Any:
    how = cv2.aruco.DetectorParameters()
    how.cornerRefinementMethod, how.minMarkerPerimeterRate = refinement, 0.01
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(name), how)


@cache
def _apriltag_detector() -> Any:
    from pupil_apriltags import Detector  # pyright: ignore[reportMissingImports]

    return Detector(families="tag36h11", nthreads=1, quad_decimate=1.0)


def _of_square(corners_px: np.ndarray, cells: int, seen: Seen) -> Answer | None:
    """The pose of a tag by its corners, the first at its upper left, of the two that fit them the better one (IPPE)."""
    half = SIDE_M * cells / (cells + 2) / 2
    model = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    K = seen.camera.matrix
    points = np.ascontiguousarray(corners_px, np.float64).reshape(-1, 1, 2)
    count, turns, shifts, errors = cv2.solvePnPGeneric(model, points, K, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    if not count:
        return None
    R, t = cv2.Rodrigues(turns[0])[0], shifts[0].ravel()
    off = np.asarray(errors).ravel()
    return Answer(t, R[:, 2], len(off) < 2 or bool(off[1] > _RIVAL_ERROR * off[0]))


def whycon(seen: Seen) -> Answer | None:
    """WhyCon's ring, and the first of its two poses, which nothing in one picture tells apart."""
    poses = _whycon_poses(seen)
    return Answer(poses[0].position_m, poses[0].normal) if poses else None


def whycon_told(seen: Seen) -> Answer | None:
    """WhyCon's ring, and the pose whose normal is nearer to the truth."""
    poses = sorted(_whycon_poses(seen), key=lambda pose: -float(pose.normal @ seen.normal))
    return Answer(poses[0].position_m, poses[0].normal) if poses else None


def _whycon_poses(seen: Seen) -> tuple[CirclePose, ...]:
    """A black ring around a white disc, by areas, centres and moments of both (Krajnik et al. 2014)."""
    image = seen.images["whycon"]
    best: tuple[CirclePose, ...] = ()
    for binary in _binaries(image):
        count, labels, stats, centres = cv2.connectedComponentsWithStats(255 - binary, connectivity=8)
        whites = cv2.connectedComponentsWithStats(binary, connectivity=4)
        for number in range(1, count):
            x, y, wide, high, area = (int(value) for value in stats[number])
            if area < 20 or wide > 600 or high > 460:
                continue
            column, row = np.rint(centres[number]).astype(int)
            within = whites[1][min(479, row), min(639, column)]
            if within == 0 or not 0.6 < whites[2][within, cv2.CC_STAT_AREA] / area / _AREA_OF_INNER < 1.6:
                continue
            if np.hypot(*(whites[3][within] - centres[number])) > 0.05 * max(wide, high) + 0.5:
                continue
            rows, columns = np.nonzero(labels[y : y + high, x : x + wide] == number)
            best = best or _of_ring(np.column_stack([columns + x, rows + y]).astype(float), area, seen)
    return best


def _binaries(image: np.ndarray) -> list[np.ndarray]:
    """Black and white by the mean of what is around each pixel, and by one level for all."""
    around = cv2.adaptiveThreshold(image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY, 101, 3)
    return [around, cv2.threshold(image, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)[1]]


def _of_ring(pixels: np.ndarray, area: int, seen: Seen) -> tuple[CirclePose, ...]:
    """Both poses by the covariance of the black ring's pixels; that of a disc's would be r^2 / 4."""
    x, y = pixels.mean(axis=0)
    values, axes = np.linalg.eigh(np.cov(pixels.T) + np.eye(2) / 12)
    b, a = np.sqrt(4 * values / (1 + INNER**2))
    if not 0.7 < math.pi * a * b * (1 - INNER**2) / area < 1.4:
        return ()
    return _of_circle(_ellipse(x, y, a, b, math.atan2(axes[1, 1], axes[0, 1])), seen, OUTER_M)


METHODS: dict[str, Callable[[Seen], Answer | None]] = {
    "dockpose": ours,
    "SQPnP, told which light is which": told_lights,
    "SQPnP on Otsu's groups": untold_lights,
    "Otsu, fitEllipse": student_otsu,
    "SimpleBlob, fitEllipse": student_blobs,
    "AprilTag 3, 36h11": apriltag,
    "AprilTag 36h11 by OpenCV": apriltag_opencv,
    "ArUco 4x4": aruco,
    "WhyCon's ring, first pose": whycon,
    "WhyCon's ring, pose told": whycon_told,
}
OF_LIGHTS = tuple(METHODS)[:5]
