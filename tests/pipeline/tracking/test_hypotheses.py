import pytest
from dockpose.tracking.hypotheses import grown


def test_what_frames_tell_together_stays_below_what_they_share():
    assert grown(0.0, 2.0, 4.0) == pytest.approx(4 / 3)  # 1 / (1/2 + 1/4)
    assert grown(4 / 3, 2.0, 4.0) == pytest.approx(2.0)  # 1 / (1/4 + 1/4)
    assert grown(-4 / 3, -2.0, 4.0) == pytest.approx(-2.0)
    told = 0.0
    for _ in range(10_000):
        told = grown(told, 1.0, 1.5)
    assert 1.45 < told < 1.5


def test_what_speaks_against_earlier_frames_counts_in_full_and_frames_that_know_nothing_tell_nothing():
    assert grown(1.0, -2.5, 4.0) == pytest.approx(-1.5)
    assert grown(0.0, 3.0, 0.0) == pytest.approx(0.0, abs=1e-9)
