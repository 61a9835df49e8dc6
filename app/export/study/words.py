"""What the study says, in sentences made from its numbers."""

from collections.abc import Mapping
from typing import Any

from dockpose.app.export.parts import listed, words
from dockpose.study.scenes import HATS, METHODS, PRODUCT, RIVALS

_TRUSTED = 0.9  # of the poses reported, from which on a range counts as one where they can be relied on
# How the judgement goes where the interval is above zero, below it, or holds it.
_BETTER, _WORSE, _OPEN = "better", "worse", "open"


def claim_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether HATS's claim against its rivals stands, in sentences."""
    shares = {label: _share(summary["methods"][label]["success"]) for label in (HATS, PRODUCT)}
    product = METHODS[PRODUCT].title
    return [
        words("claim", "success", docks=summary["docks"], hats=shares[HATS], product=product, share=shares[PRODUCT]),
        *(_against(METHODS[first].title, summary["against"][first]) for first in (HATS, PRODUCT)),
    ]


def _against(name: str, against: Mapping[str, Any]) -> str:
    sorts: dict[str, list[str]] = {_BETTER: [], _WORSE: [], _OPEN: []}
    for rival in RIVALS:
        sorts[verdict(against[rival])].append(f"{METHODS[rival].title} ({_points(against[rival])})")
    parts = [f"{words('claim', sort, name=name)} {listed(names)}" for sort, names in sorts.items() if names]
    return _sentence("; ".join(parts))


def factor_text(summary: Mapping[str, Any]) -> list[str]:
    """For each rival, where HATS is better or worse than it by more than chance."""
    sentences = []
    for rival in RIVALS:
        where = {sort: _bins(summary, rival, sort) for sort in (_BETTER, _WORSE)}
        parts = [f"{sort} at {', '.join(found)}" for sort, found in where.items() if found]
        name = METHODS[rival].title
        sentences.append(f"Against {name}, HATS is {'; and '.join(parts) or 'nowhere better or worse beyond chance'}.")
    compared = sum(len(factor["bins"]) for factor in summary["factors"].values())
    return [*sentences, words("claim", "chance", compared=compared, chance=0.05 * compared)]


def _bins(summary: Mapping[str, Any], rival: str, sort: str) -> list[str]:
    """The bins of each factor in which HATS is better, or worse."""
    found = []
    for factor in summary["factors"].values():
        differences = zip(factor["bins"], factor["against"][rival], strict=True)
        bins = [name for name, difference in differences if verdict(difference) == sort]
        if bins:
            found.append(f"{factor['title']} {'throughout' if len(bins) == len(factor['bins']) else listed(bins)}")
    return found


def verdict(difference: Mapping[str, Any]) -> str:
    """Whether the first method is better, worse, or neither with 95 % confidence."""
    if difference["value"] is None:
        return _OPEN
    return _BETTER if difference["low"] > 0 else _WORSE if difference["high"] < 0 else _OPEN


def calibration_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether probabilities and intervals hold."""
    sentences = []
    for key, of in (("probability", "of the chosen pose"), ("detection", "that it is a dock")):
        rows = [row for row in summary["calibration"][key] if row["came"]["count"]]
        off = [row for row in rows if not row["came"]["low"] <= row["told"] <= row["came"]["high"]]
        cases = [f"{row['bin']} (given {_percent(row['told'])}, came {_percent(row['came']['value'])})" for row in off]
        but = f", but not at {listed(cases)}" if cases else ""
        sentences.append(words("calibration", "held", of=of, held=len(rows) - len(off), bins=len(rows), but=but))
    for name, of in (("all", "all poses of the dock"), ("nearer", "those where the nearer of the two was chosen")):
        shares = [f"{key} {_share(share)}" for key, share in summary["coverage"][name].items()]
        sentences.append(f"The 95 % intervals hold the truth, of {of}: {', '.join(shares)}.")
    return [*sentences, *_bias_text(summary)]


def _bias_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether the range comes out too long or too short, and what that does to its intervals."""
    too_far = summary["methods"][PRODUCT]["too_far"]
    if too_far["value"] is None or too_far["low"] <= 0.5 <= too_far["high"]:
        return [words("calibration", "no_bias", share=_share(too_far))]
    lamps = summary["factors"]["lamp_spacings"]
    results = zip(lamps["bins"], lamps["methods"][PRODUCT], strict=True)
    held = [f"{label}: {_share(one['z_in_95'])}" for label, one in results if one["z_in_95"]["count"]]
    return [
        words("calibration", "too_long" if too_far["value"] > 0.5 else "too_short", share=_share(too_far)),
        f"The interval of z holds, by {lamps['title']}: {'; '.join(held)}.",
    ]


def advice_text(summary: Mapping[str, Any]) -> list[str]:
    """Which method when, and how far to trust the pose at which range."""
    methods = summary["methods"]
    best = max(METHODS, key=lambda label: methods[label]["success"]["value"] or 0)
    shares = {label: f"in {_share(methods[label]['success'])}" for label in METHODS}
    others = [f"{METHODS[label].title} {shares[label]}" for label in (PRODUCT, HATS) if label != best]
    product = methods[PRODUCT]
    right, false = _share(product["right_of_reported"]), _share(product["false_dock_without"])
    return [
        words("trust", "methods"),
        words("trust", "best", best=METHODS[best].title, share=shares[best], others=", ".join(others)),
        _sentence(_exceptions(summary)),
        words("trust", "reported", right=right, false=false),
        *_widen_text(summary),
        *(_reach(summary, name) for name in ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share")),
    ]


def _widen_text(summary: Mapping[str, Any]) -> list[str]:
    """By how much too narrow the intervals are."""
    known = {key: value for key, value in summary["widen"].items() if value is not None}
    if not known:
        return []
    held = [f"{key} {_percent(summary['coverage']['all'][key]['value'])}" for key in known]
    factors = [f"{value:.1f} for {key}" for key, value in known.items()]
    return [words("trust", "widen", held=listed(held), factors=listed(factors))]


def _exceptions(summary: Mapping[str, Any]) -> str:
    """Where some other method does better than the program's by more than both intervals."""
    found = []
    for factor in summary["factors"].values():
        for number, name in enumerate(factor["bins"]):
            shares = {label: factor["methods"][label][number]["success"] for label in METHODS}
            better = [METHODS[label].title for label, share in shares.items() if _above(share, shares[PRODUCT])]
            if better:
                found.append(f"{listed(better)} at {factor['title']} {name}")
    return words("trust", "better" if found else "none_better", product=METHODS[PRODUCT].title, where="; ".join(found))


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
    fewer = f"; fewer at {listed(doubtful)}" if trusted and doubtful else ""
    return words("trust", "reach", title=factor["title"], share=_percent(_TRUSTED), where=where, fewer=fewer)


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
