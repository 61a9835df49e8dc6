"""A tape laid out in a tank: what was put into made-up rows comes back, within its standard error."""

import numpy as np
import pytest
from dockpose.pose.tape import Place, TapeFit, fit_tape
from scipy.spatial.transform import Rotation

TAPE_M, OWN_M = 0.002, 0.0005
KNOWN = {"all": (), "z alone": (0, 1, 3), "distance alone": (0, 1, 2)}  # what is not measured


def rows(
    seed: int, scale=1.0, turn=(0, 0, 0), shift=(0, 0, 0), zero=0.0, edge=0.0, without=(), count=30
) -> list[Place]:
    """Places as estimated by a camera whose lengths are ``scale`` too short, and as measured."""
    rng, places = np.random.default_rng(seed), []
    for _ in range(count):
        z = rng.uniform(0.8, 3.0)
        seen = np.array([*rng.uniform(-0.4, 0.4, 2) * z, z])
        true = scale * seen
        true[:2] *= 1 + edge * (seen[:2] @ seen[:2]) / z**2
        in_tank = Rotation.from_rotvec(turn).apply(true) + shift
        measured = np.array([*in_tank, np.linalg.norm(true) + zero]) + rng.normal(0, TAPE_M, 4)
        measured[list(without)] = np.nan
        places.append(Place(seen + rng.normal(0, OWN_M, 3), np.full(3, OWN_M), measured[:3], float(measured[3])))
    return places


@pytest.mark.parametrize("without", KNOWN.values(), ids=KNOWN)
@pytest.mark.parametrize("scale", [1.01, 0.98])
def test_a_wrong_diameter_is_told_within_its_error(scale, without):
    fits = [fit_tape(rows(seed, scale, without=without)) for seed in range(20)]
    assert all(fit.is_sure(fit.scale - 1, fit.scale_sigma) for fit in fits)
    off = np.array([(fit.scale - scale) / fit.scale_sigma for fit in fits])
    # Of 20 normal numbers the standard deviation is known to a sixth, and one in 370 is beyond 3.
    assert 0.5 < off.std() < 1.5
    assert np.abs(off).max() < 4


@pytest.mark.parametrize("without", KNOWN.values(), ids=KNOWN)
def test_where_all_is_well_nothing_is_told(without):
    fits = [fit_tape(rows(seed, without=without)) for seed in range(40)]
    assert sum(told(fit) for fit in fits) <= 40 * 9 * 0.0027 * 4  # nine numbers, each beyond 3 in one of 370
    assert not any(fit.slipped for fit in fits)


def told(fit: TapeFit) -> int:
    """How many of its numbers a fit is sure of."""
    sure = [fit.is_sure(fit.scale - 1, fit.scale_sigma), fit.is_sure(fit.zero_m, fit.zero_sigma_m)]
    sure += [fit.is_sure(*pair) for pair in zip(fit.turn_rad, fit.turn_sigma_rad, strict=True)]
    sure += [fit.is_sure(*pair) for pair in zip(fit.shift_m, fit.shift_sigma_m, strict=True)]
    return sum(sure) + fit.is_sure(fit.edge, fit.edge_sigma)


def test_the_tank_is_found_wherever_it_lies():
    fit = fit_tape(rows(1, turn=(0.02, -0.03, 0.01), shift=(0.1, -0.05, 0.012), zero=0.03))
    assert np.abs(fit.turn_rad - [0.02, -0.03, 0.01]).max() < 4 * fit.turn_sigma_rad.max() < 0.01
    assert np.abs(fit.shift_m - [0.1, -0.05, 0.012]).max() < 4 * fit.shift_sigma_m.max() < 0.01
    assert fit.zero_m == pytest.approx(0.03, abs=4 * fit.zero_sigma_m)
    assert not fit.is_sure(fit.scale - 1, fit.scale_sigma)
    assert np.sqrt((fit.residuals_m**2).mean()) == pytest.approx(TAPE_M, rel=0.3)


def test_what_grows_to_the_edge_is_told_from_what_grows_with_the_range():
    fit = fit_tape(rows(2, edge=0.2))
    assert fit.edge == pytest.approx(0.2, abs=4 * fit.edge_sigma)
    assert fit.is_sure(fit.edge, fit.edge_sigma)
    assert not fit.is_sure(fit.scale - 1, fit.scale_sigma)


def test_rows_that_were_mistyped_are_left_out():
    places = rows(3, 1.01)
    places[7].measured_m[2] += 0.12
    places[12].measured_m[0] -= 1.0
    fit = fit_tape(places)
    assert fit.slipped == (7, 12)
    assert fit.scale == pytest.approx(1.01, abs=4 * fit.scale_sigma)
    assert fit.residuals_m[7, 2] == pytest.approx(-0.12, abs=0.01)


def test_a_tape_worse_than_said_makes_larger_errors_not_slips():
    rng = np.random.default_rng(4)
    places = rows(4, 1.01)
    for place in places:
        place.measured_m[:] += rng.normal(0, 0.02, 3)
    fit = fit_tape(places)
    assert not fit.slipped
    assert fit.scale == pytest.approx(1.01, abs=4 * fit.scale_sigma)
    assert fit.scale_sigma > 3 * fit_tape(rows(4, 1.01)).scale_sigma


def test_few_rows_leave_open_what_they_do_not_tell():
    fit = fit_tape(rows(5, 1.01, without=(0, 1, 3), count=3))
    assert not fit.is_sure(fit.edge, fit.edge_sigma)
    assert fit.turn_sigma_rad[2] == pytest.approx(0.1, rel=0.2)  # as before a row was seen
    with pytest.raises(ValueError, match="3 rows with a pose and measured values are needed, and there are 2"):
        fit_tape(rows(5, count=2))
    with pytest.raises(ValueError, match="3 rows"):
        fit_tape(rows(5, without=(0, 1, 2, 3)))
