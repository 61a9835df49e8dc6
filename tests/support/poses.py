"""Poses whose errors are given."""

from dataclasses import replace

import numpy as np
from dockpose.pose.circle import CirclePose
from dockpose.pose.uncertainty import PoseErrors


def with_sigmas(pose: CirclePose, sigma_position_m: tuple[float, float, float]) -> CirclePose:
    """The pose with these standard errors of x, y and z in all, and an exact attitude."""
    covariance = np.diag([*np.square(sigma_position_m), 0.0, 0.0, 0.0])
    return replace(pose, sigma_position_m=sigma_position_m, errors=PoseErrors(covariance, pose.rotation))
