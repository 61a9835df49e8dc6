"""The flat port before a camera that is known in air, from pictures of a board in the water."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.bundle import PORT_STEP_M, Sigmas, adjust, errors_px, settled_pose, sigmas
from dockpose.camera.camera import Camera
from dockpose.camera.fitting import CalibrationError
from dockpose.camera.port import FlatPort
from dockpose.camera.sigma import with_numbers, with_port_errors
from msgspec.structs import replace

LIKELY_PORT = FlatPort(air_gap_m=0.020, glass_m=0.010)
_LENGTHS = ("air_gap_m", "glass_m")  # that are fitted
_TOLD_M = 0.002  # standard error of the glass, above which its thickness is not known
_UNTOLD_M = 0.010  # of the air gap, above which the pictures tell nothing
_WORST_SHARE = 0.003  # of the picture's longer side: a larger error is no port's


@dataclass(frozen=True)
class FittedPort:
    """A port that was fitted."""

    camera: Camera  # the camera with its port
    sigmas: Sigmas  # standard errors in metres: of the air gap and, where it was fitted, the glass
    glass_sigma_m: float  # standard error of the glass's thickness when it is fitted too
    gap_per_glass: float  # by how much the air gap grows with the thickness that is assumed for the glass
    errors_px: np.ndarray  # (N,): root mean square reprojection error of each board
    without_px: float  # error over all boards with no port, of a camera seen as a pinhole in the water
    distances_m: tuple[float, float]  # the least and the largest distance of a board

    @property
    def glass_is_told(self) -> bool:
        """Whether the pictures tell the glass's thickness."""
        return "glass_m" in self.sigmas.values


def fit_port(sightings: Sequence[Sighting], camera: Camera) -> FittedPort:
    """Fit the air gap, and where the pictures tell it the glass, of a flat port (Treibitz et al. 2012)."""
    if len(sightings) < 3:
        raise CalibrationError(f"{len(sightings)} boards do not determine a port; 3 are needed, better 12")
    known = camera.port or LIKELY_PORT
    bare = replace(camera, port=replace(known, air_gap_m=0.0, glass_m=0.0))
    start = replace(camera, port=known)
    poses = np.array([_pose(each, start, known.water_index) for each in sightings])
    glass_sigma, slope = _glass(sightings, poses, start)
    names = _LENGTHS if glass_sigma < _TOLD_M else _LENGTHS[:1]
    numbers, poses = adjust(sightings, poses, start, names)
    found = sigmas(sightings, poses, start, names, numbers)
    if not found.values["air_gap_m"] < _UNTOLD_M:
        raise CalibrationError(
            f"the pictures cannot determine the port's air gap (to {1000 * found.values['air_gap_m']:.0f} mm at best); "
            "take more, with the board near the window and reaching into the picture's corners"
        )
    with_port = with_numbers(start, names, numbers)
    errors = errors_px(with_port, sightings, poses)
    if not np.sqrt((errors**2).mean()) < _WORST_SHARE * max(camera.width, camera.height):
        raise CalibrationError(
            f"no flat port explains the boards (error {np.sqrt((errors**2).mean()):.1f} px); is the window at right "
            "angles to the camera, and was the camera calibrated in air?"
        )
    pinhole = np.array([settled_pose(bare, each, pose) for each, pose in zip(sightings, poses, strict=True)])
    without = float(np.sqrt((errors_px(bare, sightings, pinhole) ** 2).mean()))
    away = np.linalg.norm(poses[:, 3:], axis=1)
    with_port = with_port_errors(with_port, names, found.covariance)
    return FittedPort(with_port, found, glass_sigma, slope, errors, without, (float(away.min()), float(away.max())))


def _glass(sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera) -> tuple[float, float]:
    """Standard error of the glass, fitted with the gap; and how the gap grows with it, from two fits of the gap."""
    numbers, settled = adjust(sightings, poses, camera, _LENGTHS)
    sigma = sigmas(sightings, settled, camera, _LENGTHS, np.maximum(numbers, 2 * PORT_STEP_M)).values["glass_m"]
    gaps = []
    for glass_m in (0.005, 0.015):
        alone = with_numbers(camera, _LENGTHS[1:], np.array([glass_m]))
        gaps.append(float(adjust(sightings, poses, alone, _LENGTHS[:1])[0][0]))
    return sigma, (gaps[1] - gaps[0]) / 0.010


def _pose(sighting: Sighting, camera: Camera, water_index: float) -> np.ndarray:
    """Pose (6,) of a board behind a port: first as by a longer lens, for water magnifies, then behind a likely port."""
    K = camera.matrix @ np.diag([water_index, water_index, 1.0])
    pixels = replace(camera, port=None).undistort(sighting.picture_px.astype(float))
    _, turn, shift = cv2.solvePnP(sighting.board_m.astype(float), pixels, K, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return settled_pose(camera, sighting, np.r_[turn.ravel(), shift.ravel()])
