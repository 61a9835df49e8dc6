# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import math

import msgspec
import numpy as np
import pytest
from dockpose import estimate
from dockpose import simulate as sim
from dockpose.files import FileError
from dockpose.pose.circle import CirclePose
from dockpose.simulate.files import TRUTH_COLUMNS, truth_row
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.sequence import scenes, steer

from tests.support.scenes import CAMERA, DOCK

TILTED = sim.Pose(position_m=(0.3, 0.1, 2.5), theta_x_deg=15.0, theta_y_deg=30.0, roll_deg=5.0)
SCENE = sim.Scene(camera=CAMERA, dock=DOCK, pose=TILTED, lights=sim.Lights(level=4000.0), seed=3)


def positions(motion, scene=SCENE):
    return np.array([each.pose.position_m for _, each in scenes(sim.FilmPlan(scene=scene, motion=motion))])


def attitudes(motion, scene=SCENE):
    poses = [each.pose for _, each in scenes(sim.FilmPlan(scene=scene, motion=motion))]
    return np.array([(pose.theta_x_deg, pose.theta_y_deg, pose.roll_deg) for pose in poses])


def test_an_approach_closes_in_evenly_and_keeps_the_dock_in_its_place():
    motion = sim.Approach(frames=20)
    path = positions(motion)
    np.testing.assert_allclose(path[:, 2], np.linspace(20, 1, 20))
    assert (attitudes(motion) == [15, 30, 5]).all()
    for position in path:  # 700 px * 0.3 / 2.5, on the same ray throughout
        np.testing.assert_allclose(CAMERA.project(position[None])[0], [319.5 + 84, 239.5 + 28])
    assert positions(sim.Approach(frames=3, start_m=6.0, end_m=2.0))[:, 2].tolist() == pytest.approx([6, 4, 2])


def test_a_sweep_passes_the_dock_from_out_of_view_to_out_of_view():
    path = positions(sim.Sweep(frames=5, reach_m=4.0, angle_deg=90.0))
    np.testing.assert_allclose(path, [[0.3, 0.1 + y, 2.5] for y in (-4, -2, 0, 2, 4)])
    frames = list(sim.film(sim.FilmPlan(scene=SCENE, motion=sim.Sweep(frames=5, reach_m=4.0))))
    assert [frame.truth.visible.sum() for frame in frames] == [0, 0, 10, 0, 0]
    assert frames[0].image.max() < 40  # a valid, empty picture


def test_currents_carry_a_hovering_vehicle_as_far_as_was_asked():
    # The spread over many seeds; 300 draws know a standard deviation to 4 %, of which three are allowed.
    hover = sim.Hover(frames=1, drift_m=0.05, drift_deg=0.0)
    ends = np.array([positions(hover, msgspec.structs.replace(SCENE, seed=seed))[0] for seed in range(300)])
    np.testing.assert_allclose(ends.std(axis=0), 0.05, rtol=0.13)
    turning = sim.Hover(frames=1, drift_m=0.0, drift_deg=2.0)
    square = msgspec.structs.replace(SCENE, pose=sim.Pose(position_m=(0.0, 0.0, 1.0)))
    angles = np.array([attitudes(turning, msgspec.structs.replace(square, seed=seed))[0] for seed in range(300)])
    np.testing.assert_allclose(angles.std(axis=0), 2, rtol=0.13)


def test_a_turning_vehicle_sees_the_dock_go_round_it():
    path = positions(sim.Hover(frames=30, drift_m=0.0, drift_deg=3.0))
    np.testing.assert_allclose(np.linalg.norm(path, axis=1), np.linalg.norm(TILTED.position_m))
    assert np.ptp(path[:, 0]) > 0.02


def test_currents_are_smooth():
    # No swing is quicker than drift_time_s, so that the speed stays below 2 pi sqrt(2 K) drift_m / drift_time_s.
    path = positions(sim.Hover(frames=500, rate_hz=100.0, drift_m=0.03, drift_deg=0.0, drift_time_s=2.0))
    speed = np.diff(path, axis=0) * 100
    assert np.abs(speed).max() < 2 * math.pi * math.sqrt(12) * 0.03 / 2
    assert np.abs(np.diff(speed, axis=0)).max() < 0.02
    assert np.ptp(path, axis=0).min() > 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    "motion", [sim.Approach(frames=3, drift_m=0.02), sim.Sweep(frames=3), sim.Hover(frames=3), None]
)
def test_the_same_seed_gives_the_same_bytes_and_another_other_ones(motion):
    def pictures(seed):
        return [frame.image.tobytes() for frame in sim.film(sim.FilmPlan(scene=SCENE, motion=motion).with_seed(seed))]

    once = pictures(3)
    assert once == pictures(3)
    assert len({*once, *pictures(4)}) == 2 * len(once)  # all different: each picture has its own noise


def test_without_a_motion_the_only_picture_is_the_scene_itself():
    (frame,) = sim.film(sim.FilmPlan(scene=SCENE))
    assert frame.image.tobytes() == sim.render(SCENE)[0].tobytes()
    still = list(sim.film(sim.FilmPlan(scene=SCENE).with_frames(2)))
    assert [each.scene.pose for each in still] == [SCENE.pose, SCENE.pose]
    assert still[0].image.tobytes() == frame.image.tobytes()
    assert still[1].image.tobytes() != frame.image.tobytes()


