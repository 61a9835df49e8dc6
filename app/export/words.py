"""Sentences about a result (what was found, why this pose), a calibration, an error budget, and measured values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import dockpose.app.drawing.numbers as numbers
import msgspec
import numpy as np
from dockpose import Camera, Dock, Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import count, number, percent
from dockpose.app.errors import UserError
from dockpose.app.experiment import Row, SessionRecord
from dockpose.app.export.parts import sentences
from dockpose.camera.calibrate import BoardView, Calibration
from dockpose.camera.sigma import errors_of, numbers_of
from dockpose.camera.standard_errors import CameraSigma
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.pose.shared import diameter_share
from dockpose.pose.tape import TAPE_M, Place, TapeFit, fit_tape
from dockpose.study import budget as budgets
from dockpose.study.budget import USUAL_NOISE_PX, Budget
from dockpose.thresholds import METHODS

_ADVICE = {
    "no_lights": "Try a lower level or a smaller minimum area, and check that no mask covers the dock.",
    "too_few_markers": "Try a lower level, a smaller minimum area, or the method HATS light by light.",
    "not_a_ring": "Try another method (tab Compare), a mask over text and lamps, or check the number of lights.",
    "no_ellipse": "Try another level, a mask over everything that is not a light, or check the number of lights.",
    "method_failed": "Mend the threshold method, or choose another.",
}
_WHY = {
    "spacing": "On its ring the lights are more evenly spaced, as they are on the dock.",
    "extra": "By it the dock's extra light is where one is seen.",
    "none": "The lights do not tell which of the two is right; this one is listed first by chance.",
    "tracking": "The earlier frames support it (tab Source).",
    "hand": "You chose it by hand.",
}
_BY = {"hand": " (by hand)", "tracking": " (tracked)"}
MEDIA = ("air", "water")
_AXES = ("x", "y", "z")
_PIXELS, _USUAL = ("fx", "fy", "cx", "cy"), ("k1", "k2", "p1", "p2", "k3")
_SURE_SHARE = 0.01  # of the focal length: a larger standard error is said to be large
TILTS_DEG = (0.0, 10.0, 20.0, 40.0)
_RANGES = 6
_GOOD_SHARE, _SURE = 0.05, 0.95  # of the range, and the chance, from which on the page warns
HEAD = (
    "range (m)",
    "tilt (°)",
    "lights apart (px)",
    "x, y (cm)",
    "range ± (cm)",
    "in all ± (cm)",
    "angles ± (°)",
    "told apart (%)",
)


def status_line(found: Estimate) -> str:
    """Return lights, level, how the pose was chosen, and time, as in 10 lights | HATS level 206 | pose A | 1.3 ms."""
    parts = [count(found.lights_on_ring or 0, "light")]
    if found.threshold is not None:
        parts.append(f"{METHODS[found.threshold.method].label} {numbers.level_words(found.threshold)}")
    if found.choice is not None:
        parts.append(f"pose {POSE_NAMES[found.choice.selected]}{_BY.get(found.choice.selected_by, '')}")
    return " | ".join([*parts, f"{number(found.elapsed_ms)} ms"])


def advice(found: Estimate) -> str:
    """Return what to try next; empty where a dock was found."""
    if found.by_hand is not None and found.status != "ok":
        return "Click more of the dock's lights, or press Search again."
    return _ADVICE.get(found.status, "")


def why_this_one(found: Estimate) -> str:
    """Say why this pose was chosen and not the other."""
    choice = found.choice
    if choice is None:
        return "There is no pose to choose."
    if choice.coincide and choice.selected_by != "hand":
        return "The dock is seen square on: both poses are the same within their errors."
    name, probability = POSE_NAMES[choice.selected], choice.candidates[choice.selected].probability
    words = f"Pose {name} was chosen. {_WHY.get(choice.selected_by, '')}"
    if probability is None or choice.selected_by in ("none", "tracking"):
        return words
    sure = "which counts as decided" if choice.decided else "below 95 %, so treat it as undecided"
    return f"{words} Its probability is {percent(probability)} %, {sure}."


def camera_lines(done: Calibration, medium: str = "air", *, is_on_page: bool = False) -> list[str]:
    """Sentences on a calibration, the most important first."""
    view_deg = tuple(np.degrees(done.camera.field_of_view_rad))
    fixed = [term for term in done.fixed if term in _USUAL]
    freer = [rung for rung in done.rungs if set(rung.lens.terms) & set(fixed) and not rung.lens.fisheye]
    why = fixed, min((rung.held_out_px for rung in freer), default=np.nan)
    words = numbers_in_words(done)
    return sentences("calibration.txt", "camera", done, medium, is_on_page, view_deg, words, _SURE_SHARE, *why)


def numbers_in_words(done: Calibration) -> str:
    """The camera's numbers with their standard errors: "fx 519.70 ± 0.23 px, ..., k1 -0.1801 ± 0.0010"."""
    sigmas = done.sigmas.values
    named = zip(sigmas, numbers_of(done.camera, done.lens.names), sigmas.values(), strict=True)
    return ", ".join(
        f"{name} {number:.2f} ± {sigma:.2f} px" if name in _PIXELS else f"{name} {number:.5f} ± {sigma:.5f}"
        for name, number, sigma in named
    )


