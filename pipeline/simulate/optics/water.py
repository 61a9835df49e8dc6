"""Water: how much light it absorbs and scatters, and at which angles."""

import math
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
from dockpose.checks import check_number, check_one_of, make_plain

PHASE_FUNCTIONS = ("clear", "coastal", "harbour", "average")
_PETZOLD = Path(__file__).parent / "petzold.csv"
_SMALLEST_ANGLE_RAD = 1e-7  # far below what a lens resolves

# Pure water's absorption (1/m) at 460, 530 and 620 nm less that at 514 nm (0.038): Pope and Fry 1997, Applied Optics
# 36. Everything else in the water is assumed to absorb equally in all three bands.
_EXTRA_ABSORPTION_PER_M = {"blue": -0.028, "green": 0.005, "red": 0.237}
BANDS = tuple(_EXTRA_ABSORPTION_PER_M)


class Water(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Optical properties of water at 514 nm."""

    absorption_per_m: float  # absorption coefficient a, at least 0
    scattering_per_m: float  # scattering coefficient b, at least 0
    # which of Petzold's phase functions the scattering follows, one of ``PHASE_FUNCTIONS``
    phase_function: str = "average"

    def __post_init__(self) -> None:
        make_plain(self)
        for name in ("absorption_per_m", "scattering_per_m"):
            check_number(name, getattr(self, name), least=0)
        check_one_of("phase_function", self.phase_function, PHASE_FUNCTIONS)

    @property
    def attenuation_per_m(self) -> float:
        """The beam attenuation c = a + b, in 1/m."""
        return self.absorption_per_m + self.scattering_per_m

    @property
    def albedo(self) -> float:
        """Single-scattering albedo w0 = b / c; 0 for water that neither absorbs nor scatters."""
        return self.scattering_per_m / self.attenuation_per_m if self.attenuation_per_m > 0 else 0.0

    def in_band(self, band: str) -> "Water":
        """Return the water's properties in a colour band: "blue" (460 nm), "green" (530 nm) or "red" (620 nm)."""
        absorption = max(0.0, self.absorption_per_m + _EXTRA_ABSORPTION_PER_M[band])
        return msgspec.structs.replace(self, absorption_per_m=absorption)


# Petzold's three waters as derived from his table. "tank" is our own: filtered fresh water in a test tank after some
# use, between his clear and coastal waters.
PRESETS = {
    "clear": Water(0.114, 0.037, "clear"),
    "tank": Water(0.12, 0.12, "average"),
    "coastal": Water(0.179, 0.219, "coastal"),
    "harbour": Water(0.366, 1.824, "harbour"),
}


def preset(name: str) -> Water:
    """Water by name."""
    if name not in PRESETS:
        raise ValueError(f"water is {name!r}; it must be one of {', '.join(PRESETS)}, or coefficients")
    return PRESETS[name]


def water_of_turbidity(turbidity: float) -> Water:
    """Water between the presets: 0 is clear, 1/3 tank, 2/3 coastal, 1 harbour; coefficients are interpolated in log.

    Parameters
    ----------
    turbidity : float
        From 0 to 1.

    Returns
    -------
    Water
        Its absorption and scattering, in 1 / m.

    Raises
    ------
    ValueError
        If the turbidity is not within 0..1.
    """
    check_number("turbidity", turbidity)
    if not 0 <= turbidity <= 1:
        raise ValueError(f"turbidity is {turbidity!r}; it must be within 0 to 1")
    waters = list(PRESETS.values())
    place = turbidity * (len(waters) - 1)
    at = np.arange(len(waters))
    absorption = math.exp(np.interp(place, at, [math.log(water.absorption_per_m) for water in waters]))
    scattering = math.exp(np.interp(place, at, [math.log(water.scattering_per_m) for water in waters]))
    return Water(absorption, scattering, waters[round(place)].phase_function)


@lru_cache
def phase_function(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Angles in radians, and Petzold's phase function of that name there, in 1/sr (Petzold 1972)."""
    table = np.loadtxt(_PETZOLD, delimiter=",", skiprows=3)
    log_angle = np.log(np.radians(table[:, 0]))
    log_value = np.log(table[:, 1 + PHASE_FUNCTIONS.index(name)])
    angles = np.geomspace(_SMALLEST_ANGLE_RAD, math.pi, 1200)
    slope = (log_value[1] - log_value[0]) / (log_angle[1] - log_angle[0])
    below = log_value[0] + slope * (np.log(angles) - log_angle[0])
    values = np.exp(np.where(np.log(angles) < log_angle[0], below, np.interp(np.log(angles), log_angle, log_value)))
    total = 2 * math.pi * np.trapezoid(values * np.sin(angles) * angles, np.log(angles))
    return angles, values / total


@lru_cache
def scattering_angle_rad(name: str) -> float:
    """Wells' mean scattering angle theta0 in radians: the median angle over the square root of 3 (Wells 1973)."""
    angles, values = phase_function(name)
    share = np.cumsum(values * np.sin(angles) * angles)
    return float(np.interp(0.5, share / share[-1], angles)) / math.sqrt(3)
