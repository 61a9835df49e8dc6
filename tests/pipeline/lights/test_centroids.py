import numpy as np
import pytest
from dockpose.lights.centroids import _median
from hypothesis import given
from hypothesis import strategies as st


@pytest.mark.parametrize(("values", "median"), [([3.0], 3), ([3.0, 1.0], 2), ([5.0, 1.0, 4.0, 1.0], 2.5)])
def test_median_by_hand(values, median):
    assert _median(np.array(values)) == median


@given(st.lists(st.integers(0, 255), min_size=1, max_size=60))
def test_median_is_numpys(values):
    assert _median(np.array(values, dtype=float)) == np.median(values)