def outcome(view: BoardView) -> str:
    """What became of a picture, in words."""
    if view.dropped:
        return f"dropped: {view.dropped}"
    if view.error_px is None:
        return f"{view.corners} corners"
    return f"{view.error_px:.3f} px over {view.corners} corners"


def usual_ranges_m(camera: Camera, dock: Dock) -> list[float]:
    """Ranges from where the dock fills the picture to where its lights run together, to two digits."""
    near, far = budgets.nearest_m(camera, dock), budgets.farthest_apart_m(camera, dock)
    ranges = np.geomspace(near, max(far, 2 * near), _RANGES)
    return [float(f"{range_m:.2g}") for range_m in ranges]


def budget_cells(budget: Budget) -> list[str]:
    """Return the cells of ``HEAD``."""
    apart = f"{budget.apart_px:.0f}" + ("" if budget.lights_apart else " (merge)")
    tilt = f"{budget.tilt_deg:g}" + ("" if budget.in_view else " (not all in view)")
    x, y, z = 100 * budget.sigmas[:3]
    exact = _digits(max(x, y)), _digits(z), _digits(100 * budget.totals[2]), _digits(max(budget.sigmas[3:]))
    return [f"{budget.range_m:g}", tilt, apart, *exact, percent(budget.tells_apart, 0)]


def _digits(value: float) -> str:
    """Two significant digits, and no more than hundredths."""
    return number(value, 0 if value >= 10 else 1 if value >= 1 else 2)


def budget_sentences(camera: Camera, dock: Dock, noise_px: float = USUAL_NOISE_PX) -> list[str]:
    """Say whose budget it is, and up to where the dock's lights, its range and its attitude can be known."""
    apart = budgets.farthest_apart_m(camera, dock)
    good = budgets.farthest_m(camera, dock, 20.0, noise_px, lambda one: one.sigmas[2] / one.range_m - _GOOD_SHARE)
    known = {
        tilt: budgets.farthest_m(camera, dock, tilt, noise_px, lambda one: _SURE - (one.tells_apart or 0.5))
        for tilt in (10.0, 20.0)
    }
    return [
        *sentences("budget.txt", "set_up", camera, dock, numbers.length_words(dock.diameter), noise_px),
        *sentences("budget.txt", "reach", apart, good, _GOOD_SHARE, known, _SURE),
    ]


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
    def is_off(self) -> bool:
        """Whether ranges have an error in common, which a corrected dock or camera takes away."""
        return self.fit.is_sure(self.fit.scale - 1, self.fit.scale_sigma)

    @property
    def contradicts(self) -> bool:
        """Whether ranges are off by more than camera and dock file allow."""
        return self.fit.is_sure(self.fit.scale - 1, math.hypot(self.allowed, self.fit.scale_sigma))

    @property
    def corrected_dock(self) -> Dock:
        """The dock with the diameter that the tape leads to."""
        return scaled_dock(self.dock, self.fit.scale, self.fit.scale_sigma)

    @property
    def corrected_camera(self) -> Camera:
        """The camera with the focal lengths that the tape leads to."""
        return scaled_camera(self.camera, self.fit.scale, self.fit.scale_sigma)

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


def scaled_dock(dock: Dock, scale: float, sigma: float) -> Dock:
    """The dock with a diameter that is right where all lengths have that share of the true ones."""
    return msgspec.structs.replace(dock, diameter=scale * dock.diameter, diameter_sigma_m=sigma * dock.diameter)


def scaled_camera(camera: Camera, scale: float, sigma: float) -> Camera:
    """The camera with focal lengths that are right where all lengths have that share of the true ones."""
    fx, fy, known = camera.fx, camera.fy, camera.sigma or CameraSigma()
    known = msgspec.structs.replace(known, fx=sigma * fx, fy=sigma * fy)
    return msgspec.structs.replace(camera, fx=scale * fx, fy=scale * fy, sigma=known, covariance=())


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
    found = np.degrees(angles_of(cv2.Rodrigues(fit.turn_rad)[0] @ normal))
    true = (row.measured_theta_x_deg, row.measured_theta_y_deg)
    off = [
        math.nan if angle is None else math.remainder(one - angle, 360) for one, angle in zip(found, true, strict=True)
    ]
    return off[0], off[1]
