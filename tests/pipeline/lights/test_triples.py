import numpy as np
import pytest
from dockpose.lights.reprojection import RingTemplate
from dockpose.lights.triples import judges_of, promising, steps_of

AFFINE = np.array([[80.0, 15.0], [-10.0, 50.0]])  # a circle's picture without perspective
MIDDLE = np.array([30.0, -20.0])


def corners_of(sides, roll=0.2):
    angles = roll + 2 * np.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(angles), np.sin(angles)])


def test_steps_of_few_points_are_all_and_those_of_many_are_four():
    assert steps_of(10, False)[0].tolist() == [[1, 1], [2, 2], [1, 2], [2, 1]]
    # Of a square and a triangle some do not go around: the last step must be left.
    assert steps_of(4, False)[0].tolist() == [[1, 1], [1, 2], [2, 1]]
    assert steps_of(3, False)[0].tolist() == [[1, 1]]
    # Of eight and few points: no step is larger than the one that closes the ring.
    assert sorted(map(tuple, steps_of(8, True)[0])) == [
        (1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3), (3, 1), (3, 2)
    ]  # fmt: skip


def test_a_triple_is_judged_by_the_corners_next_to_it_or_of_few_points_by_all():
    _, beyond = steps_of(12, False)
    assert beyond[0].tolist()[:4] == [11, 3, 10, 4]
    assert beyond[1].tolist()[:4] == [11, 5, 10, 6]
    assert not beyond[:, 4:].any()
    # Of five corners two are left over, which both ways reach.
    assert sorted(set(steps_of(5, False)[1][0]) - {0}) == [3, 4]
    assert steps_of(6, True)[1][0].tolist() == [3, 4, 5, 0]


@pytest.mark.parametrize("firsts", [1, 6])
def test_weights_lead_from_two_corners_to_the_others_and_to_the_ellipse(firsts):
    unit = corners_of(6)
    steps, beyond = steps_of(6, False)
    judges = judges_of(unit, steps, beyond, firsts)
    assert len(judges.corners) == firsts * len(steps)
    places = unit @ AFFINE.T + MIDDLE
    for row, (first, second, third) in enumerate(judges.corners):
        step, start = divmod(row, firsts)
        assert judges.steps[row].tolist() == steps[step].tolist()
        assert (first, second, third) == (start, (start + steps[step][0]) % 6, (start + steps[step].sum()) % 6)
        both = np.column_stack([places[first] - places[second], places[third] - places[second]])
        # The first two weights make the ellipse's conjugate axes of both, the others the corners that judge.
        np.testing.assert_allclose(judges.weights[row, :2] @ both.T, AFFINE.T, atol=1e-9)
        for k, ahead in enumerate(beyond[step]):
            if ahead:
                expected = places[(start + ahead) % 6] - places[second]
                np.testing.assert_allclose(both @ judges.weights[row, 2 + k], expected, atol=1e-9)
                is_next = ahead in (5, (steps[step].sum() + 1) % 6)
                assert judges.within[row, k] == (0.2 if is_next else 0.35)


def best_of(points, sides=8, kept_of=3, even=True, firsts=1, focal_px=1e4):
    unit = corners_of(sides)
    judges = judges_of(unit, *steps_of(sides, False), firsts)
    near = np.array([[k for k in range(len(points)) if k != row] for row in range(len(points))])
    best, kept = np.full(kept_of, -1.0), np.full((kept_of, 7), -1)
    template = RingTemplate(np.ascontiguousarray(points), unit, focal_px, 1.5)
    promising(template, np.arange(len(points)), near, judges, even, best, kept, np.empty((5, near.shape[1])))
    order = np.argsort(-best)
    return best[order], kept[order]


def test_a_whole_ring_predicts_every_corner_as_exactly_as_counts():
    best, kept = best_of(corners_of(8) @ AFFINE.T + MIDDLE)
    # Four corners, of which each counts 1 and the logarithm of how much nearer it is than it need be, at .03 spacings.
    assert best[0] == pytest.approx(4 + 2 * np.log(0.2 / 0.03) + 2 * np.log(0.35 / 0.03))
    for *three, first, second, third, sides in kept:
        assert sides == 8
        assert (second - first, third - second) in {(1, 1), (2, 2), (1, 2), (2, 1)}
        around = np.diff(three) % 8
        assert around.tolist() in ([second - first, third - second], [8 - second + first, 8 - third + second])


def test_a_corner_without_a_point_counts_nothing_and_one_that_is_off_less():
    places = corners_of(8) @ (60 * np.eye(2))  # spaced 45.9 px apart
    of_three = places[:5]  # of the triples one has its next corners both on one side
    most, _ = best_of(of_three)
    assert most[0] == pytest.approx(2 + np.log(0.2 / 0.03) + np.log(0.35 / 0.03))
    none, _ = best_of(places[[0, 1, 2]])
    assert none[0] == 0  # three points may be corners, but predict none


def test_points_in_line_and_tiny_or_narrow_rings_are_no_corners():
    line = np.column_stack([np.arange(6) * 20.0, np.arange(6) * 10.0])
    assert best_of(line, 6)[0][0] == -1
    assert best_of(1.4 * corners_of(6), 6)[0][0] < 3  # a radius of 1.5 px is the least
    assert best_of(1.6 * corners_of(6), 6)[0][0] > 6
    # Seen at 83 degrees a circle is .12 as wide as long, of which two thirds may be noise.
    assert best_of(corners_of(6) * [100, 7.5], 6)[0][0] < 3
    assert best_of(corners_of(6) * [100, 9], 6)[0][0] > 6


def test_uneven_rings_are_sought_one_way_around_from_every_corner():
    angles = 0.2 + np.array([0, 0.5, 1.4, 2.5, 3.3, 4.4, 5.3])
    unit = np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.ascontiguousarray(unit @ AFFINE.T + MIDDLE)
    judges = judges_of(unit, *steps_of(7, False), 7)
    near = np.array([[k for k in range(7) if k != row] for row in range(7)])
    best, kept = np.full(7, -1.0), np.full((7, 7), -1)
    promising(RingTemplate(points, unit, 1e4, 1.5), np.arange(7), near, judges, False, best, kept, np.empty((5, 6)))
    assert (best > 9).all()
    assert (kept[:, :3] == kept[:, 3:6]).all()  # each point is its own corner
    assert set(kept[:, 6]) == {7}
