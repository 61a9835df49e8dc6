"""A stand-in for an autopilot's filter: an error-state Kalman filter of 15 states, by the equations of Sola (2017).

The errors are those of position, velocity, attitude (in the vehicle's axes), and of what gyroscope and accelerometer
are off by. A VISION_POSITION_ESTIMATE is used as ArduPilot's code does: one error of position and one of angles, each
the root of the sum of three variances (GCS_Common.cpp, handle_common_vision_position_estimate_data), held within limits
(AP_VisualOdom_MAV.cpp, handle_pose_estimate: VISO_POS_M_NSE to 100 m, VISO_YAW_M_NSE to 1.5 rad), a yaw error of at
least 5 degrees, and no angles that are not numbers (AP_NavEKF3_Measurements.cpp, writeExtNavData).
"""

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

GRAVITY = np.array([0.0, 0.0, 9.80665])  # z down
POSITION_LEAST_M, YAW_LEAST_RAD = 0.05, 0.05  # VISO_POS_M_NSE and VISO_YAW_M_NSE as docs/vehicle.md has them


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def angle_error(message: Any) -> float:
    """What ArduPilot takes all three angles to be off by, in radians, before it holds it within limits."""
    spread = message.covariance
    return math.sqrt(spread[15] + spread[18] + spread[20])


class Ekf:
    """The filter; ``yaw_rad`` is what it begins with."""

    def __init__(
        self, position_m: np.ndarray, roll_pitch_yaw_rad: tuple[float, float, float], yaw_sigma: float
    ) -> None:
        self.position, self.velocity = np.array(position_m, float), np.zeros(3)
        roll, pitch, yaw = roll_pitch_yaw_rad
        self.rotation = Rotation.from_euler("ZYX", [yaw, pitch, roll])
        self.gyro_off, self.accelerometer_off = np.zeros(3), np.zeros(3)
        tilt, rate = math.radians(2), math.radians(0.5)
        self.spread = np.diag(
            [0.3**2] * 3 + [0.2**2] * 3 + [tilt**2] * 2 + [yaw_sigma**2] + [rate**2] * 3 + [0.1**2] * 3
        )

    @property
    def yaw_pitch_roll(self) -> np.ndarray:
        return self.rotation.as_euler("ZYX")

    def predict(self, gyro: np.ndarray, accelerometer: np.ndarray, step_s: float) -> None:
        turning, force, turned = gyro - self.gyro_off, accelerometer - self.accelerometer_off, self.rotation.as_matrix()
        change = np.eye(15)
        change[:3, 3:6] = step_s * np.eye(3)
        change[3:6, 6:9], change[3:6, 12:15] = -step_s * turned @ skew(force), -step_s * turned
        change[6:9, 6:9] = Rotation.from_rotvec(-step_s * turning).as_matrix()
        change[6:9, 9:12] = -step_s * np.eye(3)
        noise = np.repeat([0.0, 0.05, math.radians(0.2), 1e-5, 1e-4], 3) ** 2 * step_s
        self.spread = change @ self.spread @ change.T + np.diag(noise)
        moved = turned @ force + GRAVITY
        self.position = self.position + step_s * self.velocity + step_s**2 / 2 * moved
        self.velocity = self.velocity + step_s * moved
        self.rotation = self.rotation * Rotation.from_rotvec(step_s * turning)

    def take(self, message: Any) -> None:
        """Use a VISION_POSITION_ESTIMATE as ArduPilot would."""
        spread = message.covariance
        off_m = min(max(math.sqrt(spread[0] + spread[6] + spread[11]), POSITION_LEAST_M), 100.0)
        see = np.zeros((3, 15))
        see[:, :3] = np.eye(3)
        self._fuse(see, np.array([message.x, message.y, message.z]) - self.position, off_m)
        if math.isnan(message.roll + message.pitch + message.yaw):
            return
        off_rad = max(min(max(angle_error(message), YAW_LEAST_RAD), 1.5), math.radians(5))
        yaw, pitch, _ = self.yaw_pitch_roll
        by_turn = np.array([math.tan(pitch) * math.cos(yaw), math.tan(pitch) * math.sin(yaw), 1.0])
        see = np.zeros((1, 15))
        see[0, 6:9] = by_turn @ self.rotation.as_matrix()
        seen = Rotation.from_euler("ZYX", [message.yaw, message.pitch, message.roll]).as_euler("ZYX")[0]
        self._fuse(see, np.array([math.remainder(seen - yaw, math.tau)]), off_rad)

    def _fuse(self, see: np.ndarray, off: np.ndarray, sigma: float) -> None:
        inner = see @ self.spread @ see.T + sigma**2 * np.eye(len(off))
        gain = self.spread @ see.T @ np.linalg.inv(inner)
        kept = np.eye(15) - gain @ see
        self.spread = kept @ self.spread @ kept.T + sigma**2 * gain @ gain.T
        move = gain @ off
        self.position, self.velocity = self.position + move[:3], self.velocity + move[3:6]
        self.rotation = self.rotation * Rotation.from_rotvec(move[6:9])
        self.gyro_off, self.accelerometer_off = self.gyro_off + move[9:12], self.accelerometer_off + move[12:15]
