"""Point spread functions of water: how a lamp's light is spread, direct and as glow; and their Hankel transforms."""

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
from dockpose.checks import check_number, check_one_of, make_plain
from dockpose.simulate.optics.water import Water, phase_function, scattering_angle_rad

_COUNT = 1536
_STEP = math.log(1e12) / _COUNT
# Water's own transfer function starts flat and falls like 1/x or more slowly. With this bias the transformed function
# is equally low at both ends, so that its periodic continuation does not ring. Functions that vanish need none.
_SLOW_BIAS = 0.7
# By SciPy's fhtoffset(_STEP, mu=0.0, bias=_SLOW_BIAS); SciPy takes a third of a second to import.
_OFFSET = 0.007278601109682185
_CENTRE_FREQUENCY = 30.0  # cycles/rad, about where water's modulation transfer functions fall

_SERIES_FROM, _SERIES_TERMS = 32.0, 12

_INDEX = np.arange(_COUNT) - (_COUNT - 1) / 2
FREQUENCIES = _CENTRE_FREQUENCY * np.exp(_STEP * _INDEX)
ANGLES = math.exp(_OFFSET) / (2 * math.pi * _CENTRE_FREQUENCY) * np.exp(_STEP * _INDEX)


def spread_of(transfer: np.ndarray) -> np.ndarray:
    """Point spread function (1/sr) on ``ANGLES`` of a modulation transfer function on ``FREQUENCIES``."""
    vanishes = abs(transfer[-1]) <= 1e-12 * abs(transfer[0])
    return _transform(transfer, FREQUENCIES, ANGLES, 0.0 if vanishes else _SLOW_BIAS)


def transfer_of(spread: np.ndarray) -> np.ndarray:
    """Modulation transfer function on ``FREQUENCIES`` of a point spread function (1/sr) on ``ANGLES``."""
    return _transform(spread, ANGLES, FREQUENCIES, 0.0)


def mean_bessel(x: np.ndarray) -> np.ndarray:
    """Mean of J0 from 0 up to each ``x`` above 0, exact to 1e-12; itj0y0 is wrong above 20 before SciPy 1.17."""
    from scipy.interpolate import CubicSpline  # takes a tenth of a second to import, which only simulating needs
    from scipy.special import j0, j1

    result = np.empty_like(x, dtype=float)
    near = x < _SERIES_FROM
    knots = np.linspace(0, _SERIES_FROM, 8193)
    result[near] = CubicSpline(knots, j0(knots)).antiderivative()(x[near])
    far = x[~near]
    in_j1, in_j0 = np.zeros_like(far), np.zeros_like(far)
    for k in reversed(range(_SERIES_TERMS)):  # by Horner: 1 - 1/x^2 + 9/x^4 - ..., and 1/x - 3/x^3 + 45/x^5 - ...
        odd = math.prod(range(1, 2 * k, 2))
        in_j1 = (-1) ** k * odd**2 + in_j1 / far**2
        in_j0 = (-1) ** k * odd**2 * (2 * k + 1) + in_j0 / far**2
    result[~near] = 1 + j1(far) * in_j1 - j0(far) * in_j0 / far
    return result / x


def _transform(values: np.ndarray, x: np.ndarray, y: np.ndarray, bias: float) -> np.ndarray:
    from scipy.fft import fht

    # fht integrates over k = 2 pi y with an extra factor k; both cancel, except for a factor y.
    return fht(values * x, _STEP, mu=0.0, offset=_OFFSET, bias=bias) / y


_WIDEST_RAD = math.pi / 2  # glow from behind the camera's back is not seen


