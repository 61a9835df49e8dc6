"""The number of a dock's lights where nobody told it: one more unknown, with a probability of its own."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.choice import Choice
from dockpose.pose.uncertainty import WORTH_OF_EVIDENCE, log_evidence

# How often a lamp that a dock has is not seen: burnt out, turned away or hidden. Numbers of which fewer than a third of
# the lights would be seen are not tried.
_UNSEEN, _MOST_TIMES = 0.15, 3
OTHERS = 0.05  # other things, per dock, that are as evenly spaced, of whose places any share is filled
_EVEN_WITHIN = 0.2  # of the spacing, root mean square: lights that are less even tell no number


def choose_with_number(
    choose: Callable[[Dock], Choice | None], count: int, camera: Camera, dock: Dock
) -> Choice | None:
    """The choice by the likeliest number of lights of which so many are seen, its probabilities summed over numbers.

    Each number is as likely as the lights' squares make it, and the less likely the more of its lights are missing;
    None where they are spaced as those of none.
    """
    choices, logs = [], []
    for number in range(count, _MOST_TIMES * count + 1):
        one = choose(dock.with_lights(number))
        if one is None:
            continue
        pose = one.candidates[0]
        step_px = 2 * math.pi / number * camera.fx * dock.radius / pose.position_m[2]
        if (pose.rms_px or 0.0) > _EVEN_WITHIN * step_px:
            continue
        squares_px2 = count * np.array([pose.rms_px or 0.0 for pose in one.candidates]) ** 2
        evidence = WORTH_OF_EVIDENCE * log_evidence(squares_px2, 2 * count - 6)
        choices.append(replace(one, number=number))
        logs.append(float(np.logaddexp.reduce(evidence)) + (number - count) * math.log(_UNSEEN))
    if not choices:
        return None
    weights = np.exp(np.array(logs) - max(logs))
    reference = choices[int(np.argmax(weights))].candidates[0].normal
    # Refined by another number a pose stays itself: that of the two which is nearer.
    is_same = np.array([one.candidates[0].normal @ reference > one.candidates[1].normal @ reference for one in choices])
    own = np.array([one.candidates[0].probability or 0.0 for one in choices])
    ours = float(weights @ np.where(is_same, own, 1 - own) / weights.sum())
    winners = weights * (is_same if ours >= 0.5 else ~is_same)
    return choices[int(np.argmax(winners))].with_first(max(ours, 1 - ours))


def odds_of_lit(lit: int, number: int) -> float:
    """How likely so many of a dock's lights are seen, over any other number of them.

    The share that is not seen is about ``_UNSEEN`` and differs between docks: a beta-binomial distribution, whose other
    parameter is 1 (Gelman et al. 2013, appendix A).
    """
    b = 1 / _UNSEEN - 1
    logs = math.lgamma(number + 2) - math.lgamma(lit + 1) + math.lgamma(lit + b) - math.lgamma(number + b + 1)
    return b * math.exp(logs)
