import cv2
import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.false_rings import goes_on, nearest_of, repeating
from dockpose.lights.polygon import find_polygons
from scipy.spatial import KDTree

from tests.pipeline.lights.test_ring import CAMERA, lights, ring_of, scene_of, text

MIDDLE = np.array([CAMERA.cx, CAMERA.cy])


@pytest.mark.parametrize("most", [1, 9])
def test_the_nearest_of_others_are_those_of_a_tree(most):
    points, others = np.random.default_rng(most).uniform(0, 100, (2, 50, 2))
    off, which = nearest_of(points, others, most)
    expected = KDTree(others).query(points, k=np.arange(1, most + 1))
    np.testing.assert_allclose(off, expected[0])
    np.testing.assert_array_equal(which, expected[1])


def lattice(kind, turned_rad=0.0, step_px=30.0):
    """Points of a square or hexagonal lattice that fill the picture, each at the pixel it falls on."""
    i, j = np.mgrid[-60:61, -60:61]
    skew, tall = {"square": (0.0, 1.0), "hexagonal": (0.5, np.sqrt(0.75))}[kind]
    points = step_px * np.column_stack([(i + skew * (j % 2)).ravel(), tall * j.ravel()])
    c, s = np.cos(turned_rad), np.sin(turned_rad)
    points = np.rint(points @ [[c, s], [-s, c]] + MIDDLE)
    return points[((points > 5) & (points < [635, 475])).all(axis=1)]


def lamp_grid(rng, rows=4, columns=6):
    """Lamps in rows and columns in perspective, up to one in five of them dark."""
    corners = np.array([[0, 0], [columns - 1, 0], [columns - 1, rows - 1], [0, rows - 1]], np.float32)
    seen = np.array([[80, 80], [560, 80], [560, 400], [80, 400]]) + rng.uniform(-50, 50, (4, 2))
    places = np.array([[[x, y]] for x in range(columns) for y in range(rows)], np.float32)
    points = cv2.perspectiveTransform(places, cv2.getPerspectiveTransform(corners, seen.astype(np.float32)))[:, 0]
    return points[rng.random(len(points)) > rng.choice([0.0, 0.2])].astype(float) + rng.normal(0, 0.2, (1, 2))


@pytest.mark.parametrize("count", [4, 5, 6, 8, 10, None])
@pytest.mark.parametrize("turned_rad", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["square", "hexagonal"])
def test_a_lattice_is_no_ring_and_says_so(kind, turned_rad, count):
    ring = ring_of(lattice(kind, turned_rad), count)
    assert not ring.found
    assert "repeat as in a lattice" in ring.reason


@pytest.mark.parametrize("count", [6, None])
def test_six_of_a_few_lamps_in_rows_are_no_ring(count):
    # Each point of a lattice has six about it, (1, 0), (0, 1), (-1, 1) and their opposites, that a hexagon's image runs
    # through: beside other lamps, as a digit of a display.
    steps = np.array([[0, 0], [1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1], [1, 1], [-2, 1]])
    digit = np.array([300.0, 200.0]) + steps @ np.array([[8.0, 0.1], [-0.3, 7.5]])
    elsewhere = np.random.default_rng(5).uniform([20, 300], [620, 470], (60, 2))
    assert not ring_of(np.vstack([digit, elsewhere]), count).found


@pytest.mark.parametrize("count", [6, None])
def test_a_ring_of_six_about_a_lamp_is_found(count):
    ours = lights(6, z_m=1.0, angles=(0.2, 0.3))
    points = np.vstack([ours, ours.mean(axis=0), ours[0] + [60, 10], ours[3] - [80, 30]])
    assert np.flatnonzero(ring_of(points, count).on_ring).tolist() == list(range(6))


@pytest.mark.slow
@pytest.mark.parametrize("count", [4, 6, 8, 10, None])
def test_lamps_in_rows_and_columns_are_no_ring(count):
    grids = [lamp_grid(np.random.default_rng(seed)) for seed in range(20)]
    assert not any(ring_of(grid, count).found for grid in grids)


@pytest.mark.parametrize("count", [10, None])
@pytest.mark.parametrize("seed", range(5))
def test_a_dock_in_front_of_a_lattice_is_found(seed, count):
    rng = np.random.default_rng(seed)
    ours = lights(z_m=rng.uniform(0.7, 1.1), angles=rng.uniform(-0.4, 0.4, 2), roll=rng.uniform(0, 1))
    behind = lattice("square", rng.uniform(0, 1), 40.0)
    behind = behind[np.linalg.norm(behind[:, None] - ours, axis=2).min(axis=1) > 10]
    ring = ring_of(np.vstack([behind, ours]), count)
    assert np.flatnonzero(ring.on_ring).tolist() == list(range(len(behind), len(behind) + 10))


def test_what_forms_no_lattice_is_not_taken_for_one():
    rng = np.random.default_rng(0)
    strewn = [rng.uniform(0, [640, 480], (count, 2)) for count in (41, 80, 150, 400)]
    crowded = [rng.normal([320, 240], 60, (count, 2)) for count in (41, 150)]
    many = [np.vstack([lights(count, z_m=z_m), text()]) for count in (24, 48) for z_m in (0.5, 3.0)]
    lines = [np.vstack([text(20.0, top, 50) for top in (40.0, 120.0, 300.0)])]
    for points in (*strewn, *crowded, *many, *lines):
        assert not repeating(points).any()


@pytest.mark.parametrize("count", [4, 6, 10])
def test_rings_among_strays_do_not_go_on_beyond_themselves(count):
    unit = Dock(2.0, count).light_points()[:, :2]
    for seed in range(60):
        rng = np.random.default_rng([8, seed])
        ours = lights(count, z_m=rng.uniform(0.6, 1.5), angles=rng.uniform(-0.5, 0.5, 2))
        points = np.vstack([ours, rng.uniform(0, [640, 480], (30, 2))]) - MIDDLE
        polygons = [ring.polygon for ring in find_polygons(scene_of(ours - MIDDLE), [unit])]
        whole = max(polygons, key=lambda polygon: len(polygon.members))
        assert len(whole.members) == count
        assert not goes_on(whole, unit, points, 1.5)


@pytest.mark.parametrize("beyond", [0, 3, 7])
def test_lights_off_their_places_in_a_gap_of_a_ring_are_no_string(beyond):
    ours = lights(60, z_m=0.7)
    middle = ours.mean(axis=0)
    gap = list(range(10, 14 + beyond))
    moved = ours.copy()
    moved[gap] += 0.05 * (moved[gap] - middle)
    assert np.flatnonzero(ring_of(moved, 60).on_ring).tolist() == [k for k in range(60) if k not in gap]


def test_a_lamp_beside_one_that_is_missing_is_no_string():
    ours, whole = lights(12, missing=(4,)), lights(12)
    beside = whole[4] + 0.15 * (whole[4] - whole.mean(axis=0))
    assert ring_of(np.vstack([ours, beside]), 12).on_ring.tolist() == [True] * 11 + [False]


def test_nine_points_are_a_lattice_and_eight_are_too_few():
    nine = 30.0 * np.argwhere(np.ones((3, 3)))
    assert repeating(nine).all()
    assert not repeating(nine[:8]).any()
