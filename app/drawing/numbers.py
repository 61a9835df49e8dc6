"""Numbers as people read them: centimetres, degrees and per cent, with a dash for what is unknown."""

import math
from collections.abc import Iterable
from operator import itemgetter

from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose
from dockpose.thresholds import LEVELS, Threshold

MISSING = "–"
_STATUS_WORDS = {
    "too_few_markers": "too few lights",
    "no_ellipse": "no ellipse fits the lights",
    "not_a_ring": "the lights form no ring",
    "method_failed": "the threshold method failed",
}
# A pose's five numbers: their columns in SI units, and in those that people read; their heads, and those in LaTeX.
_NUMBERS: list[tuple[str, str, str, str]] = [
    ("x_m", "x_cm", "x (cm)", "$x$ (cm)"),
    ("y_m", "y_cm", "y (cm)", "$y$ (cm)"),
    ("z_m", "z_cm", "z (cm)", "$z$ (cm)"),
    ("theta_x_deg", "theta_x_deg", "θx (°)", r"$\theta_x$ ($^\circ$)"),
    ("theta_y_deg", "theta_y_deg", "θy (°)", r"$\theta_y$ ($^\circ$)"),
]
SI_COLUMNS, POSE_COLUMNS, QUANTITIES, LATEX = zip(*_NUMBERS, strict=True)
SIGMA_COLUMNS, TOTAL_COLUMNS = ([f"{sigma}_{name}" for name in SI_COLUMNS] for sigma in ("sigma", "sigma_total"))


def number(value: float | None, decimals: int = 1, *, signed: bool = False) -> str:
    """Return a number with so many decimals, or a dash for None; ``signed`` puts a plus before positive ones."""
    if value is None:
        return MISSING
    return f"{round(float(value), decimals) + 0.0:{'+' if signed else ''}.{decimals}f}"  # + 0.0 turns -0.0 into 0.0


def percent(probability: float | None, decimals: int = 1) -> str:
    """Return a probability in per cent, without the sign, or a dash for None."""
    return MISSING if probability is None else f"{100 * probability:.{decimals}f}"


def chance(pose: CirclePose, before: str = "") -> str:
    """Return a pose's probability as in "97 %", with ``before`` in front; empty where it is unknown."""
    return "" if pose.probability is None else f"{before}{percent(pose.probability, 0)} %"


def pose_values(pose: CirclePose | KnownPose) -> tuple[float, ...]:
    """Return a pose in the order and the units of ``QUANTITIES``."""
    x, y, z = map(float, pose.position_m)
    if isinstance(pose, KnownPose):
        return 100 * x, 100 * y, 100 * z, pose.theta_x_deg, pose.theta_y_deg
    return 100 * x, 100 * y, 100 * z, math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)


def pose_sigmas(pose: CirclePose, part: str | None = None) -> tuple[float | None, ...]:
    """Return the one-sigma of each of :func:`pose_values`, in all or of one part; None where it is unknown."""
    if pose.errors is None:
        return (None,) * len(QUANTITIES)
    (x, y, z), theta_rad = pose.errors.sigmas[part]
    sigmas = (100 * x, 100 * y, 100 * z, *map(math.degrees, theta_rad))
    if math.isfinite(sum(sigmas)):
        return sigmas
    return tuple([sigma if math.isfinite(sigma) else None for sigma in sigmas])


def sigma_words(sigma: float | None) -> str:
    """Return a standard deviation with one significant digit, as in "0.4" and "20", or a dash for None."""
    if sigma is None or not math.isfinite(sigma):
        return MISSING
    return f"{float(f'{max(sigma, 1e-4):.1g}'):g}" if sigma > 0 else "0"


def parts_words(pose: CirclePose, quantities: Iterable[int] = range(len(QUANTITIES))) -> list[str]:
    """Return where errors of some of ``QUANTITIES`` come from, each as in "camera 0.3, diameter 0.3, picture 0.006"."""
    words, rows = [], []
    errors = pose.errors
    if errors is None:
        return [""] * len([*quantities])
    for part in errors.parts:
        (x, y, z), theta_rad = errors.sigmas[part]
        rows.append((100 * x, 100 * y, 100 * z, *map(math.degrees, theta_rad), part))
    for quantity in quantities:
        rows.sort(key=itemgetter(quantity), reverse=True)
        words.append(", ".join([f"{row[-1]} {row[quantity]:.1g}" for row in rows if row[quantity] > 0]))
    return words


def pose_cells(pose: CirclePose | KnownPose, decimals: int = 1) -> list[str]:
    """Return :func:`pose_values` as text."""
    return [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in pose_values(pose)]  # + 0.0: no -0.0


def count(amount: int, noun: str) -> str:
    """Return an amount and its noun, as in "1 light" and "10 lights"."""
    return f"{amount} {noun}{'' if amount == 1 else 's'}"


def level_words(threshold: Threshold | None) -> str:
    """Return a threshold's level, as in "level 206", or "no level" where it keeps nothing."""
    return "no level" if threshold is None or threshold.level >= LEVELS else f"level {threshold.level}"


def status_words(status: str) -> str:
    """Return an estimate's status in words, as in "no lights"."""
    return _STATUS_WORDS.get(status, status.replace("_", " "))


def length_words(length_m: float) -> str:
    """Return a length with its unit: centimetres below a metre."""
    return f"{length_m:g} m" if length_m >= 1 else f"{100 * length_m:g} cm"


def place_words(pose: CirclePose | KnownPose) -> str:
    """Return where a dock is and how it is turned: "1.10 m ahead, 6 cm right, 4 cm up; pitch 6°, yaw -12°"."""
    ahead, across, along, pitch, yaw = place_parts(pose)
    return f"{ahead}, {across}, {along}; {pitch}, {yaw}"


def place_parts(pose: CirclePose | KnownPose) -> tuple[str, ...]:
    """Return the five parts of :func:`place_words`."""
    *_, pitch, yaw = pose_values(pose)
    return *way_parts(*map(float, pose.position_m)), f"pitch {number(pitch, 0)}°", f"yaw {number(yaw, 0)}°"


def way_parts(right_m: float, down_m: float, ahead_m: float) -> tuple[str, str, str]:
    """Return where something is, as seen by who looks ahead: "1.10 m ahead", "6 cm right" and "4 cm up"."""
    across = f"{_short_length(100 * right_m)} {'right' if right_m >= 0 else 'left'}"
    along = f"{_short_length(100 * down_m)} {'down' if down_m >= 0 else 'up'}"
    return f"{_short_length(100 * ahead_m)} {'ahead' if ahead_m >= 0 else 'behind'}", across, along


def deviation_words(sigma_m: float | None) -> str:
    """Return a standard deviation with one significant digit, as in "± 4 mm", "± 2 cm"; empty where it is unknown."""
    if sigma_m is None or not math.isfinite(sigma_m):
        return ""
    if sigma_m < 0.0095:
        return f"± {sigma_words(max(1000 * sigma_m, 0.1))} mm"
    return f"± {sigma_words(100 * sigma_m)} cm" if sigma_m < 0.95 else f"± {sigma_words(sigma_m)} m"


def _short_length(length_cm: float) -> str:
    """A length without its sign, to a centimetre below ten metres."""
    size = abs(length_cm)
    return f"{size:.0f} cm" if size < 99.5 else f"{size / 100:.2f} m" if size < 1000 else f"{size / 100:.1f} m"
