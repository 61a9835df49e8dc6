import math

import numpy as np
import pytest
from dockpose import Dock


def test_even_lights_lie_on_the_circle_from_x_towards_y():
    points = Dock(0.30, 4).light_points()
    np.testing.assert_allclose(points, 0.15 * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]), atol=1e-12)


def test_uneven_lights_lie_where_their_angles_say_and_count_themselves():
    dock = Dock(0.30, angles_deg=(0, 90, 225))
    assert dock.lights == 3
    half = math.sqrt(0.5)
    np.testing.assert_allclose(
        dock.light_points(), 0.15 * np.array([[1, 0, 0], [0, 1, 0], [-half, -half, 0]]), atol=1e-12
    )


def test_colours_count_the_lights_too():
    assert Dock(0.30, colours=("red", "white", "white", "blue")).lights == 4


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"lights": 4, "angles_deg": (0, 90, 180)}, "angles_deg has 3 values; the dock has 4 lights"),
        ({"angles_deg": (0, 90, 360)}, "two lights at 0 degrees"),
        ({"angles_deg": (0, 90, math.nan)}, r"angles_deg\[2\] is nan"),
        ({"lights": 3, "colours": ("red", "white", "pink")}, r"colours\[2\] is 'pink'"),
        ({"angles_deg": (0, 90)}, "lights is 2"),
    ],
)
def test_impossible_lights_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        Dock(0.30, **values)
