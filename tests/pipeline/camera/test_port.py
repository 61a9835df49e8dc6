import math

import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.port import FlatPort

PORT = FlatPort(air_gap_m=0.03, glass_m=0.01)
CAMERA = Camera(500, 490, 310, 250, 640, 480, (-0.2, 0.05, 0.001, -0.001, 0.0), PORT)


def test_a_ray_followed_by_hand_through_air_glass_and_water():
    port = FlatPort(0.03, 0.01, glass_index=1.5, water_index=1.333)
    in_air = math.radians(20)
    in_glass = math.asin(math.sin(in_air) / 1.5)
    in_water = math.asin(math.sin(in_air) / 1.333)
    sideways = 0.03 * math.tan(in_air) + 0.01 * math.tan(in_glass) + 2.0 * math.tan(in_water)
    (direction,) = port.into_air(np.array([[0.6 * sideways, 0.8 * sideways, 2.04]]))
    tangent = math.tan(in_air)
    assert direction == pytest.approx([0.6 * tangent, 0.8 * tangent, 1])


def test_the_ray_in_the_water_starts_where_design_says():
    in_air = math.radians(15)
    in_glass, in_water = (math.asin(math.sin(in_air) / index) for index in (PORT.glass_index, PORT.water_index))
    lost = (0.03 * math.tan(in_air) + 0.01 * math.tan(in_glass)) / math.tan(in_water)
    starts, directions = PORT.into_water(np.array([[math.sin(in_air), 0, math.cos(in_air)]]))
    assert starts[0] == pytest.approx([0, 0, 0.04 - lost])
    assert directions[0] == pytest.approx([math.sin(in_water), 0, math.cos(in_water)])


def test_on_the_axis_nothing_is_bent():
    np.testing.assert_allclose(CAMERA.project([[0, 0, 1.0]]), [[310, 250]], atol=1e-9)
    starts, directions = PORT.into_water(np.array([[0, 0, 1.0]]))
    np.testing.assert_allclose(directions, [[0, 0, 1]])
    # Seen through the window things near the axis look nearer, by the usual n ratio.
    assert starts[0, 2] == pytest.approx(0.04 - 1.333 * (0.03 + 0.01 / 1.517))


def test_ignoring_the_water_costs_41_px_ten_degrees_off_the_axis():
    # The figure that docs/method.md gives, for f = 700 px.
    bare = Camera(700, 700, 320, 240, 640, 480)
    wet = Camera(700, 700, 320, 240, 640, 480, port=PORT)
    point = [[math.tan(math.radians(10)), 0, 1]]
    assert wet.project(point)[0, 0] - bare.project(point)[0, 0] == pytest.approx(41, abs=1)


def test_points_inside_the_port_have_no_image():
    assert np.isnan(CAMERA.project([[0, 0, 0.02], [0, 0, -1]])).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"air_gap_m": -0.01, "glass_m": 0.01}, "air_gap_m is -0.01"),
        ({"air_gap_m": 0.01, "glass_m": math.nan}, "glass_m is nan"),
        ({"air_gap_m": 0.01, "glass_m": 0.01, "water_index": 1.0}, "water_index is 1.0"),
    ],
)
def test_bad_ports_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        FlatPort(**values)
