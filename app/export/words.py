"""What was found, in the words that are always in view, and what to try where nothing was."""

from __future__ import annotations

import math

from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.thresholds import LEVELS

_SHORT_NAMES = {"hats": "HATS", "hats_local": "HATS local"}
_ADVICE = {
    "no_lights": "Try a lower level or a smaller minimum area, and see that no mask covers the dock.",
    "too_few_markers": "Try a lower level, a smaller minimum area, or the method HATS light by light.",
    "not_a_ring": "Try another method (tab Compare), a mask over text and lamps, or check the number of lights.",
    "no_ellipse": "Try another level, a mask over whatever is no light, or check the number of lights.",
}
_WHY = {
    "spacing": "On its ring the lights are the more evenly spaced, as they are on the dock.",
    "colours": "On its ring the colours of the lights come in the dock's order.",
    "none": "The lights do not tell which of the two is right; this one comes first by chance.",
    "tracking": "The frames before it speak for it (tab Sequence).",
    "hand": "You chose it by hand.",
}
_BY = {"hand": " (by hand)", "tracking": " (tracked)"}
_LEAST_SIGMA_M = 0.001


def short_method(method: str) -> str:
    """Name of a threshold method where space is scarce."""
    return _SHORT_NAMES.get(method, method.capitalize())


def status_line(found: Estimate) -> str:
    """Lights, level, pose and time in one line, and where there is no pose why, and what to try.

    As in: 10 lights | HATS level 206 | pose A 97 %, 1.453 m ± 0.004 | 1.3 ms.
    """
    lights = found.lights_on_ring or 0
    parts = [f"{lights} light{'' if lights == 1 else 's'}"]
    if found.threshold is not None:
        level = f"level {found.threshold.level}" if found.threshold.level < LEVELS else "no level"
        parts.append(f"{short_method(found.threshold.method)} {level}")
    parts.append(_pose_words(found))
    parts.append(f"{found.elapsed_ms:.1f} ms")
    if advice(found):
        parts.append(advice(found))
    return " | ".join(parts)


def advice(found: Estimate) -> str:
    """What to try next; empty where a dock was found."""
    return _ADVICE.get(found.status, "")


def why_this_one(found: Estimate) -> str:
    """Why the chosen pose and not the other one."""
    choice = found.choice
    if choice is None:
        return "There is no pose to choose."
    if choice.coincide and choice.selected_by != "hand":
        return "The dock is seen square on: both poses are the same within their errors."
    name, probability = POSE_NAMES[choice.selected], choice.candidates[choice.selected].probability
    words = f"Pose {name} was chosen. {_WHY.get(choice.selected_by, '')}"
    if probability is None or choice.selected_by in ("none", "tracking"):
        return words
    sure = "that counts as decided" if choice.decided else "below 95 %, so take it as undecided"
    return f"{words} It is right with a probability of {100 * probability:.1f} %: {sure}."


def _pose_words(found: Estimate) -> str:
    pose = found.selected
    if pose is None or found.choice is None:
        return f"no pose ({found.status.replace('_', ' ')})"
    chance = "" if pose.probability is None else f" {100 * pose.probability:.0f} %"
    distance = f"{pose.position_m[2]:.3f} m"
    if pose.sigma_position_m is not None and math.isfinite(pose.sigma_position_m[2]):
        sigma_m = pose.sigma_position_m[2]
        distance += f" ± {sigma_m:.3f}" if sigma_m >= _LEAST_SIGMA_M else f" ± < {_LEAST_SIGMA_M}"
    if found.choice.selected_by == "tracking":
        chance = ""  # that of the frame alone, against which the frames before decided
    by = _BY.get(found.choice.selected_by, "")
    return f"pose {POSE_NAMES[found.choice.selected]}{by}{chance}, {distance}"
