import msgspec
import numpy as np
from dockpose.app.experiment import Row
from dockpose.app.web.charts.errors import CHARTS, error_points

ROW = Row(
    number=1, time="2026-01-01T00:00:00+00:00", source="tank", file="frames/0001.png", sha256="", status="ok",
    x_cm=1.0, y_cm=2.0, z_cm=100.0, theta_x_deg=10.0, theta_y_deg=-5.0,
)  # fmt: skip


def changed(**fields) -> Row:
    return msgspec.structs.replace(ROW, **fields)


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
