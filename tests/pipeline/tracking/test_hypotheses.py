import numpy as np
import pytest
from dockpose.tracking.hypotheses import grown, posterior


def test_what_frames_tell_together_stays_below_what_they_share():
    assert grown(0.0, 2.0, 4.0) == pytest.approx(4 / 3)  # 1 / (1/2 + 1/4)
    assert grown(4 / 3, 2.0, 4.0) == pytest.approx(2.0)  # 1 / (1/4 + 1/4)
    assert grown(-4 / 3, -2.0, 4.0) == pytest.approx(-2.0)
    told = 0.0
    for _ in range(10_000):
        told = grown(told, 1.0, 1.5)
    assert 1.45 < told < 1.5


def test_what_speaks_against_earlier_frames_counts_in_full_down_to_even_odds_and_is_bounded_beyond():
    assert grown(3.0, -2.5, 4.0) == pytest.approx(0.5)
    assert grown(1.0, -2.5, 4.0) == pytest.approx(-12 / 11)  # 1.5 is left: 1 / (1/1.5 + 1/4)
    assert -0.72 < grown(-0.02, 20.0, 0.72) < 0.72
    assert grown(0.0, 3.0, 0.0) == pytest.approx(0.0, abs=1e-9)


def weights_by_hand(first, squares, log_odds, motion):
    """How likely chain and candidate go together: by how near it is among both, by the frame, and by motion."""
    squares = np.asarray(squares, dtype=float)
    fits = np.exp(-0.5 * squares) / np.exp(-0.5 * squares).sum(axis=1, keepdims=True)
    frame = np.array([1, np.exp(-log_odds)]) / (1 + np.exp(-log_odds))
    moved = np.exp(-0.5 * motion * np.minimum(squares.min(axis=1), 9.0))  # more than three sigmas count as three
    return np.array([[first], [1 - first]]) * fits * frame * moved[:, None]


@pytest.mark.parametrize(
    ("first", "squares", "log_odds"),
    [
        (0.7, [[0.1, 30], [25, 0.5]], 1.0),
        (0.7, [[30, 0.1], [0.5, 25]], 1.0),  # the frame has them the other way round
        (0.3, [[1, 4], [6, 12]], -0.5),
        (0.5, [[2, 3], [3, 2]], 0.0),
        (0.5, [[90.0, 16], [3, 90]], 0.3),
    ],
)
@pytest.mark.parametrize("motion", [0.5, 0.0])
def test_the_posterior_is_that_of_both_chains_and_both_candidates(first, squares, log_odds, motion):
    (kept, crossed), (crossed_back, kept_too) = weights_by_hand(first, squares, log_odds, motion)
    total = kept + crossed + crossed_back + kept_too
    order, probability = posterior(first, np.array(squares, dtype=float), log_odds, motion)
    if kept + kept_too >= crossed + crossed_back:
        assert order == (0, 1)
        assert probability == pytest.approx((kept + crossed_back) / total)
    else:
        assert order == (1, 0)
        assert probability == pytest.approx((crossed + kept_too) / total)


def test_no_chain_is_ever_given_up():
    near = np.array([[0.0, 900.0], [900.0, 0.0]])
    assert posterior(1.0, near, 20.0)[1] == 1 - 5e-4
    assert posterior(0.0, near, -20.0)[1] == 5e-4
