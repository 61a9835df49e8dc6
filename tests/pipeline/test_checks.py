"""Argument checks: numbers of any kind are taken, and what is none or implausible is named in a short sentence."""

import math
from typing import Any

import numpy as np
import pytest
from dockpose import Camera, Dock, Settings
from dockpose.camera.port import FlatPort
from dockpose.checks import check_number, check_whole
from dockpose.simulate.parts import Lights, Pose, Sensor
from dockpose.text import one_line


@pytest.mark.parametrize("value", [1, 1.0, np.float32(1), np.int16(1), np.float64(1)])
def test_numbers_of_any_kind_are_taken(value):
    check_number("fx", value, above=0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "1", None, True, [1], 10**400, 1j, np.nan, b"1"])
def test_what_is_no_finite_number_is_named(value):
    with pytest.raises(ValueError, match=r"^fx is .*; it must be a finite number above 0$"):
        check_number("fx", value, above=0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("diameter", 1.6e-308),
        ("diameter", 1e300),
        ("air_gap_m", 1e308),
        ("position_m x", -1e200),
        ("distortion[2]", 1e30),
        ("glass_index", 1e9),
        ("theta_x_deg", 1e308),
    ],
)
def test_what_is_implausible_is_named(name, value):
    with pytest.raises(ValueError, match=f"^{name.split('[')[0]}.* is .*; it must be (at|within)"):
        check_number(name, value, above=0 if value > 0 else -math.inf)


@pytest.mark.parametrize("value", [2, 10**5000, 3.0, True, "3", np.float64(3)], ids=lambda value: type(value).__name__)
def test_what_is_no_whole_number_in_range_is_named(value):
    with pytest.raises(ValueError, match=r"^lights is .{1,100}; it must be"):
        check_whole("lights", value, least=3)


def test_numpys_numbers_and_arrays_become_pythons():
    numpy: Any = np  # types promise less than is taken
    K, size = numpy.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]), numpy.array([640, 480])
    port = FlatPort(numpy.float32(0.02), numpy.float64(0.01))
    camera = Camera(K[0, 0], K[1, 1], K[0, 2], K[1, 2], size[0], size[1], numpy.zeros(5), port)
    assert camera == Camera(700.0, 700.0, 320.0, 240.0, 640, 480, (0.0,) * 5, port)
    assert all(type(getattr(camera, name)) is float for name in ("fx", "fy", "cx", "cy"))
    assert (type(camera.width), type(camera.distortion[0]), type(port.glass_m)) == (int, float, float)
    dock = Dock(numpy.float64(0.3), numpy.int64(4), numpy.array([0, 90, 180, 270.5]))
    assert (dock.angles_deg, type(dock.lights)) == ((0.0, 90.0, 180.0, 270.5), int)
    assert type(Settings(min_area_px=numpy.int64(3)).min_area_px) is int
    assert Pose(position_m=numpy.array([0.0, 0.1, 2.0])).position_m == (0.0, 0.1, 2.0)
    assert Lights(brightness=numpy.array([0.5])).brightness == (0.5,)
    assert type(Sensor(gain=numpy.float64(2)).gain) is float


def test_a_message_has_one_line():
    assert one_line("a\nb\x1b[31m\udcff é") == "a\\nb\\x1b[31m\\xff é"
    assert len(one_line("x" * 10_000)) < 1000
