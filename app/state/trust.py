"""How far a result can be trusted: green, amber or red, and the reasons."""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES, TRUST_COLOURS
from dockpose.app.drawing.numbers import count, number, percent
from dockpose.lights.ring import tolerance_px
from dockpose.pose.choice import DECIDED

if TYPE_CHECKING:
    from dockpose.tracking.tracker import Tracked

Colour = Literal["green", "amber", "red"]
VERDICTS: dict[Colour, str] = {
    "green": "Dock found",
    "amber": "Dock found, but check it",
    "red": "Dock seen, but do not rely on it",
}
NO_POSE = "No pose"
PREDICTED = "Dock predicted, not measured"
TOSS_UP = 2 / 3  # a pose that is not even twice as likely as the other
# Twice the standard deviation holds the truth 19 times in 20: within a tenth of the range, or not even a fifth.
EXACT_SHARE, ROUGH_SHARE = 0.05, 0.10
STRETCHED = 0.01  # by which fx/fy may differ from that of the camera's file


@dataclass(frozen=True)
class Trust:
    """How far to trust a result."""

    colour: Colour  # use it, check it, or do not use it
    verdict: str  # the same in a few words
    reasons: tuple[str, ...] = ()  # why it is not green, each a sentence

    @property
    def sentence(self) -> str:
        """The verdict and its reasons, in sentences."""
        return " ".join([f"{self.verdict}.", *self.reasons])


def trust_in(
    found: Estimate,
    *,
    assumed: Collection[str] = (),
    probability: float | None = None,
    predicted: bool = False,
    fitting_lights: int | None = None,
    fx_per_fy: tuple[float, float] = (1.0, 1.0),
) -> Trust:
    """Judge how far a result can be trusted; ``assumed`` names what nobody has given, of "camera" and "dock".

    ``fx_per_fy`` is that ratio as it is set, and as the camera was given.
    ``predicted`` says that the track goes on elsewhere than where this frame shows a ring.
    """
    if found.selected is None:
        return Trust("red", NO_POSE, ())
    doubts: list[tuple[Colour, str]] = []
    if predicted:
        doubts.append(("amber", "The ring in this frame does not continue the track: the pose is predicted."))
    if fitting_lights is not None:
        doubts.append(("red", f"{fitting_lights} lights form a ring; the dock is set to {found.dock.lights}."))
    doubts += [*_doubts_about_pose(found, probability), *_doubts_about_range(found), *_doubts_about_ring(found)]
    now, given = fx_per_fy
    if abs(now / given - 1) > STRETCHED:
        doubts.append(("amber", f"fx/fy is {now:.3f}, not {given:.3f} as given: tilts and range are wrong by it."))
    if {"camera", "dock"} <= {*assumed}:
        both = f"The camera's view was assumed, and the diameter: {100 * found.dock.diameter:g} cm."
        doubts.append(("amber", both))
    elif "camera" in assumed:
        doubts.append(("amber", "The camera is not known: its view was assumed."))
    elif "dock" in assumed:
        doubts.append(("amber", f"The dock's diameter is not known: {100 * found.dock.diameter:g} cm was assumed."))
    colour: Colour = "green" if not doubts else "red" if any(one == "red" for one, _ in doubts) else "amber"
    reasons = [reason for wanted in ("red", "amber") for one, reason in doubts if one == wanted]
    return Trust(colour, PREDICTED if predicted else VERDICTS[colour], tuple(reasons))


def trust_of(found: Estimate, tracked: "Tracked | None" = None, **more: Any) -> Trust:
    """Judge a result as :func:`trust_in`, in a sequence with the probability that the track gives to its pose."""
    probability = None if tracked is None or tracked.selected is None else tracked.track.probability
    predicted = tracked is not None and tracked.track.predicted
    return trust_in(found, probability=probability, predicted=predicted, **more)


def headline_of(trust: Trust) -> tuple[str, str]:
    """Return the verdict and its colour, as the annotated picture shows them."""
    return trust.verdict, TRUST_COLOURS[trust.colour]


def _doubts_about_pose(found: Estimate, probability: float | None) -> Iterator[tuple[Colour, str]]:
    choice = found.choice
    assert choice is not None
    name, alone = POSE_NAMES[choice.selected], choice.candidates[choice.selected].probability
    likely = alone if probability is None else probability
    if choice.selected_by == "hand":
        gives = "" if alone is None else f"; the program gives it {percent(alone, 0)} %"
        yield "amber", f"Pose {name} was chosen by hand{gives}."
    elif choice.coincide:
        return
    elif likely is None or (choice.selected_by == "none" and probability is None):
        yield "red", "Nothing tells which of the two poses is right."
    elif likely < TOSS_UP:
        yield "red", f"Pose {name} is only {percent(likely, 0)} % likely: nearly a toss-up between the two."
    elif likely < DECIDED:
        yield "amber", f"Pose {name} is {percent(likely, 0)} % likely, below the {percent(DECIDED, 0)} % of a decision."


def _doubts_about_range(found: Estimate) -> Iterator[tuple[Colour, str]]:
    pose = found.selected
    assert pose is not None
    range_m = math.hypot(*pose.position_m.tolist())
    sigma_m = math.inf if pose.sigma_total_position_m is None else pose.sigma_total_position_m[2]
    if not math.isfinite(sigma_m):
        yield "amber", "How exact the range is cannot be estimated."
    elif sigma_m > EXACT_SHARE * range_m:
        decimals = max(1, math.ceil(-math.log10(sigma_m)))  # never "± 0.0"
        share = f"{number(range_m, decimals)} ± {number(sigma_m, decimals)} m ({percent(sigma_m / range_m, 0)} %)"
        yield "red" if sigma_m > ROUGH_SHARE * range_m else "amber", f"The range is inexact: {share}."


def _doubts_about_ring(found: Estimate) -> Iterator[tuple[Colour, str]]:
    pose, ring, markers = found.selected, found.ring, found.markers
    if pose is None or ring is None or markers is None:
        return
    lights = int(ring.on_ring.sum())
    major_px = 0.0 if found.ellipse is None else found.ellipse.semi_axes_px[0]
    most_px = tolerance_px(major_px)
    if pose.rms_px is not None and pose.rms_px > most_px:
        off = f"{number(pose.rms_px)} px off their places, for {number(most_px)} px in a well-built dock"
        yield "amber", f"The lights lie {off}: run learn-dock, and check the camera."
    if lights <= 3:
        yield "amber", f"{count(lights, 'light')} fit a pose wherever they are, so nothing checks this one."
    if found.detection is not None and found.detection < DECIDED:
        yield "amber", f"That the lights are a dock at all is {percent(found.detection, 0)} % sure."
    if found.detection is None:
        when = "" if found.by_hand is not None else " in an earlier frame"
        yield "amber", f"The lights were set by hand{when}: nothing checks that they are a dock."
    for rival in ring.rivals:
        x, y = markers.points_px[rival].mean(axis=0)
        yield "amber", f"A second ring, of {count(int(rival.sum()), 'light')}, is in view at ({x:.0f}, {y:.0f}) px."
