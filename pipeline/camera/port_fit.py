"""The flat port before a camera that is known in air, from pictures of a board in the water."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.bundle import Shared, Sigmas, adjust, residuals, rms_px, settled_pose, sigmas
from dockpose.camera.camera import Camera
from dockpose.camera.fitting import CalibrationError
from dockpose.camera.port import FlatPort
from dockpose.camera.sigma import with_port_errors
from msgspec.structs import replace

LIKELY_PORT = FlatPort(air_gap_m=0.020, glass_m=0.010)
_STEP_M = 1e-5
_TOLD_M = 0.002  # standard error of the glass, above which its thickness is not known
_UNTOLD_M = 0.010  # of the air gap, above which the pictures tell nothing
_WORST_SHARE = 0.003  # of the picture's longer side: a larger error is no port's


@dataclass(frozen=True)
class FittedPort:
    """A port that was fitted."""

    camera: Camera  # the camera with its port
    sigmas: Sigmas  # standard errors in metres: ``air_gap`` and, where it was fitted, ``glass``
    glass_sigma_m: float  # standard error of the glass's thickness when it is fitted too
    gap_per_glass: float  # by how much the air gap grows with the thickness that is assumed for the glass
    errors_px: np.ndarray  # (N,): root mean square reprojection error of each board
    without_px: float  # error over all boards with no port, of a camera seen as a pinhole in the water
    distances_m: tuple[float, float]  # the least and the largest distance of a board

    @property
    def glass_is_told(self) -> bool:
        """Whether the pictures tell the glass's thickness."""
        return "glass" in self.sigmas.values


def fit_port(sightings: Sequence[Sighting], camera: Camera) -> FittedPort:
    """Fit the air gap, and where the pictures tell it the glass, of a flat port (Treibitz et al. 2012)."""
    if len(sightings) < 3:
        raise CalibrationError(f"{len(sightings)} boards do not determine a port; 3 are needed, better 12")
    known = camera.port or LIKELY_PORT
    bare = replace(camera, port=replace(known, air_gap_m=0.0, glass_m=0.0))
    start = replace(camera, port=known)
    poses = np.array([_pose(each, start, known.water_index) for each in sightings])
    glass_sigma, slope = _glass(sightings, poses, camera, known)
    shared = _shared(camera, known, ("air_gap", "glass") if glass_sigma < _TOLD_M else ("air_gap",))
    numbers, poses = adjust(sightings, poses, shared)
    found = sigmas(sightings, poses, Shared(shared.names, numbers, shared.steps, shared.camera_of))
    if not found.values["air_gap"] < _UNTOLD_M:
        raise CalibrationError(
            f"the pictures cannot determine the port's air gap (to {1000 * found.values['air_gap']:.0f} mm at best); "
            "take more, with the board near the window and reaching into the picture's corners"
        )
    with_port = shared.camera_of(numbers)
    errors = np.array([rms_px(residuals(with_port, each, pose)) for each, pose in zip(sightings, poses, strict=True)])
    if not np.sqrt((errors**2).mean()) < _WORST_SHARE * max(camera.width, camera.height):
        raise CalibrationError(
            f"no flat port explains the boards (error {np.sqrt((errors**2).mean()):.1f} px); is the window at right "
            "angles to the camera, and was the camera calibrated in air?"
        )
    pinhole = [
        residuals(bare, each, settled_pose(bare, each, pose)) for each, pose in zip(sightings, poses, strict=True)
    ]
    away = np.linalg.norm(poses[:, 3:], axis=1)
    without = float(np.sqrt(np.mean([rms_px(off) ** 2 for off in pinhole])))
    with_port = with_port_errors(with_port, [f"{name}_m" for name in shared.names], found.covariance)
    return FittedPort(with_port, found, glass_sigma, slope, errors, without, (float(away.min()), float(away.max())))


def _shared(camera: Camera, port: FlatPort, names: tuple[str, ...]) -> Shared:
    """The port's lengths that are fitted, from those of a port on."""
    start = np.array([port.air_gap_m, port.glass_m][: len(names)])

    def camera_of(each: np.ndarray) -> Camera:
        lengths = np.maximum(each, 0.0).tolist()  # a step may lead below
        glass_m = lengths[1] if len(lengths) > 1 else port.glass_m
        return replace(camera, port=replace(port, air_gap_m=lengths[0], glass_m=glass_m))

    return Shared(names, start, np.full(len(names), _STEP_M), camera_of)


def _glass(sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera, port: FlatPort) -> tuple[float, float]:
    """Standard error of the glass, fitted with the gap; and how the gap grows with it, from two fits of the gap."""
    both = _shared(camera, port, ("air_gap", "glass"))
    numbers, settled = adjust(sightings, poses, both)
    fitted = Shared(both.names, np.maximum(numbers, 2 * _STEP_M), both.steps, both.camera_of)
    sigma = sigmas(sightings, settled, fitted).values["glass"]
    gaps = []
    for glass_m in (0.005, 0.015):
        alone = _shared(camera, replace(port, glass_m=glass_m), ("air_gap",))
        gaps.append(float(adjust(sightings, poses, alone)[0][0]))
    return sigma, (gaps[1] - gaps[0]) / 0.010


def _pose(sighting: Sighting, camera: Camera, water_index: float) -> np.ndarray:
    """Pose (6,) of a board behind a port: first as by a longer lens, for water magnifies, then behind a likely port."""
    K = camera.matrix @ np.diag([water_index, water_index, 1.0])
    pixels = replace(camera, port=None).undistort(sighting.picture_px.astype(float))
    _, turn, shift = cv2.solvePnP(sighting.board_m.astype(float), pixels, K, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return settled_pose(camera, sighting, np.r_[turn.ravel(), shift.ravel()])
