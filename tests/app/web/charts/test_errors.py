import numpy as np
from dockpose.app.web.charts.errors import CHARTS, error_points

from tests.support.rows import changed


def test_points_of_the_chart():
    rows = [
        changed(measured_z_cm=98.0, distance_cm=200.0),
        changed(measured_x_cm=0.0, distance_cm=100.0),
        changed(distance_cm=150.0),  # nothing to be off from
    ]
    place, angle = (error_points(rows, marks) for marks in CHARTS)
    np.testing.assert_allclose(place, [[1, 1, np.nan, np.nan], [2, np.nan, np.nan, 2]])
    assert angle.shape == (0, 3)
    assert error_points([], CHARTS[0]).shape == (0, 4)
