"""One of the two hypotheses about a dock, filtered over time: its pose, its motion, and where it will be."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose
from dockpose.pose.shared import SharedErrors
from dockpose.pose.uncertainty import PoseErrors, cross
from dockpose.settings import Settings

# How the vehicle moved: travel (3,) in metres in the camera's old frame, and the rotation (3, 3) whose columns are the
# camera's new axes in its old frame, as dockpose.simulate.sequence.steer() returns them.
Command = tuple[np.ndarray, np.ndarray]

MEMORY_S = 1.0  # a vehicle keeps its speed for about this long
_BOUND = 3.0  # the top speed, in standard deviations of the speeds that occur
_CURRENTS = 0.2  # of the speeds that occur: what remains random where the motion is known
# Errors that the scatter of the lights does not show, such as lights slightly out of place.
_LEAST_SIGMA_RAD, _LEAST_SIGMA_SHARE = math.radians(0.2), 1e-3
# Of a pose that comes without standard errors.
_UNKNOWN_SIGMA_RAD, _UNKNOWN_SIGMA_SHARE = math.radians(5.0), 0.03


@dataclass(frozen=True)
class Chain:
    """A dock's position and normal, each number filtered with a rate (Singer's model, Bar-Shalom et al. 2001)."""

    state: np.ndarray  # (6,): position in metres, and normal
    rates: np.ndarray  # (6,): their change per second
    variances: np.ndarray  # (3, 6): variance of the state, covariance of state and rate, and variance of the rates

    @classmethod
    def begin(cls, pose: CirclePose, settings: Settings) -> Chain:
        """Start from a pose, with unknown speed."""
        state = np.concatenate([pose.position_m, pose.normal])
        rates = speed_sigmas(state, settings) ** 2
        return cls(state, np.zeros(6), np.array([_errors(pose) ** 2, np.zeros(6), rates]))

    @property
    def position_m(self) -> np.ndarray:
        """(3,) the dock's centre."""
        return self.state[:3]

    @property
    def normal(self) -> np.ndarray:
        """(3,) the dock's normal, of unit length."""
        return self.state[3:]

    def predict(self, time_s: float, settings: Settings, command: Command | None = None) -> Chain:
        """Predict the state some time later."""
        state, rates = self.state, self.rates
        sigmas = speed_sigmas(state, settings) * (1.0 if command is None else _CURRENTS)
        if command is not None:
            travel, turn = command
            state = np.concatenate([(state[:3] - travel) @ turn, state[3:] @ turn])
            rates = np.concatenate([rates[:3] @ turn, rates[3:] @ turn])
        kept = math.exp(-time_s / MEMORY_S)
        moved = MEMORY_S * (1 - kept)
        value, both, rate = self.variances
        rate = np.minimum(rate, sigmas**2)
        added = sigmas**2 * (1 - kept**2)
        variances = (
            value + 2 * moved * both + moved**2 * rate + added * time_s**2 / 3,
            kept * (both + moved * rate) + added * time_s / 2,
            kept**2 * rate + added,
        )
        return Chain(_with_unit_normal(state + moved * rates), kept * rates, np.array(variances))

    def pose(self, camera: Camera, dock: Dock) -> CirclePose:
        """The state as a pose with its standard errors, without correlations of position and attitude.

        What all pictures share is no part of the filter's noise, for it does not average out; it comes on top.
        """
        nx, _, nz = self.normal.tolist()
        variances = self.variances[0]
        level2 = max(nx * nx + nz * nz, 1e-12)
        sigma_theta_y = math.sqrt(nz * nz * variances[3] + nx * nx * variances[5]) / level2
        sigma_x, sigma_y, sigma_z = np.sqrt(variances[:3]).tolist()
        pose = CirclePose.at(
            self.position_m,
            self.normal,
            camera,
            sigma_position_m=(sigma_x, sigma_y, sigma_z),
            sigma_theta_rad=(min(math.pi, math.sqrt(variances[4] / level2)), min(math.pi, sigma_theta_y)),
        )
        # A small rotation w moves the normal n by w x n, so that n x (w x n) is the part of w that shows.
        rotation = pose.rotation
        shows = rotation.T @ cross(self.normal[None])[0]
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = np.diag(variances[:3])
        covariance[3:, 3:] = shows * variances[3:] @ shows.T
        return replace(
            pose, errors=PoseErrors(covariance, rotation, shared=SharedErrors(camera, dock, self.position_m))
        )

    def innovation(self, pose: CirclePose) -> tuple[float, float]:
        """Squared angle of a pose's normal from the predicted one, and its expected variance along each axis."""
        apart = self.normal - pose.normal
        return float(apart @ apart), float(self.variances[0, 3:].mean()) + _normal_error(pose) ** 2

    def update(self, pose: CirclePose) -> Chain:
        """Update with the pose that is measured now."""
        value, both, rate = self.variances
        spread = value + _errors(pose) ** 2
        gain, rate_gain = value / spread, both / spread
        innovation = np.concatenate([pose.position_m, pose.normal]) - self.state
        variances = np.array([value - gain * value, both - gain * both, rate - rate_gain * both])
        return Chain(_with_unit_normal(self.state + gain * innovation), self.rates + rate_gain * innovation, variances)


def reach_m(settings: Settings, distance_m: float, time_s: float) -> float:
    """How far a dock at that distance can move in the camera frame, at the vehicle's top speeds."""
    return (settings.max_speed_m_per_s + math.radians(settings.max_turn_deg_per_s) * distance_m) * time_s


def speed_sigmas(state: np.ndarray, settings: Settings) -> np.ndarray:
    """Standard deviations (6,) of the rates; a rotation of the camera moves a distant dock farther than a near one."""
    distance, turn = math.hypot(*state[:3].tolist()), math.radians(settings.max_turn_deg_per_s)
    return np.repeat([math.hypot(settings.max_speed_m_per_s, turn * distance), turn], 3) / _BOUND


def _errors(pose: CirclePose) -> np.ndarray:
    """Standard deviations (6,) of a measured position and normal."""
    distance = math.hypot(*pose.position_m.tolist())
    if pose.sigma_position_m is None or pose.sigma_theta_rad is None:
        return np.array([_UNKNOWN_SIGMA_SHARE * distance] * 3 + [_UNKNOWN_SIGMA_RAD] * 3)
    position = [math.hypot(sigma, _LEAST_SIGMA_SHARE * distance) for sigma in pose.sigma_position_m]
    return np.array(position + [_normal_error(pose)] * 3)


def _normal_error(pose: CirclePose) -> float:
    """Standard deviation of a measured normal."""
    if pose.sigma_theta_rad is None:
        return _UNKNOWN_SIGMA_RAD
    return math.hypot(max(pose.sigma_theta_rad), _LEAST_SIGMA_RAD)


def _with_unit_normal(state: np.ndarray) -> np.ndarray:
    """A state (6,) whose normal has unit length."""
    normal = state[3:]
    return np.concatenate([state[:3], normal / math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)])
