import math

import msgspec
import numpy as np
import pytest
from dockpose import Dock, DockRing
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


def test_colours_count_the_lights_too():
    assert Dock(0.30, colours=("red", "white", "white", "blue")).lights == 4


FAR, NEAR = DockRing(name="far", diameter=0.9, lights=12), DockRing(name="near", diameter=0.16, lights=6)


def test_a_dock_of_rings_has_the_largest_ones_diameter_and_lights():
    dock = Dock(rings=(NEAR, FAR))
    assert (dock.diameter, dock.lights) == (0.9, 12)
    assert msgspec.convert(msgspec.to_builtins(dock), Dock) == dock
    assert NEAR.dock == Dock(0.16, 6)


def test_the_lights_of_all_rings_lie_where_the_rings_are():
    # The second ring looks along +x, so that what is down its own axis, z, is along -x; its x axis is along -z.
    side = DockRing(name="side", diameter=0.2, lights=4, position_m=(1, 2, 3), normal=(5, 0, 0))
    points = Dock(rings=(DockRing(name="front", diameter=0.4, lights=3), side)).every_light_point()
    assert len(points) == 7
    np.testing.assert_allclose(points[:3], Dock(0.4, 3).light_points(), atol=1e-12)
    np.testing.assert_allclose(
        points[3:], np.array([1, 2, 3]) + 0.1 * np.array([[0, 0, 1], [0, 1, 0], [0, 0, -1], [0, -1, 0]]), atol=1e-12
    )


@pytest.mark.parametrize("normal", [(0, 0, -1), (0, 0, 1), (1, 0, 0), (0.1, 0.2, -3), (0, 1e-9, 1), (-1, 1, 1)])
def test_a_frame_is_turned_the_shortest_way(normal):
    frame, out = frame_of(normal), np.array(normal) / np.linalg.norm(normal)
    np.testing.assert_allclose(frame @ [0, 0, -1], out, atol=1e-8)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert (np.trace(frame) - 1) / 2 == pytest.approx(-out[2])  # by no more than the angle between them


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        (
            Dock,
            {"diameter": 0.3, "lights": 4, "angles_deg": (0, 90, 180)},
            "angles_deg has 3 values; the dock has 4 lights",
        ),
        (Dock, {"diameter": 0.3, "angles_deg": (0, 90, 360)}, "two lights at 0 degrees"),
        (Dock, {"diameter": 0.3, "angles_deg": (0, 90, math.nan)}, r"angles_deg\[2\] is nan"),
        (Dock, {"diameter": 0.3, "lights": 3, "colours": ("red", "white", "pink")}, r"colours\[2\] is 'pink'"),
        (Dock, {"diameter": 0.3, "angles_deg": (0, 90)}, "lights is 2"),
        (Dock, {"rings": (FAR, FAR)}, "rings are called 'far', 'far'"),
        (Dock, {"rings": (FAR, NEAR), "diameter": 0.16}, "diameter is 0.16; it must be that of the largest ring, 0.9"),
        (Dock, {}, "diameter_m is missing"),
        (DockRing, {"diameter": 0.3, "name": "far"}, "lights of the ring 'far' is None"),
        (DockRing, {"diameter": 0.3, "name": "", "lights": 5}, "name is empty"),
        (DockRing, {"diameter": 0.3, "name": "far", "lights": 5, "normal": (0, 0, 0)}, "normal is"),
    ],
)
def test_impossible_docks_and_rings_are_named(kind, values, message):
    with pytest.raises(ValueError, match=message):
        kind(**values)
