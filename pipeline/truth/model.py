"""Where the dock is in the camera by a trajectory, given clocks, mount, dock and scale, and how far results are off."""

from dataclasses import dataclass, replace

import numpy as np
from dockpose.pose.uncertainty import cross
from dockpose.truth.curve import Curve
from dockpose.truth.trajectory import DockTrack, angle_slopes, angles
from scipy.spatial.transform import Rotation

OFFSET, DRIFT, TURN, LEVER, PLACE, NORMAL, SCALE = 0, 1, slice(2, 5), slice(5, 8), slice(8, 11), slice(11, 13), 13
SIZE = 14


@dataclass(frozen=True)
class Setup:
    """All that is looked for."""

    offset_s: float  # in the film's middle
    drift: float
    mount: np.ndarray  # (3, 3): camera to body
    lever_m: np.ndarray  # (3,): camera in the body
    dock_m: np.ndarray  # (3,): in the world
    normal: np.ndarray  # (3,)
    log_scale: float = 0.0  # of true over estimated lengths

    @property
    def basis(self) -> np.ndarray:
        """Two directions (3, 2) across the normal."""
        return np.linalg.svd(self.normal[None])[2][1:].T

    def moved(self, step: np.ndarray) -> "Setup":
        """The setup after a step (14,)."""
        normal = self.normal + self.basis @ step[NORMAL]
        return Setup(
            self.offset_s + step[OFFSET],
            self.drift + step[DRIFT],
            self.mount @ Rotation.from_rotvec(step[TURN]).as_matrix(),
            self.lever_m + step[LEVER],
            self.dock_m + step[PLACE],
            normal / np.linalg.norm(normal),
            self.log_scale + step[SCALE],
        )

    def minus(self, other: "Setup") -> np.ndarray:
        """The step (14,) that leads here from another setup, of the normal to first order."""
        turn = Rotation.from_matrix(other.mount.T @ self.mount).as_rotvec()
        clocks = [self.offset_s - other.offset_s, self.drift - other.drift]
        across = other.basis.T @ (self.normal - other.normal)
        lengths = [*(self.lever_m - other.lever_m), *(self.dock_m - other.dock_m)]
        return np.array([*clocks, *turn, *lengths, *across, self.log_scale - other.log_scale])


@dataclass(frozen=True)
class Frames:
    """Docks that were seen beside a trajectory."""

    curve: Curve
    times_s: np.ndarray  # (N,)
    middle_s: float
    positions_m: np.ndarray  # (2, N, 3): of the chosen and the other candidate
    angles_rad: np.ndarray  # (2, N, 2)
    covariances: np.ndarray  # (N, 5, 5)

    @classmethod
    def of(cls, results: DockTrack, curve: Curve) -> "Frames":
        """Those of a track; the other candidate is the chosen one where it is not known."""
        other_m, other = results.other_positions_m, results.other_normals
        places, normals = results.positions_m, results.normals
        if other_m is not None and other is not None:
            known = np.isfinite(np.hstack([other_m, other])).all(axis=1, keepdims=True)
            other_m, other = np.where(known, other_m, places), np.where(known, other, normals)
        both_m = np.stack([places, places if other_m is None else other_m])
        both = np.stack([angles(normals), angles(normals if other is None else other)])
        middle_s = float(results.times_s[[0, -1]].mean())
        return cls(curve, results.times_s, middle_s, both_m, both, results.covariances)

    def some(self, which: np.ndarray) -> "Frames":
        """Some of the frames."""
        return replace(
            self,
            times_s=self.times_s[which],
            positions_m=self.positions_m[:, which],
            angles_rad=self.angles_rad[:, which],
            covariances=self.covariances[which],
        )

    def against(self, setup: Setup) -> "Compared":
        """What is off if the setup is so."""
        since = self.times_s - self.middle_s
        at = self.curve.at(self.times_s + setup.offset_s + setup.drift * since)
        to_body = at.rotation.transpose(0, 2, 1)
        to_camera = setup.mount.T @ to_body
        body = np.einsum("nij,nj->ni", to_body, setup.dock_m - at.position_m)
        place = (body - setup.lever_m) @ setup.mount
        normal = to_camera @ setup.normal
        slopes, less = angle_slopes(normal), np.exp(-setup.log_scale)
        off = np.concatenate([less * place - self.positions_m, angles(normal) - self.angles_rad], axis=2)
        off[..., 3:] = (off[..., 3:] + np.pi) % (2 * np.pi) - np.pi
        by = np.zeros((len(since), 6, SIZE))
        flow = -np.cross(at.turn_rad_per_s, body) - np.einsum("nij,nj->ni", to_body, at.velocity_m_per_s)
        by[:, :3, OFFSET] = flow @ setup.mount
        by[:, 3:, OFFSET] = -np.cross(at.turn_rad_per_s, to_body @ setup.normal) @ setup.mount
        by[:, :, DRIFT] = by[:, :, OFFSET] * since[:, None]
        by[:, :3, TURN], by[:, 3:, TURN] = cross(place), cross(normal)
        by[:, :3, LEVER], by[:, :3, PLACE] = -setup.mount.T, to_camera
        by[:, 3:, NORMAL] = to_camera @ setup.basis
        by[:, :3, SCALE] = -place
        by[:, :3] *= less
        slopes_off = np.concatenate([by[:, :3], slopes @ by[:, 3:]], axis=1)
        by_turn = np.concatenate([less * cross(place + setup.lever_m @ setup.mount), slopes @ cross(normal)], axis=1)
        noise = self.curve.turn_sigma_rad**2 * by_turn @ by_turn.transpose(0, 2, 1)
        noise[:, range(3), range(3)] += (less * self.curve.position_sigma_m) ** 2
        known = at.is_measured & np.isfinite(self.positions_m[0]).all(axis=1)
        root = np.linalg.cholesky(np.where(known[:, None, None], self.covariances + noise, np.eye(5)))
        off = np.where(known[:, None], off, np.nan)
        white = np.linalg.solve(root, np.moveaxis(off, 0, 2))
        return Compared(place, normal, off, slopes_off, noise, root, white, at.is_measured)


@dataclass(frozen=True)
class Compared:
    """Results less truth; NaN where either is missing."""

    places_m: np.ndarray  # (N, 3): of the dock in the camera, by the trajectory
    normals: np.ndarray  # (N, 3)
    off: np.ndarray  # (2, N, 5): true less estimated, of both candidates
    slopes: np.ndarray  # (N, 5, 14): of these, by the setup
    noise: np.ndarray  # (N, 5, 5): covariance of what the trajectory is off
    root: np.ndarray  # (N, 5, 5): of the covariance of all
    white: np.ndarray  # (N, 5, 2): the same in standard deviations
    is_measured: np.ndarray  # (N,)

    @property
    def squares(self) -> np.ndarray:
        """Squared lengths (N, 2) in standard deviations, of both candidates."""
        return (self.white**2).sum(axis=1)

    def clock_residuals_s(self) -> np.ndarray:
        """By which time (N,) each frame alone is off; NaN where it cannot tell it to a twentieth of a second."""
        by = np.linalg.solve(self.root, self.slopes[:, :, OFFSET, None])[:, :, 0]
        off = np.take_along_axis(self.white, self.squares.argmin(axis=1)[:, None, None], axis=2)[:, :, 0]
        strength = (by**2).sum(axis=1)
        return np.where(strength > 400, -(by * off).sum(axis=1) / np.maximum(strength, 1e-12), np.nan)
