import math

import numpy as np
import pytest
from dockpose.simulate.optics import psf as optics
from dockpose.simulate.optics.psf import ANGLES, FREQUENCIES, Psf, hou_exponent, point_spread
from dockpose.simulate.optics.water import PRESETS, Water, preset
from numpy.polynomial.legendre import leggauss
from scipy.fft import fhtoffset
from scipy.special import j0

NODES, WEIGHTS = leggauss(20)


def mean_by_quadrature(x):
    """Gauss and Legendre's rule with twenty nodes on each stretch of at most 1, over which J0 is almost a parabola."""
    edges = np.linspace(0, x, int(np.ceil(x)) + 1)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    return float(np.sum(half * WEIGHTS * j0(middle + half * NODES))) / x


@pytest.mark.parametrize("x", [1e-9, 0.01, 1.0, 2.4048, 19.9, 20.1, 31.999, 32.0, 32.001, 50.0, 100.0, 1234.5, 1e5])
def test_mean_of_the_bessel_function(x):
    assert optics.mean_bessel(np.array([x]))[0] == pytest.approx(mean_by_quadrature(x), rel=1e-10)


def test_a_gaussian_comes_back_as_a_gaussian():
    sigma = 0.01
    transfer = np.exp(-2 * (np.pi * sigma * FREQUENCIES) ** 2)
    spread = np.exp(-0.5 * (ANGLES / sigma) ** 2) / (2 * np.pi * sigma**2)
    seen = ANGLES > 1e-5
    assert optics.spread_of(transfer)[seen] == pytest.approx(spread[seen], abs=1e-6 * spread.max())
    fast = FREQUENCIES > 0.1  # at slower ones the transform, which goes on periodically, loses a little
    assert optics.transfer_of(spread)[fast] == pytest.approx(transfer[fast], abs=1e-9)


DISTANCE_M = 1.5


def scattered_share(model: str, water: Water, distance_m: float) -> float:
    """What should arrive as glow: Hou's is scattered once, the others' is all that is scattered and not absorbed."""
    direct = math.exp(-water.attenuation_per_m * distance_m)
    if model == "hou":
        return water.scattering_per_m * distance_m * direct
    return math.exp(-water.absorption_per_m * distance_m) - direct


def integral(spread: np.ndarray) -> float:
    return float(2 * math.pi * np.trapezoid(spread * ANGLES**2, np.log(ANGLES)))


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("model", ["voss", "hou", "gaussian"])
def test_the_glow_integrates_to_the_scattered_share(name, model):
    water = preset(name)
    found = point_spread(Psf(model=model), water, DISTANCE_M)
    expected = scattered_share(model, water, DISTANCE_M)
    assert found.glow_share == pytest.approx(expected, rel=1e-6)
    assert integral(found.glow_per_sr) == pytest.approx(expected, rel=0.01)
    assert found.direct_share == pytest.approx(math.exp(-water.attenuation_per_m * DISTANCE_M))
    assert (found.glow_per_sr >= 0).all()
    if model == "voss":  # a transfer function that is far off at high frequencies makes pictures black
        assert (np.diff(found.glow_transfer) < 1e-9).all()
        assert found.glow_transfer[-1] < 0.01 * found.glow_share


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("model", ["voss", "hou"])
def test_the_hankel_pair_returns_the_transfer_function_within_one_percent(name, model):
    found = point_spread(Psf(model=model), preset(name), DISTANCE_M)
    # An independent transform: the integral itself, on a grid fine enough for its oscillations.
    angles = np.geomspace(1e-9, 30, 500_000)
    spread = np.exp(np.interp(np.log(angles), np.log(ANGLES), np.log(found.glow_per_sr + 1e-300)))
    for frequency in (0.5, 2.0, 8.0, 30.0, 100.0):
        integrand = spread * j0(2 * math.pi * frequency * angles) * angles**2
        returned = 2 * math.pi * np.trapezoid(integrand, np.log(angles))
        expected = np.interp(frequency, FREQUENCIES, found.glow_transfer)
        assert returned + found.direct_share == pytest.approx(expected + found.direct_share, rel=0.01)


