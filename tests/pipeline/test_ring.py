import numpy as np
import pytest

from pipeline.ring import find_ring


def lights(count=10, major=80.0, minor=55.0, centre=(300.0, 220.0), turn=0.3):
    t = 2 * np.pi * np.arange(count) / count + 0.1
    along, across = major * np.cos(t), minor * np.sin(t)
    return np.column_stack(
        [
            centre[0] + along * np.cos(turn) - across * np.sin(turn),
            centre[1] + along * np.sin(turn) + across * np.cos(turn),
        ]
    )


def test_lights_on_an_ellipse_are_all_kept():
    ring = find_ring(lights())
    assert ring.on_ring.all()
    assert "All 10" in ring.reason


@pytest.mark.parametrize("seed", range(20))
def test_up_to_four_strangers_are_thrown_out(seed):
    rng = np.random.default_rng(seed)
    ours = lights(turn=rng.uniform(0, 3)) + rng.normal(0, 0.2, (10, 2))
    strangers = rng.uniform([0, 0], [640, 480], (rng.integers(1, 5), 2))
    near = np.abs(np.linalg.norm((strangers - [300, 220]) / [1, 1], axis=1) - 67) < 20
    strangers = strangers[~near]  # one that happens to lie on the ring is no stranger
    order = rng.permutation(len(ours) + len(strangers))
    ring = find_ring(np.vstack([ours, strangers])[order])
    assert ring.on_ring.tolist() == (order < 10).tolist()


def test_five_lights_and_a_stranger_are_no_proof():
    points = np.vstack([lights(5), [[20.0, 20.0]]])
    ring = find_ring(points)
    assert not ring.found
    assert "No ellipse" in ring.reason


def test_a_row_of_letters_is_no_ring():
    rng = np.random.default_rng(0)
    row = np.column_stack([np.arange(15) * 12.0 + 40, 30 + rng.uniform(-3, 3, 15)])
    assert not find_ring(row).found


def test_the_same_points_give_the_same_ring():
    points = np.random.default_rng(5).uniform(0, 480, (25, 2))
    assert find_ring(points).on_ring.tolist() == find_ring(points).on_ring.tolist()


def test_scattered_points_are_no_ring():
    points = np.random.default_rng(1).uniform([0, 0], [640, 480], (7, 2))
    assert not find_ring(points).found
