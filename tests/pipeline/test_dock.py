import math

import msgspec
import numpy as np
import pytest
from dockpose import Dock
from dockpose.dock import frame_of


@pytest.mark.parametrize(
    ("given", "places"),
    [
        ({"lights": 4}, [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]),
        ({"angles_deg": (0, 90, 225)}, [[1, 0, 0], [0, 1, 0], [-math.sqrt(0.5), -math.sqrt(0.5), 0]]),
    ],
    ids=["even, from x towards y", "by their angles"],
)
def test_lights_lie_on_the_circle(given, places):
    dock = Dock(0.30, **given)
    assert dock.lights == len(places)
    np.testing.assert_allclose(dock.light_points(), 0.15 * np.array(places), atol=1e-12)


def test_files_of_earlier_versions_may_say_that_there_are_no_further_rings_and_no_colours():
    dock = msgspec.convert({"diameter_m": 0.3, "lights": 10, "rings": [], "colours": []}, Dock)
    assert dock == Dock(0.3, 10)
    assert not {"rings", "colours"} & msgspec.to_builtins(dock).keys()


def test_another_number_of_lights_changes_nothing_else():
    assert Dock(0.4, 8, lamp_depth_m=0.01).with_lights(10) == Dock(0.4, 10, lamp_depth_m=0.01)
    with pytest.raises(ValueError, match="angles_deg has 3 values; the dock has 4 lights"):
        Dock(0.4, angles_deg=(0, 100, 200)).with_lights(4)


@pytest.mark.parametrize("normal", [(0, 0, -1), (0, 0, 1), (1, 0, 0), (0.1, 0.2, -3), (0, 1e-9, 1), (-1, 1, 1)])
def test_a_frame_is_turned_the_shortest_way(normal):
    frame, out = frame_of(normal), np.array(normal) / np.linalg.norm(normal)
    np.testing.assert_allclose(frame @ [0, 0, -1], out, atol=1e-8)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert (np.trace(frame) - 1) / 2 == pytest.approx(-out[2])  # by no more than the angle between them


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"diameter_m": 0.3, "lights": 4, "angles_deg": (0, 90, 180)},
            "angles_deg has 3 values; the dock has 4 lights",
        ),
        ({"diameter_m": 0.3, "angles_deg": (0, 90, 360)}, "two lights at 0 degrees"),
        ({"diameter_m": 0.3, "angles_deg": (0, 90, math.nan)}, r"angles_deg\[2\] is nan"),
        ({"diameter_m": 0.3, "lights": 3, "colours": ["red", "white", "white"]}, "colours is given; lights are told"),
        ({"diameter_m": 0.3, "angles_deg": (0, 90)}, "lights is 2"),
        ({"diameter_m": 0.3, "extra_lights_m": [[0, 0]]}, "extra_lights_m"),
        ({"diameter_m": 0.3, "extra_lights_m": [0, 0, 0.05]}, "extra_lights_m"),
        ({"diameter_m": 0.3, "extra_lights_m": [[0, 0, math.nan]]}, r"extra_lights_m\[0\] is nan"),
        (
            {"diameter_m": 0.3, "extra_lights_m": [[0, 0, 0.05], [0.1, 0, 0.005]]},
            r"extra_lights_m\[1\] .* tells nothing",
        ),
        ({"diameter_m": 0.3, "extra_lights_m": [[0, 0, -0.61]]}, "within two diameters, 0.6"),
        ({"diameter_m": 0.3, "lamp_depth_m": 0.05, "extra_lights_m": [[0, 0, 0.05]]}, "tells nothing"),
        ({"diameter_m": 0.3, "lights": 10, "lamp_depth_m": 0.2}, r"lamp_depth_m is 0\.2; .* below the radius, 0\.15"),
        ({}, "diameter_m is missing"),
        ({"rings": [{"name": "far", "diameter_m": 0.9, "lights": 12}]}, "rings is given; a dock has one ring"),
    ],
)
def test_impossible_docks_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        msgspec.convert(values, Dock)
