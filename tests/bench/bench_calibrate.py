"""Boards in haze, how honest a calibration's errors are, and how well a dock's lights are learned."""

import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.board import find_board
from dockpose.camera.fitting import LENSES, climb, fit, fit_port, sigmas_of
from dockpose.camera.port import FlatPort
from dockpose.pose.learned.learning import LearningError, learn_dock
from msgspec.structs import replace

from tests.pipeline.camera.test_board import clutter, murky
from tests.pipeline.camera.test_calibrate import CHESSBOARD
from tests.support.boards import SIZE, TRUE, sightings
from tests.support.docks import dock_views, errors_m, nominal, uneven


def test_boards_in_haze():
    found = sum(find_board(murky(seed), CHESSBOARD) is not None for seed in range(100))
    quickly = sum(find_board(murky(seed), CHESSBOARD, thorough=False) is not None for seed in range(100))
    false = sum(find_board(clutter(seed), CHESSBOARD) is not None for seed in range(20))
    print(f"\nboards in haze: {found} of 100 found, {quickly} at the first two looks; in clutter {false} of 20")
    assert found >= 98
    assert false == 0


def test_errors_of_the_intrinsics():
    scores = []
    for seed in range(60):
        fitted = fit(sightings(TRUE, seed), SIZE, LENSES["k2"])
        sigma = np.array(list(sigmas_of(fitted, sightings(TRUE, seed)).values.values()))
        camera = fitted.camera
        found = np.array([camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:2]])
        scores.append((found - [TRUE.fx, TRUE.fy, TRUE.cx, TRUE.cy, *TRUE.distortion[:2]]) / sigma)
    spread = np.sqrt(np.mean(np.square(scores), axis=0))
    print(f"\nerror over sigma of fx, fy, cx, cy, k1, k2, root mean square over 60: {spread.round(2).tolist()}")
    assert (np.abs(spread - 1) < 0.35).all()


def test_lens_models():
    lenses = {
        "none": Camera(520, 515, 322, 236, *SIZE),
        "k2": TRUE,
        "tangential": replace(TRUE, distortion=(-0.18, 0.05, 0.003, -0.002)),
        "k3": Camera(400, 400, 322, 236, *SIZE, (-0.3, 0.15, 0.001, -0.001, -0.05)),
    }
    for name, camera in lenses.items():
        chosen = [climb(sightings(camera, seed, count=15), SIZE)[0].name for seed in range(10)]
        print(f"\nlens {name}: chosen {chosen.count(name)} of 10, otherwise {sorted(set(chosen) - {name})}")
        assert chosen.count(name) >= 8


@pytest.mark.parametrize("gap_m", [0.01, 0.03, 0.06])
def test_air_gaps(gap_m):
    scores, sigmas_mm = [], []
    for seed in range(6):
        found = fit_port(sightings(replace(TRUE, port=FlatPort(gap_m, 0.010)), seed, count=8), TRUE)
        assert found.camera.port is not None
        sigma = found.sigmas.values["air_gap_m"]
        scores.append((found.camera.port.air_gap_m - gap_m) / sigma)
        sigmas_mm.append(1000 * sigma)
    print(f"\nair gap {1000 * gap_m:.0f} mm: sigma {np.mean(sigmas_mm):.2f} mm, error over sigma {np.round(scores, 1)}")
    assert np.abs(scores).max() < 3.5


def test_learned_docks():
    """Random docks, a millimetre off along each axis: 60 views, 6 to 16 lights, 400 to 1400 px, 0.05 to 0.3 px."""
    errors, scores, refused = [], [], 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        true, focal = uneven(seed, int(rng.integers(6, 17))), float(rng.uniform(400, 1400))
        camera = Camera(focal, focal, 319.5, 239.5, 640, 480)
        rolls = 0.05 if seed % 2 else None
        views = dock_views(true, seed, noise_px=float(rng.uniform(0.05, 0.3)), camera=camera, rolls=rolls)
        try:
            error, sigma = errors_m(learn_dock(views, camera, nominal(true)), true)
        except LearningError:
            refused += 1
            continue
        errors.append(1000 * np.sqrt((error**2).mean()))
        scores.append(np.sqrt(((error / sigma) ** 2).mean()))
    print(
        f"\nlearned docks: error {np.median(errors):.3f} mm in the median, {np.max(errors):.3f} mm at worst, of "
        f"{len(errors)}; error over sigma {np.mean(scores):.2f}; {refused} refused"
    )
    assert np.max(errors) < 0.2
    assert refused <= 4
