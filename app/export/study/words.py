"""What the study says, in sentences made from its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dockpose.app.export.parts import listed
from dockpose.study.methods import HATS, METHODS, PRODUCT, RIVALS

_TRUSTED = 0.9  # of the poses reported, from which on a range counts as one where they can be relied on
# How the judgement goes where the interval is above zero, below it, or holds it.
_BETTER, _WORSE, _OPEN = "better", "worse", "open"


def claim_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether HATS's claim against its rivals stands, in sentences."""
    result = summary["methods"][HATS]
    sentences = [
        f"On {summary['docks']} scenes with a dock, HATS gives the right pose in {_share(result['success'])}, and "
        f"{METHODS[PRODUCT].title}, the program's default, in {_share(summary['methods'][PRODUCT]['success'])}."
    ]
    for first in (HATS, PRODUCT):
        against = summary["against"][first]
        name = METHODS[first].title
        sorts: dict[str, list[str]] = {_BETTER: [], _WORSE: [], _OPEN: []}
        for rival in RIVALS:
            sorts[verdict(against[rival])].append(f"{METHODS[rival].title} ({_points(against[rival])})")
        words = {
            _BETTER: f"the claim of {name} stands against",
            _WORSE: f"{name} falls behind",
            _OPEN: f"these scenes cannot tell {name} from",
        }
        parts = [f"{words[sort]} {listed(names)}" for sort, names in sorts.items() if names]
        sentences.append(_sentence("; ".join(parts)))
    return sentences


def factor_text(summary: Mapping[str, Any]) -> list[str]:
    """For each rival, where HATS is better or worse than it by more than chance."""
    sentences = []
    for rival in RIVALS:
        parts = []
        for sort in (_BETTER, _WORSE):
            found = []
            for factor in summary["factors"].values():
                differences = zip(factor["bins"], factor["against"][rival], strict=True)
                bins = [name for name, difference in differences if verdict(difference) == sort]
                if len(bins) == len(factor["bins"]):
                    found.append(f"{factor['title']} throughout")
                elif bins:
                    found.append(f"{factor['title']} {listed(bins)}")
            if found:
                parts.append(f"{sort} at {', '.join(found)}")
        name = METHODS[rival].title
        sentences.append(f"Against {name}, HATS is {'; and '.join(parts) or 'nowhere better or worse beyond chance'}.")
    compared = sum(len(factor["bins"]) for factor in summary["factors"].values())
    sentences.append(
        f"Each rival is compared in {compared} bins; of as many without any difference, about "
        f"{0.05 * compared:.0f} would seem to differ by chance."
    )
    return sentences


def verdict(difference: Mapping[str, Any]) -> str:
    """Whether the first method is better, worse, or neither with 95 % confidence."""
    if difference["value"] is None:
        return _OPEN
    return _BETTER if difference["low"] > 0 else _WORSE if difference["high"] < 0 else _OPEN


def calibration_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether probabilities and intervals hold."""
    sentences = []
    events = {"probability": "of the chosen pose", "detection": "that it is a dock"}
    for key, of in events.items():
        rows = [row for row in summary["calibration"][key] if row["came"]["count"]]
        off = [row for row in rows if not row["came"]["low"] <= row["told"] <= row["came"]["high"]]
        held = f"{len(rows) - len(off)} of {len(rows)} bins"
        text = f"The probability {of} is within the interval of what came true in {held}"
        if off:
            cases = [
                f"{row['bin']} (given {_percent(row['told'])}, came {_percent(row['came']['value'])})" for row in off
            ]
            text += f", but not at {listed(cases)}"
        sentences.append(text + ".")
    for name, of in (("all", "all poses of the dock"), ("nearer", "those where the nearer of the two was chosen")):
        shares = [f"{key} {_share(share)}" for key, share in summary["coverage"][name].items()]
        sentences.append(f"The 95 % intervals hold the truth, of {of}: {', '.join(shares)}.")
    return [*sentences, *_bias_text(summary)]


def _bias_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether the range comes out too long or too short, and what that does to its intervals."""
    too_far = summary["methods"][PRODUCT]["too_far"]
    if too_far["value"] is None or too_far["low"] <= 0.5 <= too_far["high"]:
        return [f"The range is too long in {_share(too_far)} of the poses of the dock, as often as not."]
    lamps = summary["factors"]["lamp_spacings"]
    results = zip(lamps["bins"], lamps["methods"][PRODUCT], strict=True)
    held = [f"{label}: {_share(one['z_in_95'])}" for label, one in results if one["z_in_95"]["count"]]
    pull = "towards the ring's middle, where the glow of the other lamps and vignetting pull them"
    way = pull if too_far["value"] > 0.5 else "away from the ring's middle"
    return [
        f"The range is too long in {_share(too_far)} of the poses of the dock: the centres that are measured lie off "
        f"those of the lamps {way}. An error that all lights share leaves no residuals, of which the "
        "standard errors are computed, so that the intervals do not have it in them.",
        f"The interval of z holds, by {lamps['title']}: {'; '.join(held)}.",
    ]