class Psf(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The water's point spread function."""

    model: str = "voss"  # one of ``MODELS``
    inner_cutoff_deg: float = 0.02  # for "hou" and "hou_poisson", which are singular at 0: constant within this angle
    theta0_rad: float | None = None  # for the same, the mean scattering angle; None takes the water's
    width_deg: float = 1.0  # for "gaussian", its standard deviation
    mtf_csv: str | None = None  # for "mtf": a file of cycles_per_rad and mtf, down to the direct light's share
    mtf_distance_m: float = 1.0  # distance at which that was measured
    # the glow is seen rotated by this angle about an axis in the picture, which makes it asymmetric
    tilt_deg: float = 0.0
    tilt_axis_deg: float = 0.0  # direction of that axis, from the x axis towards y

    def __post_init__(self) -> None:
        make_plain(self)
        check_one_of("psf model", self.model, MODELS)
        for name in ("inner_cutoff_deg", "width_deg", "mtf_distance_m"):
            check_number(name, getattr(self, name), above=0)
        if self.theta0_rad is not None:
            check_number("theta0_rad", self.theta0_rad, above=0)
        check_number("tilt_axis_deg", self.tilt_axis_deg)
        check_number("tilt_deg", self.tilt_deg)
        if abs(self.tilt_deg) >= 80:
            raise ValueError(f"tilt_deg is {self.tilt_deg!r}; it must be within -80 to 80")
        if (self.model == "mtf") != (self.mtf_csv is not None):
            raise ValueError(f"mtf_csv is {self.mtf_csv!r} with the model {self.model!r}; they belong together")


@dataclass(frozen=True)
class PointSpread:
    """The image of one lamp at one distance, per unit of light that would arrive through clear water."""

    direct_share: float  # share of the light that arrives in a straight line: e^{-c r}
    glow_per_sr: np.ndarray  # glow at the angles ``ANGLES`` from the lamp
    glow_transfer: np.ndarray  # its modulation transfer function at ``FREQUENCIES``; at 0 its share

    @property
    def glow_share(self) -> float:
        """Share of the light that arrives as glow."""
        return float(self.glow_transfer[0])


def point_spread(psf: Psf, water: Water, distance_m: float, rng: np.random.Generator | None = None) -> PointSpread:
    """Return the point spread function of water for a lamp at a distance."""
    check_number("distance_m", distance_m, above=0)
    return MODELS[psf.model](psf, water, distance_m, rng or np.random.default_rng(0))


def _voss(psf: Psf, water: Water, distance_m: float, rng: np.random.Generator) -> PointSpread:
    """Voss 1991 and Wells 1973: H = exp(-c r + b r mean_{0..psi} P^), P^ the phase function's transform."""
    scattered = water.scattering_per_m * distance_m * mean_phase_transform(water.phase_function)
    direct = math.exp(-water.attenuation_per_m * distance_m)
    return _from_transfer(direct, direct * np.expm1(scattered))


def _gaussian(psf: Psf, water: Water, distance_m: float, rng: np.random.Generator) -> PointSpread:
    """All light that is scattered but not absorbed, e^{-a r} - e^{-c r}, as a Gaussian."""
    direct = math.exp(-water.attenuation_per_m * distance_m)
    glow = math.exp(-water.absorption_per_m * distance_m) - direct
    sigma = math.radians(psf.width_deg)
    transfer = glow * np.exp(-2 * (math.pi * sigma * FREQUENCIES) ** 2)
    spread = glow * np.exp(-0.5 * (ANGLES / sigma) ** 2) / (2 * math.pi * sigma**2)
    return PointSpread(direct, spread, transfer)


def _hou(psf: Psf, water: Water, distance_m: float, rng: np.random.Generator) -> PointSpread:
    """Hou, Gray, Weidemann and Arnone 2008: K b r e^{-tau} / (2 pi theta^m), m = 1 / (w0 - 2 tau theta0)."""
    scatterings = water.scattering_per_m * distance_m
    if psf.model == "hou_poisson":  # Ghosh et al. 2016, section 2.1.2: a random number of this mean in its place
        scatterings = float(rng.poisson(scatterings))
    direct = math.exp(-water.attenuation_per_m * distance_m)
    if water.scattering_per_m == 0:
        return PointSpread(direct, np.zeros_like(ANGLES), np.zeros_like(FREQUENCIES))
    exponent = hou_exponent(psf, water, distance_m)
    inner = math.radians(psf.inner_cutoff_deg)
    shape = np.where(ANGLES <= _WIDEST_RAD, np.maximum(ANGLES, inner) ** -exponent, 0.0)
    shape /= np.trapezoid(shape * ANGLES**2, np.log(ANGLES))  # so that 2 pi int shape / (2 pi) theta dtheta = 1
    glow = scatterings * direct
    spread = glow * shape / (2 * math.pi)
    transfer = np.clip(transfer_of(spread), 0.0, glow)
    transfer[0] = glow
    return PointSpread(direct, spread, transfer)


def _measured(psf: Psf, water: Water, distance_m: float, rng: np.random.Generator) -> PointSpread:
    """A modulation transfer function measured at one distance; its logarithm is proportional to the distance."""
    frequencies, transfer = _read_transfer(str(psf.mtf_csv))
    log_transfer = np.interp(FREQUENCIES, frequencies, np.log(transfer)) * distance_m / psf.mtf_distance_m
    direct = math.exp(log_transfer[-1])
    return _from_transfer(direct, np.exp(log_transfer) - direct)


MODELS = {"voss": _voss, "hou": _hou, "hou_poisson": _hou, "gaussian": _gaussian, "mtf": _measured}


def hou_exponent(psf: Psf, water: Water, distance_m: float) -> float:
    """Hou's exponent m = 1 / (w0 - 2 tau theta0)."""
    theta0 = psf.theta0_rad if psf.theta0_rad is not None else scattering_angle_rad(water.phase_function)
    optical_length = water.attenuation_per_m * distance_m
    limit = water.albedo / (2 * theta0)
    if optical_length >= limit:
        raise ValueError(
            f"distance_m is {distance_m:.3g}: Hou's point spread function holds for c r below w0 / (2 theta0) = "
            f"{limit:.3g}, here below {limit / max(water.attenuation_per_m, 1e-12):.3g} m"
        )
    return 1 / (water.albedo - 2 * optical_length * theta0)


def _from_transfer(direct: float, glow_transfer: np.ndarray) -> PointSpread:
    return PointSpread(direct, np.maximum(spread_of(glow_transfer), 0.0), glow_transfer)


@lru_cache
def _read_transfer(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Read a modulation transfer function from CSV. Raises ValueError that names the file and what is wrong."""
    try:
        lines = [line for line in Path(path).read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"mtf_csv {path}: cannot be read ({error})") from error
    if not lines or [name.strip() for name in lines[0].split(",")] != ["cycles_per_rad", "mtf"]:
        raise ValueError(f"mtf_csv {path}: its first line must be cycles_per_rad,mtf")
    try:
        table = np.array([[float(value) for value in line.split(",")] for line in lines[1:]])
    except ValueError as error:
        raise ValueError(f"mtf_csv {path}: {error}") from error
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2:
        raise ValueError(f"mtf_csv {path}: needs at least two rows of two numbers")
    frequencies, transfer = table.T
    falls = (np.diff(frequencies) > 0).all() and (np.diff(transfer) <= 0).all()
    if not falls or frequencies[0] < 0 or not (transfer[-1] > 0 and transfer[0] <= 1):
        raise ValueError(f"mtf_csv {path}: the frequencies must rise, and the values fall within 0 (excluded) to 1")
    return frequencies, transfer


@lru_cache
def mean_phase_transform(name: str) -> np.ndarray:
    """Mean of the phase function's Hankel transform over the frequencies from 0 up to each of ``FREQUENCIES``."""
    angles, values = phase_function(name)
    x = 2 * math.pi * np.multiply.outer(FREQUENCIES, angles)
    weights = 2 * math.pi * values * np.sin(angles) * angles
    return np.asarray(np.trapezoid(mean_bessel(x) * weights, np.log(angles), axis=1))
