import itertools
import math

import numpy as np
import pytest
from dockpose.paper import closed_loop
from dockpose.paper.closed_loop import RULES, choose_by_table, draw_approach, run_approach
from dockpose.pose.circle import CirclePose
from dockpose.simulate import truth_of


def test_drawn_approaches_start_where_they_should():
    for number in range(40):
        truth = truth_of(draw_approach(5, number)[0])
        range_m = float(np.linalg.norm(truth.position_m))
        tilt_deg = math.degrees(math.acos(-truth.normal @ truth.position_m / range_m))
        assert closed_loop.RANGE_M[0] <= range_m <= closed_loop.RANGE_M[1]
        assert closed_loop.TILT_DEG[0] - 1e-6 <= tilt_deg <= closed_loop.TILT_DEG[1] + 1e-6
        assert truth.visible.all()


@pytest.mark.slow
@pytest.mark.parametrize("rule", RULES)
def test_a_near_and_tilted_dock_is_decided_in_the_second_frame(rule, monkeypatch):
    # 25 degrees, 2 m, one step of 0.2 m: the eccentricity changes by several hundredths, and is known to some
    # thousandths, so that any rule is right in frame 2.
    for name, value in (("RANGE_M", (2.0, 2.0)), ("TILT_DEG", (25.0, 25.0)), ("FRAMES", 3)):
        monkeypatch.setattr(closed_loop, name, value)
    for number in (0, 2):  # by the coin, Table 1 begins with the second candidate, and with the first
        course = run_approach(3, number, rule)
        assert (course.range_m, course.off_axis_deg[0]) == pytest.approx((2.0, 25.0))
        assert course.right[1]
        assert len(course.right) == len(course.off_axis_deg) == 3
        if rule in ("tracker", "frame"):
            assert course.off_axis_deg[2] < course.off_axis_deg[0] - 5


def test_a_vehicle_that_passes_the_dock_has_no_more_frames(monkeypatch):
    def short(plan, observe):
        yield from itertools.islice(film(plan, observe), 2)
        raise ValueError("position_m z is -0.1")

    film = closed_loop.film
    monkeypatch.setattr(closed_loop, "FRAMES", 4)
    monkeypatch.setattr(closed_loop, "film", short)
    course = run_approach(3, 0, "frame")
    assert course.right[2:].tolist() == [False, False]
    assert course.off_axis_deg[1] == course.off_axis_deg[2] == course.off_axis_deg[3]


def pose(x, y=0.0):
    return CirclePose(np.array([0.0, 0.0, 2.0]), np.array([x, y, -np.sqrt(1 - x * x - y * y)]), np.zeros(2))


# Two docks' candidates: tilted to the left or to the right, and with theta_x of +17.5 or -17.5 degrees.
SIDES, UP_AND_DOWN = [pose(-0.3), pose(0.3)], [pose(0.0, 0.3), pose(0.0, -0.3)]


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize(("second", "ours", "literal"), [(0.29, True, True), (0.30, False, True), (0.31, False, False)])
def test_an_eccentricity_that_falls_keeps_the_orientation_whatever_its_index(first, second, ours, literal):
    for pair, by_the_letter, kept in ((SIDES, False, ours), (UP_AND_DOWN, False, ours), (UP_AND_DOWN, True, literal)):
        one = choose_by_table(pair, 0.30, first=first, literal=by_the_letter)
        for candidates, index in ((pair, first), (pair[::-1], 1 - first)):
            two = choose_by_table(candidates, second, one, literal=by_the_letter)
            assert (one.selected, two.selected, two.frame) == (first, index if kept else 1 - index, 2)


def test_from_the_third_frame_on_only_the_nearest_counts():
    state = choose_by_table(SIDES, 0.30)
    for candidates, eccentricity, expected in (
        (SIDES, 0.29, 0),
        ([SIDES[1], pose(-0.25)], 0.50, 1),  # the eccentricity plays no part any more
        ([pose(-0.2, 0.1), pose(0.2, 0.1)], 0.60, 0),
    ):
        state = choose_by_table(candidates, eccentricity, state)
        assert state.selected == expected


@pytest.mark.parametrize(
    ("eccentricities", "pairs", "literal", "ours"),
    [
        # theta_y does not count: the first choice is (0.3, 0.1), of which in frame 2 theta_x is nearer to that of a
        # pose on the other side.
        ((0.3, 0.2), ([pose(0.3, 0.1), pose(-0.3)], [pose(0.3, 0.2), pose(-0.3, 0.11)]), [0, 1], [0, 0]),
        # The other pose is the first frame's, with theta_x -17.5 degrees: after squaring up both of frame 2 are above
        # it, and the one nearer to it is nearer to the first choice's normal too, so that ours takes its complement.
        # From the third frame on the nearest counts, whatever the eccentricity.
        (
            (0.3, 0.5, 0.9),
            (UP_AND_DOWN, [pose(0.0, 0.5), pose(0.0, 0.1)], [pose(0.0, -0.2), pose(0.0, 0.2)]),
            [0, 1, 1],
            [0, 0, 1],
        ),
    ],
)
def test_by_the_letter_theta_x_counts_alone(eccentricities, pairs, literal, ours):
    for by_the_letter, expected in ((True, literal), (False, ours)):
        state, selected = None, []
        for candidates, eccentricity in zip(pairs, eccentricities, strict=True):
            state = choose_by_table(candidates, eccentricity, state, literal=by_the_letter)
            selected.append(state.selected)
        assert selected == expected