def advice_text(summary: Mapping[str, Any]) -> list[str]:
    """Which method when, and how far to trust the pose at which range."""
    methods = summary["methods"]
    order = sorted(METHODS, key=lambda label: -(methods[label]["success"]["value"] or 0))
    best = order[0]
    others = [label for label in (PRODUCT, HATS) if label != best]
    own = (
        "HATS + local, the program's default, first tries one level for all lights, and where that shows no ring, one "
    )
    sentences = [
        own + "for each light; HATS tries the one level only.",
        f"{METHODS[best].title} finds the right pose most often, in {_share(methods[best]['success'])} of the docks; "
        + ", ".join(f"{METHODS[label].title} in {_share(methods[label]['success'])}" for label in others)
        + ".",
        _sentence(_exceptions(summary)),
        f"What the program reports is a dock and its right pose in {_share(methods[PRODUCT]['right_of_reported'])} of "
        f"the docks it reports; in scenes without one it reports a dock in "
        f"{_share(methods[PRODUCT]['false_dock_without'])}.",
        *_widen_text(summary),
        *(_reach(summary, name) for name in ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share")),
    ]
    return sentences


def _widen_text(summary: Mapping[str, Any]) -> list[str]:
    """By how much too narrow the intervals are."""
    known = {key: value for key, value in summary["widen"].items() if value is not None}
    if not known:
        return []
    held = [f"{key} {_percent(summary['coverage']['all'][key]['value'])}" for key in known]
    factors = [f"{value:.1f} for {key}" for key, value in known.items()]
    return [
        f"Its 95 % intervals hold the truth of {listed(held)}; to hold 95 %, their widths would have to be "
        f"multiplied by {listed(factors)}."
    ]


def _exceptions(summary: Mapping[str, Any]) -> str:
    """Where another method does better than the program's by more than both intervals."""
    found = []
    for factor in summary["factors"].values():
        for number, name in enumerate(factor["bins"]):
            own = factor["methods"][PRODUCT][number]["success"]
            others = [label for label in METHODS if label != PRODUCT]
            better = [label for label in others if _above(factor["methods"][label][number]["success"], own)]
            if better:
                found.append(f"{listed([METHODS[label].title for label in better])} at {factor['title']} {name}")
    if not found:
        return f"nowhere does another method do better than {METHODS[PRODUCT].title} beyond the intervals of both"
    return f"better than {METHODS[PRODUCT].title}, beyond the intervals of both, are only: {'; '.join(found)}"


def _above(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return one["value"] is not None and other["value"] is not None and one["low"] > other["high"]


def _reach(summary: Mapping[str, Any], name: str) -> str:
    """In which bins of a factor reported poses can be relied on."""
    factor = summary["factors"][name]
    results = [one["right_of_reported"] for one in factor["methods"][PRODUCT]]
    known = [(label, share) for label, share in zip(factor["bins"], results, strict=True) if share["value"] is not None]
    trusted = [label for label, share in known if share["value"] >= _TRUSTED]
    doubtful = [f"{label} ({_share(share)})" for label, share in known if share["value"] < _TRUSTED]
    where = "everywhere" if not doubtful else f"at {listed(trusted)}" if trusted else "nowhere"
    text = f"By {factor['title']}, at least {_percent(_TRUSTED)} of the reported poses are right {where}"
    return f"{text}; fewer at {listed(doubtful)}." if trusted and doubtful else f"{text}."


def _share(share: Mapping[str, Any]) -> str:
    if share["value"] is None:
        return "none of no cases"
    return f"{100 * share['value']:.1f} % ({100 * share['low']:.1f} to {100 * share['high']:.1f})"


def _points(difference: Mapping[str, Any]) -> str:
    if difference["value"] is None:
        return "no scenes"
    value, low, high = (100 * difference[key] for key in ("value", "low", "high"))
    return f"{value:+.1f} points, {low:+.1f} to {high:+.1f}"


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
