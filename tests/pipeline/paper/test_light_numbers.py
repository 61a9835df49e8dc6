import numpy as np
import pytest
from dockpose.paper import light_numbers
from dockpose.paper.light_numbers import WHO, Errors, errors_with


def test_exact_lights_give_exact_poses(monkeypatch):
    monkeypatch.setattr(light_numbers, "NOISE_PX", 0.0)
    errors = errors_with(10, 10, seed=1, trials=4)
    for who in ("ellipse", "ours", "sqpnp"):
        assert errors.position[who].max() < 1e-3
        assert errors.angle_deg[who].max() < 1e-2


def test_four_lights_are_no_ellipse():
    errors = errors_with(4, 12, seed=1, trials=3)
    assert np.isinf(errors.position["ellipse"]).all()
    assert np.isfinite(errors.position["ours"]).all()
    assert errors.wrong("ellipse") == 1.0


def test_more_lights_and_their_spacing_help():
    few, many = errors_with(6, 6, seed=1, trials=60), errors_with(24, 24, seed=1, trials=60)
    # Four times the lights halve the error; the median of 60 is known to about a sixth.
    assert np.median(many.position["ours"]) == pytest.approx(np.median(few.position["ours"]) / 2, rel=0.4)
    # What the spacing adds to the ellipse is more than that scatter.
    assert np.median(many.angle_deg["ours"]) < 0.85 * np.median(many.angle_deg["ellipse"])


def test_wrong_poses_by_hand():
    angles = {who: np.array([1.0, 11.0, np.inf, 9.0]) for who in WHO}
    assert Errors(angles, angles).wrong("ours") == 0.5
