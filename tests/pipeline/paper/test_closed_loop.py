import functools
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
        truth = truth_of(draw_approach(5, number).scene)
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
    monkeypatch.setattr(closed_loop, "RANGE_M", (2.0, 2.0))
    monkeypatch.setattr(closed_loop, "TILT_DEG", (25.0, 25.0))
    monkeypatch.setattr(closed_loop, "FRAMES", 3)
    for number in (0, 2):  # by the coin, Table 1 begins with the second candidate, and with the first
        course = run_approach(3, number, rule)
        assert course.range_m == pytest.approx(2.0)
        assert course.tilt_deg == pytest.approx(25.0)
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


by_the_letter = functools.partial(choose_by_table, literal=True)
LEFT, RIGHT = pose(-0.3), pose(0.3)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize(("second", "kept"), [(0.29, True), (0.30, False), (0.31, False)])
def test_an_eccentricity_that_falls_keeps_the_orientation_whatever_its_index(first, second, kept):
    one = choose_by_table([LEFT, RIGHT], 0.30, first=first)
    for candidates, index in (([LEFT, RIGHT], first), ([RIGHT, LEFT], 1 - first)):
        two = choose_by_table(candidates, second, one)
        assert (one.selected, two.selected, two.frame) == (first, index if kept else 1 - index, 2)


def test_from_the_third_frame_on_only_the_nearest_counts():
    state = choose_by_table([LEFT, RIGHT], 0.30)
    for candidates, eccentricity, expected in (
        ([LEFT, RIGHT], 0.29, 0),
        ([RIGHT, pose(-0.25)], 0.50, 1),  # the eccentricity plays no part any more
        ([pose(-0.2, 0.1), pose(0.2, 0.1)], 0.60, 0),
    ):
        state = choose_by_table(candidates, eccentricity, state)
        assert state.selected == expected


# Two docks' candidates: tilted to the left or to the right, and with theta_x of +17.5 or -17.5 degrees beside that.
UP, DOWN = pose(0.0, 0.3), pose(0.0, -0.3)


@pytest.mark.parametrize(("second", "literal", "ours"), [(0.29, 0, 0), (0.30, 0, 1), (0.31, 1, 1)])
def test_by_the_letter_an_eccentricity_that_stays_keeps_the_orientation(second, literal, ours):
    for choose, expected in ((by_the_letter, literal), (choose_by_table, ours)):
        one = choose([UP, DOWN], 0.30, first=0)
        two = choose([UP, DOWN], second, one)
        assert (one.selected, two.selected, two.frame) == (0, expected, 2)


def test_by_the_letter_theta_y_does_not_count():
    # The first choice is (0.3, 0.1), of which in frame 2 theta_x is nearer to that of a pose on the other side.
    one_pair, two_pair = [pose(0.3, 0.1), pose(-0.3, 0.0)], [pose(0.3, 0.2), pose(-0.3, 0.11)]
    literal = by_the_letter(two_pair, 0.2, by_the_letter(one_pair, 0.3))
    ours = choose_by_table(two_pair, 0.2, choose_by_table(one_pair, 0.3))
    assert (literal.selected, ours.selected) == (1, 0)


def test_by_the_letter_the_other_pose_is_the_first_frame_s():
    # e1 < e2: the other one of frame 1 has theta_x -17.5 degrees. After squaring up both poses of frame 2 are above it,
    # and the one nearer to it is nearer to the first choice's normal too, so that ours takes its complement.
    one_pair, two_pair = [pose(0.0, 0.3), pose(0.0, -0.3)], [pose(0.0, 0.5), pose(0.0, 0.1)]
    literal = by_the_letter(two_pair, 0.5, by_the_letter(one_pair, 0.3))
    assert literal.selected == 1
    # From the third frame on the nearest theta_x counts, whatever the eccentricity.
    third = by_the_letter([pose(0.0, -0.2), pose(0.0, 0.2)], 0.9, literal)
    assert (third.selected, third.frame) == (1, 3)
