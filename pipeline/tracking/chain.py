"""One of the two hypotheses about a dock, followed over time: where its pose was, how it moves, where it will be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings

# How the dock moved as the camera sees it: travel (3,) in metres, and the turn (3, 3) whose columns are the camera's
# new axes in its old frame; as dockpose.simulate.sequence.steer() returns it.
Command = tuple[np.ndarray, np.ndarray]

MEMORY_S = 1.0  # a vehicle keeps its speed about so long
_BOUND = 3.0  # the fastest is so many standard deviations of the speeds that occur
_CURRENTS = 0.2  # of the speeds that occur: what is left to chance where the motion is known
# What the lights' scatter does not tell, as lights that stand a little off their place.
_LEAST_SIGMA_RAD, _LEAST_SIGMA_SHARE = math.radians(0.2), 1e-3
_UNKNOWN_SIGMA_RAD, _UNKNOWN_SIGMA_SHARE = math.radians(5.0), 0.03


@dataclass(frozen=True)
class Speeds:
    """What the vehicle can do: the fastest that it moves and turns, per second."""

    metres: float
    radians: float

    @classmethod
    def of(cls, settings: Settings) -> Speeds:
        """The speeds that the settings allow."""
        return cls(settings.max_speed_m_per_s, math.radians(settings.max_turn_deg_per_s))

    def reach_m(self, distance_m: float, time_s: float) -> float:
        """How far a dock at that distance can come in the camera's frame."""
        return (self.metres + self.radians * distance_m) * time_s


@dataclass(frozen=True)
class Chain:
    """Position and normal (6,) of a dock, their rates of change, and the covariance of each with its rate.

    Attributes
    ----------
    state, rates : (6,) position in metres and normal, and how they change in a second.
    variances : (3, 6) of the state, of state and rate together, and of the rates.

    Notes
    -----
    A Kalman filter for each of the six numbers by itself. Their rates are Ornstein-Uhlenbeck processes, of a vehicle
    that keeps its speed for a while and never far exceeds what it can do (Bar-Shalom, Li and Kirubarajan, Estimation
    with Applications to Tracking and Navigation, 8.2: Singer's model, there for accelerations).
    """

    state: np.ndarray
    rates: np.ndarray
    variances: np.ndarray

    @classmethod
    def begin(cls, pose: CirclePose, speeds: Speeds) -> Chain:
        """Start from a pose at an unknown speed."""
        state = np.concatenate([pose.position_m, pose.normal])
        rates = _speed_sigmas(state, speeds) ** 2
        return cls(state, np.zeros(6), np.array([_errors(pose) ** 2, np.zeros(6), rates]))

    @property
    def position_m(self) -> np.ndarray:
        """(3,) the dock's centre."""
        return self.state[:3]

    @property
    def normal(self) -> np.ndarray:
        """(3,) the dock's normal, of unit length."""
        return self.state[3:]

    def after(self, time_s: float, speeds: Speeds, command: Command | None = None) -> Chain:
        """Predict where the dock is after some time; rates are those that the command, if there is one, leaves."""
        state, rates = self.state, self.rates
        sigmas = _speed_sigmas(state, speeds) * (1.0 if command is None else _CURRENTS)
        if command is not None:
            travel, turn = command
            state = np.concatenate([(state[:3] - travel) @ turn, state[3:] @ turn])
            rates = np.concatenate([rates[:3] @ turn, rates[3:] @ turn])
        kept = math.exp(-time_s / MEMORY_S)
        moved = MEMORY_S * (1 - kept)
        value, both, rate = self.variances
        rate = np.minimum(rate, sigmas**2)
        added = sigmas**2 * (1 - kept**2)
        variances = np.array(
            [
                value + 2 * moved * both + moved**2 * rate + added * time_s**2 / 3,
                kept * (both + moved * rate) + added * time_s / 2,
                kept**2 * rate + added,
            ]
        )
        return Chain(_with_unit_normal(state + moved * rates), kept * rates, variances)

    def off(self, pose: CirclePose) -> tuple[float, float]:
        """Squared angle between a pose's normal and this one, and the variance that it should have along each way."""
        apart = self.normal - pose.normal
        return float(apart @ apart), float(self.variances[0, 3:].mean()) + _normal_error(pose) ** 2

    def seen_as(self, pose: CirclePose) -> Chain:
        """Move towards the pose in which the dock is seen now."""
        value, both, rate = self.variances
        measured = np.concatenate([pose.position_m, pose.normal])
        spread = value + _errors(pose) ** 2
        gain, rate_gain = value / spread, both / spread
        innovation = measured - self.state
        variances = np.array([value - gain * value, both - gain * both, rate - rate_gain * both])
        state = _with_unit_normal(self.state + gain * innovation)
        return Chain(state, self.rates + rate_gain * innovation, variances)


def _speed_sigmas(state: np.ndarray, speeds: Speeds) -> np.ndarray:
    """Standard deviations (6,) of the rates: a turn of the camera carries a dock farther the farther away it is."""
    distance = math.hypot(*state[:3].tolist())
    position = math.hypot(speeds.metres, speeds.radians * distance) / _BOUND
    return np.array([position] * 3 + [speeds.radians / _BOUND] * 3)


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
    return np.concatenate([state[:3], state[3:] / math.hypot(*state[3:].tolist())])
