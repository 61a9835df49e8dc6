import numpy as np
import pytest
from dockpose import estimate
from dockpose.paper.table1 import choose_by_eccentricity, choose_by_theta_x
from dockpose.pose.circle import CirclePose
from dockpose.simulate import ClosedLoop, FilmPlan, Lights, Pose, Scene, film

from tests.support.scenes import CAMERA, DOCK


def pose(x, y=0.0):
    return CirclePose(np.array([0.0, 0.0, 2.0]), np.array([x, y, -np.sqrt(1 - x * x - y * y)]), np.zeros(2))


LEFT, RIGHT = pose(-0.3), pose(0.3)


def test_an_eccentricity_that_falls_keeps_the_orientation():
    one = choose_by_eccentricity([LEFT, RIGHT], 0.30, first=1)
    two = choose_by_eccentricity([LEFT, RIGHT], 0.29, one)
    assert (one.selected, two.selected, two.frame) == (1, 1, 2)


@pytest.mark.parametrize("second", [0.31, 0.30])
def test_one_that_does_not_fall_takes_the_other(second):
    one = choose_by_eccentricity([LEFT, RIGHT], 0.30, first=1)
    assert choose_by_eccentricity([LEFT, RIGHT], second, one).selected == 0


def test_the_orientation_is_followed_whatever_its_index():
    one = choose_by_eccentricity([LEFT, RIGHT], 0.30)
    assert choose_by_eccentricity([RIGHT, LEFT], 0.29, one).selected == 1
    assert choose_by_eccentricity([RIGHT, LEFT], 0.31, one).selected == 0


def test_from_the_third_frame_on_only_the_nearest_counts():
    state = choose_by_eccentricity([LEFT, RIGHT], 0.30)
    for candidates, eccentricity, expected in (
        ([LEFT, RIGHT], 0.29, 0),
        ([RIGHT, pose(-0.25)], 0.50, 1),  # the eccentricity plays no part any more
        ([pose(-0.2, 0.1), pose(0.2, 0.1)], 0.60, 0),
    ):
        state = choose_by_eccentricity(candidates, eccentricity, state)
        assert state.selected == expected


# Two docks' candidates: tilted to the left or to the right, and with theta_x of +17.5 or -17.5 degrees beside that.
UP, DOWN = pose(0.0, 0.3), pose(0.0, -0.3)


@pytest.mark.parametrize(("second", "literal", "ours"), [(0.29, 0, 0), (0.30, 0, 1), (0.31, 1, 1)])
def test_by_the_letter_an_eccentricity_that_stays_keeps_the_orientation(second, literal, ours):
    for choose, expected in ((choose_by_theta_x, literal), (choose_by_eccentricity, ours)):
        one = choose([UP, DOWN], 0.30, first=0)
        two = choose([UP, DOWN], second, one)
        assert (one.selected, two.selected, two.frame) == (0, expected, 2)


def test_by_the_letter_theta_y_does_not_count():
    # The first choice is (0.3, 0.1), of which in frame 2 theta_x is nearer to that of a pose on the other side.
    one_pair, two_pair = [pose(0.3, 0.1), pose(-0.3, 0.0)], [pose(0.3, 0.2), pose(-0.3, 0.11)]
    literal = choose_by_theta_x(two_pair, 0.2, choose_by_theta_x(one_pair, 0.3))
    ours = choose_by_eccentricity(two_pair, 0.2, choose_by_eccentricity(one_pair, 0.3))
    assert (literal.selected, ours.selected) == (1, 0)


def test_by_the_letter_the_other_pose_is_the_first_frame_s():
    # e1 < e2: the other one of frame 1 has theta_x -17.5 degrees. After squaring up both poses of frame 2 are above it,
    # and the one nearer to it is nearer to the first choice's normal too, so that ours takes its complement.
    one_pair, two_pair = [pose(0.0, 0.3), pose(0.0, -0.3)], [pose(0.0, 0.5), pose(0.0, 0.1)]
    literal = choose_by_theta_x(two_pair, 0.5, choose_by_theta_x(one_pair, 0.3))
    assert literal.selected == 1
    # From the third frame on the nearest theta_x counts, whatever the eccentricity.
    third = choose_by_theta_x([pose(0.0, -0.2), pose(0.0, 0.2)], 0.9, literal)
    assert (third.selected, third.frame) == (1, 3)


def closed_loop(seed, *, wrong):
    """Of each frame whether Table 1 chose right, of a vehicle that squares up to what it chooses.

    ``wrong`` begins with the candidate that is not the right one.
    """
    rng = np.random.default_rng([31, seed])
    tilt, around = np.radians(rng.uniform(12, 35)), rng.uniform(0, 2 * np.pi)
    theta_x, theta_y = np.degrees(tilt * np.sin(around)), np.degrees(tilt * np.cos(around))
    x, y, z = 0.1 * rng.uniform(-1, 1), 0.1 * rng.uniform(-1, 1), rng.uniform(1.8, 3.0)
    place = Pose(position_m=(x, y, z), theta_x_deg=theta_x, theta_y_deg=theta_y, roll_deg=rng.uniform(0, 36))
    scene = Scene(camera=CAMERA, dock=DOCK, pose=place, lights=Lights(level=1000.0), seed=seed)
    state, chosen = None, []

    def observe(image, camera):
        nonlocal state
        found = estimate(image, camera, DOCK)
        if found.ellipse is None:
            return None
        first = int(wrong)  # near by the first one, which the spacing prefers, is right
        state = choose_by_eccentricity(found.candidates, found.ellipse.eccentricity, state, first)
        chosen.append(found.candidates)
        return found.candidates[state.selected]

    motion = ClosedLoop(frames=8, rate_hz=3.0)
    right = []
    for frame in film(FilmPlan(scene=scene, motion=motion), observe):
        best = max(chosen[-1], key=lambda pose: pose.normal @ frame.truth.normal)
        right.append(frame.observed is best)
    return right


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("wrong", [False, True])
def test_a_steered_vehicle_finds_the_right_orientation_in_the_second_frame(seed, wrong):
    right = closed_loop(seed, wrong=wrong)
    assert right[0] is not wrong
    assert all(right[1:])
