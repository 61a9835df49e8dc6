"""Sentences about a result (what was found, why this pose, what to try), and about a calibration."""

import math

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import chance, count, level_words, number, percent, sigma_words, status_words
from dockpose.app.export.parts import sentences
from dockpose.camera.calibrate import BoardView, Calibration
from dockpose.camera.fitting import FittedPort
from dockpose.camera.sigma import numbers_of
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
    "colours": "On its ring the lights' colours are in the dock's order.",
    "none": "The lights do not tell which of the two is right; this one is listed first by chance.",
    "tracking": "The earlier frames support it (tab Play).",
    "hand": "You chose it by hand.",
}
_BY = {"hand": " (by hand)", "tracking": " (tracked)"}
MEDIA = ("air", "water")
_PIXELS, _USUAL = ("fx", "fy", "cx", "cy"), ("k1", "k2", "p1", "p2", "k3")
_SURE_SHARE = 0.01  # of the focal length: a larger standard error is said to be large


def status_line(found: Estimate, *, with_sigma: bool = True) -> str:
    """Return lights, level, pose and time, as in 10 lights | HATS level 206 | pose A 97 %, 1.453 m ± 0.004 | 1.3 ms."""
    parts = [count(found.lights_on_ring or 0, "light")]
    if found.threshold is not None:
        parts.append(f"{METHODS.short(found.threshold.method)} {level_words(found.threshold)}")
    parts += [_pose_words(found, with_sigma=with_sigma), f"{number(found.elapsed_ms)} ms"]
    return " | ".join(filter(None, parts))


def advice(found: Estimate) -> str:
    """Return what to try next; empty where a dock was found."""
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


def _pose_words(found: Estimate, *, with_sigma: bool) -> str:
    pose = found.selected
    if pose is None or found.choice is None:
        return f"no pose ({status_words(found.status)})"
    distance = f"{number(pose.position_m[2], 3)} m"
    sigma_m = None if pose.sigma_total_position_m is None else pose.sigma_total_position_m[2]
    if with_sigma and sigma_m is not None and math.isfinite(sigma_m):
        distance += f" ± {sigma_words(sigma_m)}"
    # A tracked pose was chosen against the frame's own probability, which would mislead.
    likely = "" if found.choice.selected_by == "tracking" else chance(pose, " ")
    by = _BY.get(found.choice.selected_by, "")
    return f"pose {POSE_NAMES[found.choice.selected]}{by}{likely}, {distance}"


def camera_lines(done: Calibration, medium: str = "air", *, is_on_page: bool = False) -> list[str]:
    """Sentences on a calibration, the most important first."""
    view_deg, numbers = tuple(np.degrees(done.camera.field_of_view_rad)), numbers_in_words(done)
    fixed = [term for term in done.fixed if term in _USUAL]
    freer = [rung for rung in done.rungs if set(rung.lens.terms) & set(fixed) and not rung.lens.fisheye]
    why = fixed, min((rung.held_out_px for rung in freer), default=np.nan)
    return sentences("calibration.txt", "camera", done, medium, is_on_page, view_deg, numbers, _SURE_SHARE, *why)


def port_lines(found: FittedPort) -> list[str]:
    """Sentences on a port that was fitted, the most important first."""
    return sentences("calibration.txt", "port", found, float(np.sqrt((found.errors_px**2).mean())))


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
