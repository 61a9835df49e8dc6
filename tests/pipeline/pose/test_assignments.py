import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.assignments import assignments, squares_of
from scipy.spatial.transform import Rotation

EVEN = Dock(1.0, lights=6)
KNOWN = Dock(1.0, lights=5, angles_deg=(0.0, 100.0, 40.0, 200.0, 290.0))


def test_of_an_even_dock_the_first_light_is_any_and_the_others_follow_around_it():
    assert assignments(5, EVEN).tolist() == [[0, *(k for k in range(1, 6) if k != left)] for left in (5, 4, 3, 2, 1)]


def test_of_known_angles_each_may_be_first_in_the_order_of_the_angles():
    rows = assignments(4, KNOWN).tolist()
    assert len(rows) == 5 * math.comb(4, 3)
    around = [0, 2, 1, 3, 4]  # by their angles
    for row in rows:
        places = [around.index(light) for light in row]
        assert all((b - a) % 5 < (c - a) % 5 for a, b, c in zip([places[0]] * 2, places[1:], places[2:], strict=False))
    assert len({tuple(row) for row in rows}) == len(rows)


def test_more_assignments_than_can_be_told_apart_are_refused():
    # Of 13 even lights the other two are 66 pairs, of 14 they are 78: 70 is the limit; of more lights 20 000.
    assert len(assignments(3, Dock(1.0, lights=13))) == 66
    with pytest.raises(NoEllipseError, match="3 of 14 lights"):
        assignments(3, Dock(1.0, lights=14))
    assert len(assignments(5, Dock(1.0, lights=26))) == 12650
    with pytest.raises(NoEllipseError, match="5 of 30 lights"):
        assignments(5, Dock(1.0, lights=30))


def seen(dock, which, rotvec=(0.5, -0.3, 0.2), t=(0.3, 0.2, 4.0)):
    """Tangents of lights on a circle of radius 1."""
    angles = dock.light_angles_rad()[which]
    lights = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    there = lights @ Rotation.from_rotvec(rotvec).as_matrix().T + t
    return there[:, :2] / there[:, 2:]


SLOPES_PX = np.array([[[700.0, 20.0], [0.0, 800.0]]])


@pytest.mark.parametrize("which", [[0, 2, 1, 4], [2, 1, 3, 4], [0, 2, 1, 3, 4]])
def test_the_true_assignment_explains_points_and_no_other_does(which):
    squares = squares_of(KNOWN, seen(KNOWN, which), SLOPES_PX)
    rows = assignments(len(which), KNOWN)
    best = int(np.argmin(squares))
    assert rows[best].tolist() == which
    assert squares[best] < 1e-6
    assert np.sort(squares)[1] > 1


def test_points_that_no_convex_picture_shows_explain_nothing():
    crossed = seen(KNOWN, [0, 2, 1, 4])[[0, 2, 1, 3]]
    assert np.isinf(squares_of(KNOWN, crossed, SLOPES_PX)).all()
    line = np.column_stack([np.arange(4.0), np.arange(4.0)])
    assert np.isinf(squares_of(KNOWN, line, SLOPES_PX)).all()