def test_the_log_log_slope_of_hous_is_minus_m():
    # The published example: theta0 = 0.03, w0 = 0.87, tau = 5.5, so m = 1 / (0.87 - 0.33) = 1.852.
    water = Water(absorption_per_m=0.13, scattering_per_m=0.87)
    psf = Psf(model="hou", theta0_rad=0.03)
    assert hou_exponent(psf, water, 5.5) == pytest.approx(1 / 0.54)
    glow = point_spread(psf, water, 5.5).glow_per_sr
    straight = (ANGLES > 1e-3) & (ANGLES < 1)
    slopes = np.diff(np.log(glow[straight])) / np.diff(np.log(ANGLES[straight]))
    np.testing.assert_allclose(slopes, -1 / 0.54, rtol=1e-6)


def test_hous_model_refuses_what_lies_beyond_its_validity_and_gives_the_limit():
    water = preset("harbour")
    limit_m = water.albedo / (2 * 0.04716) / water.attenuation_per_m  # 4.03 m; theta0 as derived by others
    with pytest.raises(ValueError, match=r"below w0 / \(2 theta0\) .* below 4\.0\d m"):
        point_spread(Psf(model="hou"), water, 1.05 * limit_m)
    point_spread(Psf(model="hou"), water, 0.95 * limit_m)


def test_the_poisson_version_scatters_a_whole_number_of_times():
    water = preset("harbour")
    one = integral(point_spread(Psf(model="hou"), water, 1.0).glow_per_sr) / (water.scattering_per_m * 1.0)
    shares = []
    for seed in range(200):
        found = point_spread(Psf(model="hou_poisson"), water, 1.0, np.random.default_rng(seed))
        times = integral(found.glow_per_sr) / one
        assert times == pytest.approx(round(times), abs=1e-6)
        shares.append(times)
    # Mean b r = 1.824; the standard error of 200 draws is sqrt(1.824 / 200) = 0.096.
    assert np.mean(shares) == pytest.approx(1.824, abs=3 * 0.096)
    assert len(set(np.round(shares))) > 3


def test_clear_water_that_does_not_scatter_has_no_glow():
    for model in ("voss", "hou", "hou_poisson", "gaussian"):
        found = point_spread(Psf(model=model), Water(0.2, 0.0), 2.0)
        assert found.glow_share == 0
        assert np.abs(found.glow_per_sr).max() == 0
        assert found.direct_share == pytest.approx(math.exp(-0.4))


def test_a_measured_transfer_function_is_used_and_scales_with_distance(tmp_path):
    path = tmp_path / "mtf.csv"
    frequencies = np.geomspace(0.01, 1e5, 50)
    transfer = 0.4 + 0.4 / (1 + frequencies / 20)
    path.write_text(
        "# measured\ncycles_per_rad,mtf\n" + "\n".join(f"{f},{h}" for f, h in zip(frequencies, transfer, strict=True))
    )
    psf = Psf(model="mtf", mtf_csv=str(path), mtf_distance_m=2.0)
    water = Water(0.1, 0.3)
    at_two = point_spread(psf, water, 2.0)
    assert at_two.direct_share == pytest.approx(transfer[-1])
    assert at_two.glow_share == pytest.approx(transfer[0] - transfer[-1], rel=1e-3)
    at_four = point_spread(psf, water, 4.0)
    assert at_four.direct_share == pytest.approx(transfer[-1] ** 2)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "its first line must be"),
        ("x,y\n1,2\n", "its first line must be"),
        ("cycles_per_rad,mtf\n1,0.9\n", "at least two rows"),
        ("cycles_per_rad,mtf\n1,0.9\n2,much\n", "could not convert"),
        ("cycles_per_rad,mtf\n1,0.9\n2,0.95\n", "the values fall"),
        ("cycles_per_rad,mtf\n2,0.9\n1,0.8\n", "must rise"),
        ("cycles_per_rad,mtf\n1,0.9\n2,0\n", "the values fall"),
    ],
)
def test_a_wrong_table_is_named(tmp_path, text, message):
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as raised:
        point_spread(Psf(model="mtf", mtf_csv=str(path)), Water(0.1, 0.1), 1.0)
    assert "wrong.csv" in str(raised.value)


def test_the_mean_transform_starts_at_one_and_falls():
    transform = np.interp([1e-4, 0.1, 1, 10, 100, 1e4], FREQUENCIES, optics.mean_phase_transform("harbour"))
    assert transform[0] == pytest.approx(1, abs=1e-3)
    assert (np.diff(transform) < 0).all()
    assert transform[-1] > 0


def test_the_offset_is_scipys():
    assert pytest.approx(fhtoffset(optics._STEP, mu=0.0, bias=optics._SLOW_BIAS), abs=1e-15) == optics._OFFSET
