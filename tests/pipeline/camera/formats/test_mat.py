"""SciPy writes what is read."""

import io

import numpy as np
import pytest
import scipy.io
from dockpose.camera.formats.mat import mat_content


@pytest.mark.parametrize("do_compression", [False, True])
def test_reads_what_scipy_writes(do_compression):
    values = {
        "matrix": np.array([[1.5, 2.0, 3.0], [4.0, 5.0, 6.0]]),
        "whole": np.array([[7, 8]], np.uint16),
        "text": "radtan",
        "nested": {"inner": {"K": np.eye(3), "n": 2.0}, "empty": np.zeros((0, 0))},
        "cells": np.array(["a", np.array([1.0, 2.0])], dtype=object),
        "several": np.array([(1.0,), (2.0,)], dtype=[("f", object)]),
    }
    file = io.BytesIO()
    scipy.io.savemat(file, values, do_compression=do_compression)
    assert mat_content(file.getvalue()) == {
        "matrix": [[1.5, 2, 3], [4, 5, 6]],
        "whole": [7, 8],
        "text": "radtan",
        "nested": {"inner": {"K": np.eye(3).tolist(), "n": 2.0}, "empty": []},
        "cells": ["a", [1.0, 2.0]],
        "several": [{"f": 1.0}, {"f": 2.0}],
    }


def test_of_a_file_that_breaks_off_the_beginning_is_read():
    file = io.BytesIO()
    scipy.io.savemat(file, {"a": 1.0, "b": np.arange(100.0)})
    assert mat_content(file.getvalue()[:-50]) == {"a": 1.0}


def test_a_file_without_variables_says_what_to_save():
    with pytest.raises(ValueError, match="-v7"):
        mat_content(b"MATLAB 7.3 MAT-file".ljust(600))
