import itertools
import math

import numpy as np
import pytest
from dockpose.paper import closed_loop
from dockpose.paper.closed_loop import RULES, draw_approach, run_approach
from dockpose.simulate import truth_of


def test_drawn_approaches_start_where_they_should():
    for number in range(40):
        truth = truth_of(draw_approach(5, number).scene)
        range_m = float(np.linalg.norm(truth.position_m))
        tilt_deg = math.degrees(math.acos(-truth.normal @ truth.position_m / range_m))
        assert closed_loop.RANGE_M[0] <= range_m <= closed_loop.RANGE_M[1]
        assert closed_loop.TILT_DEG[0] - 1e-6 <= tilt_deg <= closed_loop.TILT_DEG[1] + 1e-6
        assert truth.visible.all()


@pytest.mark.parametrize("rule", RULES)
def test_a_near_and_tilted_dock_is_decided_in_the_second_frame(rule, monkeypatch):
    # 25 degrees, 2 m, one step of 0.2 m: the eccentricity changes by several hundredths, and is known to some
    # thousandths, so that any rule is right in frame 2.
    monkeypatch.setattr(closed_loop, "RANGE_M", (2.0, 2.0))
    monkeypatch.setattr(closed_loop, "TILT_DEG", (25.0, 25.0))
    monkeypatch.setattr(closed_loop, "FRAMES", 3)
    for number in range(2):
        course = run_approach(3, number, rule)
        assert course.range_m == pytest.approx(2.0)
        assert course.tilt_deg == pytest.approx(25.0)
        assert course.seen.all()
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
    assert course.seen.tolist() == [True, True, False, False]
    assert course.right[2:].tolist() == [False, False]
    assert course.off_axis_deg[1] == course.off_axis_deg[2] == course.off_axis_deg[3]
    assert not course.ends_right
