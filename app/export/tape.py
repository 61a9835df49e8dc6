"""What a session's measured values tell of dock, camera and tape: the differences, in words, and corrected files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.experiment import Row, SessionRecord
from dockpose.app.export.parts import sentences
from dockpose.camera.sigma import CameraSigma, errors_of
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.pose.tape import TAPE_M, Place, TapeFit, fit_tape
from dockpose.pose.uncertainty import diameter_share
from scipy.spatial.transform import Rotation

_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Checked:
    """A session's rows with a pose, what a tape's values make of them, and the last one's camera and dock."""

    rows: Sequence[Row]
    fit: TapeFit
    camera: Camera
    dock: Dock

    @cached_property
    def angles_off_deg(self) -> np.ndarray:
        """Pitch and yaw in the tank less those measured, in degrees (N, 2); nan where they were not."""
        return np.array([_angles_off(row, self.fit) for row in self.rows])

    @property
    def allowed(self) -> float:
        """Share by which camera and dock file let ranges be off, as a standard error."""
        names, errors = errors_of(self.camera)
        at = names.index("fx") if "fx" in names else None
        focal = 0.0 if at is None else math.sqrt(errors[at, at]) / self.camera.fx
        return math.hypot(focal, diameter_share(self.dock))

    @property
    def contradicts(self) -> bool:
        """Whether ranges are off by more than camera and dock file allow."""
        return self.fit.is_sure(self.fit.scale - 1, math.hypot(self.allowed, self.fit.scale_sigma))

    @property
    def corrected_dock(self) -> Dock:
        """The dock with the diameter that the tape leads to."""
        diameter_m, sigma_m = self.fit.scale * self.dock.diameter, self.fit.scale_sigma * self.dock.diameter
        return msgspec.structs.replace(self.dock, diameter=diameter_m, diameter_sigma_m=sigma_m)

    @property
    def corrected_camera(self) -> Camera:
        """The camera with the focal lengths that the tape leads to."""
        fx, fy = self.camera.fx, self.camera.fy
        known = self.camera.sigma or CameraSigma()
        sigma = msgspec.structs.replace(known, fx=self.fit.scale_sigma * fx, fy=self.fit.scale_sigma * fy)
        scale = self.fit.scale
        return msgspec.structs.replace(self.camera, fx=scale * fx, fy=scale * fy, sigma=sigma, covariance=())

    @property
    def told(self) -> list[str]:
        """What the differences mean, the gravest first."""
        fit, slipped = self.fit, []
        for index in fit.slipped:
            off, sigma = np.abs(fit.residuals_m[index]), fit.sigmas_m[index]
            worst = int(np.nanargmax(off / sigma))
            slipped.append((self.rows[index].number, 100 * off[worst], off[worst] / sigma[worst]))
        turns = zip(_AXES, np.degrees(fit.turn_rad), np.degrees(fit.turn_sigma_rad), strict=True)
        return sentences("check.txt", "told", self, slipped, [turn for turn in turns if fit.is_sure(*turn[1:])])


def check_session(record: SessionRecord, tape_m: float = TAPE_M) -> Checked:
    """Compare a session's poses with its measured values; UserError where too few rows have both."""
    rows = [row for row in record.rows if row.z_cm is not None]
    try:
        fit = fit_tape([_place(row) for row in rows], tape_m)
    except ValueError as error:
        raise UserError(f"{record.folder}: {error}") from error
    line = record.line(rows[-1])
    return Checked(rows, fit, msgspec.convert(line["camera"], Camera), msgspec.convert(line["dock"], Dock))


def _place(row: Row) -> Place:
    """A row in metres; nan for what was not measured."""

    def metres(*names: str) -> np.ndarray:
        return np.array([math.nan if (cm := getattr(row, name)) is None else cm / 100 for name in names])

    sigmas = np.nan_to_num(metres(*(f"sigma_{axis}_cm" for axis in _AXES)))
    measured = metres(*(f"measured_{axis}_cm" for axis in _AXES))
    return Place(metres(*(f"{axis}_cm" for axis in _AXES)), sigmas, measured, float(metres("distance_cm")[0]))


def _angles_off(row: Row, fit: TapeFit) -> tuple[float, float]:
    assert row.theta_x_deg is not None
    assert row.theta_y_deg is not None
    normal = -rotation_from_angles(math.radians(row.theta_x_deg), math.radians(row.theta_y_deg))[:, 2]
    found = np.degrees(angles_of(Rotation.from_rotvec(fit.turn_rad).apply(normal)))
    true = (row.measured_theta_x_deg, row.measured_theta_y_deg)
    off = [
        math.nan if angle is None else math.remainder(one - angle, 360) for one, angle in zip(found, true, strict=True)
    ]
    return off[0], off[1]