def test_the_truth_of_each_frame_is_that_of_its_scene():
    for frame in sim.film(sim.FilmPlan(scene=SCENE, motion=sim.Hover(frames=3))):
        truth = sim.truth_of(frame.scene)
        row = truth_row(frame)
        assert tuple(row) == TRUTH_COLUMNS
        assert (row["x_m"], row["y_m"], row["z_m"]) == pytest.approx(tuple(truth.position_m))
        assert row["visible_lights"] == 10
        assert (row["centre_x_px"], row["centre_y_px"]) == pytest.approx(tuple(truth.centre_px))


def steered(scene=SCENE, *, wrong=False, frames=45, **values):
    """Frames of a closed loop whose estimator is ours, or takes the unlikelier of the two poses each time."""

    def observe(image, camera):
        choice = estimate(image, camera, DOCK).choice
        return None if choice is None else choice.candidates[1 if wrong else 0]

    motion = sim.ClosedLoop(frames=frames, rate_hz=3.0, **values)
    return list(sim.film(sim.FilmPlan(scene=scene, motion=motion), observe))


def off_axis_deg(frame):
    """Angle between the dock's axis and the line to the camera."""
    position = frame.truth.position_m
    return math.degrees(math.acos(-frame.truth.normal @ position / np.linalg.norm(position)))


@pytest.mark.slow
def test_a_steered_vehicle_squares_up_and_closes_in():
    frames = steered()
    eccentricity = [frame.truth.ellipse.eccentricity for frame in frames[:12]]
    assert (np.diff(eccentricity) < 0).all()  # Table 1 of the paper: it falls while the vehicle squares up
    end = frames[-1]
    np.testing.assert_allclose(end.truth.position_m, [0, 0, 1], atol=0.02)
    assert off_axis_deg(frames[0]) > 25
    assert off_axis_deg(end) < 1
    assert all(frame.observed is not None for frame in frames)


def test_a_vehicle_that_believes_the_wrong_pose_turns_the_wrong_way():
    frames = steered(wrong=True, frames=12)
    eccentricity = [frame.truth.ellipse.eccentricity for frame in frames]
    assert (np.diff(eccentricity) > 0).all()
    assert off_axis_deg(frames[-1]) > off_axis_deg(frames[0]) + 10


def test_a_vehicle_that_sees_nothing_stays_where_it_is():
    motion = sim.ClosedLoop(frames=4)
    frames = list(sim.film(sim.FilmPlan(scene=SCENE, motion=motion), lambda image, camera: None))
    assert {frame.scene.pose for frame in frames} == {SCENE.pose}
    drifting = msgspec.structs.replace(motion, drift_m=0.05)
    frames = list(sim.film(sim.FilmPlan(scene=SCENE, motion=drifting), lambda image, camera: None))
    assert len({frame.scene.pose for frame in frames}) == 4


def test_steering_by_hand():
    # Square on, 3 m ahead: straight on at full speed. 0.3 m/s at 10 Hz are 3 cm.
    ahead = CirclePose(np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2))
    travel, turn = steer(ahead, sim.ClosedLoop())
    np.testing.assert_allclose(travel, [0, 0, 0.03], atol=1e-12)
    np.testing.assert_allclose(turn, np.eye(3), atol=1e-12)
    # Arrived: nothing more to do. Too near: back.
    near = CirclePose(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), np.zeros(2))
    np.testing.assert_allclose(steer(near, sim.ClosedLoop())[0], 0, atol=1e-12)
    assert steer(near, sim.ClosedLoop(end_m=1.5))[0][2] == pytest.approx(-0.03)
    # To the right: turn right, at most 20 degrees a second.
    right = CirclePose(np.array([2.0, 0.0, 2.0]), np.array([-0.5, 0.0, -0.5]) * math.sqrt(2), np.zeros(2))
    _, turn = steer(right, sim.ClosedLoop())
    np.testing.assert_allclose(turn[:, 2], [math.sin(math.radians(2)), 0, math.cos(math.radians(2))], atol=1e-12)
    # Facing left of us: its axis passes on our left, so go left.
    turned = CirclePose(np.array([0.0, 0.0, 3.0]), np.array([-0.6, 0.0, -0.8]), np.zeros(2))
    assert steer(turned, sim.ClosedLoop())[0][0] < -0.02


def test_a_scene_file_may_have_a_motion(tmp_path):
    path = tmp_path / "s.yaml"
    for motion in (sim.Approach(frames=7, end_m=2.0), sim.Sweep(reach_m=0.5), sim.Hover(), sim.ClosedLoop(end_m=1.2)):
        sequence = sim.FilmPlan(scene=SCENE, motion=motion)
        sim.save_sequence(sequence, path)
        assert sim.load_sequence(path) == sequence
        with pytest.raises(FileError, match="has a motion"):
            sim.load_scene(path)
    sim.save_sequence(sim.FilmPlan(scene=SCENE), path)
    assert sim.load_scene(path) == SCENE


def test_what_cannot_be_filmed_is_told():
    with pytest.raises(ValueError, match="observe is None"):
        next(sim.film(sim.FilmPlan(scene=SCENE, motion=sim.ClosedLoop())))
    with pytest.raises(ValueError, match="closed loop"):
        next(scenes(sim.FilmPlan(scene=SCENE, motion=sim.ClosedLoop())))
    through = sim.FilmPlan(scene=SCENE, motion=sim.Hover(drift_m=50.0))
    with pytest.raises(ValueError, match="position_m z is -"):
        list(scenes(through))
    far = sim.FilmPlan(
        scene=msgspec.structs.replace(SCENE, psf=Psf(model="hou", theta0_rad=0.3)), motion=sim.Approach()
    )
    with pytest.raises(ValueError, match="distance_m is 20"):
        next(sim.film(far))
