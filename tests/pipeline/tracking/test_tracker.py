# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportPossiblyUnboundVariable=false
# pyright: reportArgumentType=false, reportOptionalOperand=false, reportOperatorIssue=false

import json
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from dockpose import Dock, Estimate, Settings, Tracker, estimate
from dockpose.lights.ellipse import fit_ellipse
from dockpose.lights.ring import Ring
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.simulate import Approach, ClosedLoop, FilmPlan, Hover, Lights, Pose, Scene, film
from dockpose.simulate.sequence import steer
from dockpose.tracking import NO_TRACK
from dockpose.tracking.tracker import WORTH

from tests.support.scenes import CAMERA, DOCK
from tests.support.two_docks import drawn, follow, lights_m, stays

UNKNOWN = Dock(diameter=0.30)  # how many lights it has is not known
NOTHING = Estimate("no_lights", "No lights.", 640, 480, 8, CAMERA, DOCK, Settings())


def shown(position_m, rotation, *, dock=DOCK, noise_px=0.05, seed=0, rng=None):
    """Estimate of a picture in which the lights of a dock, ten of them, were found where they are, but for noise.

    Where their number is not known they are anywhere on the circle, so that their spacing tells nothing.
    """
    angles = 2 * np.pi * np.arange(10) / 10 + 0.2
    if dock.lights is None:
        angles += 0.26 * np.array([0.0, 1.0, -0.9, 0.3, -0.6, 0.8, -1.0, 0.5, 0.9, -0.4])
    ring = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = CAMERA.project(np.asarray(position_m) + ring @ rotation.T)
    points = points + (rng or np.random.default_rng([seed, 5])).normal(0, noise_px, points.shape)
    ellipse, choice = find_poses(points, CAMERA, dock)
    found = Ring(np.ones(len(points), dtype=bool), "")
    return replace(NOTHING, status="ok", message="", dock=dock, ring=found, ellipse=ellipse, choice=choice)


def facing(theta_x_deg, theta_y_deg):
    return rotation_from_angles(math.radians(theta_x_deg), math.radians(theta_y_deg))


def with_odds(found, first):
    """The same estimate, whose first candidate has this probability."""
    one, other = found.candidates
    candidates = (replace(one, probability=first, rms_px=0.3), replace(other, probability=1 - first, rms_px=0.3))
    return replace(found, choice=replace(found.choice, candidates=candidates))


def is_right(pose, found, normal):
    return pose is max(found.candidates, key=lambda each: float(each.normal @ normal))


# Sequences of estimates.


def test_evidence_adds_up_where_one_frame_is_a_toss():
    # 8 m away, 0.2 px: the spacing alone is right in some 70 % of frames.
    tracker, rotation = Tracker(CAMERA, DOCK), facing(12, -14)
    single, tracked = [], []
    for step in range(120):
        found = shown((0.1, 0.05 + 0.01 * step, 8.0 - 0.03 * step), rotation, noise_px=0.2, seed=step)
        result = tracker.follow(found, 0.1 * step)
        single.append(is_right(found.candidates[0], found, -rotation[:, 2]))
        tracked.append(is_right(result.pose, found, -rotation[:, 2]))
    assert np.mean(single[40:]) < 0.97
    assert np.mean(tracked[40:]) > 0.99
    assert result.track.age == 120
    assert result.track.probability > 0.99


def test_a_wrong_start_heals_and_was_never_certain():
    tracker, rotation = Tracker(CAMERA, DOCK), facing(15, 20)
    right = []
    for step in range(30):
        found = with_odds(shown((0.01 * step, 0.0, 1.5), rotation, seed=step), 0.2 if step < 4 else 0.97)
        result = tracker.follow(found, 0.1 * step)
        right.append(result.selected is found.candidates[0])
        if step < 4:
            assert result.track.probability < 0.99
    assert not any(right[:4])
    assert all(right[8:])
    assert 0.95 < result.track.probability < 0.98  # no surer than frames that share all their errors
    assert result.selected_by == "spacing"


def test_a_frame_that_errs_is_overruled_and_stays_in_the_log_as_it_was():
    tracker, rotation = Tracker(CAMERA, DOCK), facing(15, 20)
    for step in range(20):
        found = shown((0.01 * step, 0.0, 1.5), rotation, seed=step)
        wrong = step == 15
        if wrong:
            one, other = found.candidates
            swapped = (replace(other, probability=0.9), replace(one, probability=0.1))
            found = replace(found, choice=replace(found.choice, candidates=swapped))
        result = tracker.follow(found, 0.1 * step)
        assert is_right(result.pose, found, -rotation[:, 2])
        if wrong:
            assert (result.selected, result.index, result.selected_by) == (found.candidates[1], 1, "tracking")
            line, raw = result.to_dict("a.mp4", 15, 1.5), found.to_dict("a.mp4", 15, 1.5)
            assert set(line) == {*raw, *NO_TRACK}
            assert {name for name in raw if line[name] != raw[name]} == {"selected", "selected_by", "chosen"}
            assert set(line["track"]) == {"probability", "age", "predicted", "lost", "number"}
            json.dumps(line, allow_nan=False)


def test_motion_does_not_choose_a_candidate_that_lies_too_far_off_its_lights():
    tracker, picture = Tracker(CAMERA, DOCK), drawn([(lights_m((0.1, 0.0, 1.5), (0.3, 0.3)), 200, 0.004)], 0)
    found = with_odds(estimate(picture, CAMERA, DOCK), 0.2)
    chosen = [tracker.follow(found, 0.1 * step).index for step in range(10)]
    assert chosen == [1] * 10
    one, other = found.candidates
    far = replace(found, choice=replace(found.choice, candidates=(one, replace(other, rms_px=16.7))))
    assert tracker.follow(far, 1.0).index == 0


@pytest.mark.parametrize("times", [np.arange(40) * 0.1, np.cumsum(np.random.default_rng(2).uniform(0.01, 0.3, 40))])
def test_a_dock_that_is_gone_is_predicted_and_then_lost(times):
    tracker, rotation = Tracker(CAMERA, DOCK, Settings(lost_after_s=0.75)), facing(10, 20)
    for step, time_s in enumerate(times):
        there = np.array([0.05 * time_s, 0.0, 2.0])
        gone = 10 <= step < 30
        result = tracker.follow(NOTHING if gone else shown(there, rotation, seed=step), float(time_s))
        missing_s = time_s - times[9]
        if not gone:
            assert not result.track.predicted
            assert not result.track.lost
            assert result.track.age == (step + 1 if step < 10 else step - 29)
        elif missing_s < 0.75:
            assert result.track.predicted
            assert result.selected is None
            assert result.track.age == step + 1
            np.testing.assert_allclose(result.pose.position_m, there, atol=0.02)
        else:
            assert result.track == type(result.track)(probability=None, age=0, predicted=False, lost=True)
            assert result.pose is None
            assert result.to_dict()["selected"] is None


def test_a_ring_somewhere_else_does_not_continue_the_track():
    tracker, rotation = Tracker(CAMERA, DOCK), facing(10, 20)
    for step in range(30):
        elsewhere = step == 10 or step >= 20
        found = shown((-0.9, 0.3, 4.0) if elsewhere else (0.1, 0.0, 1.5), rotation, seed=step)
        result = tracker.follow(found, 0.1 * step)
        if step in (10, 20):  # one such frame may be a reflection, two that agree begin a new track
            assert result.track.predicted
            assert result.selected is None
            assert result.pose.position_m[2] == pytest.approx(1.5, abs=0.02)
            assert (
                f"predicted by the track alone, the dock is {100 * result.pose.position_m[2]:.1f} cm ahead"
                in result.message
            )
            assert result.to_dict()["message"] == result.message
        else:
            assert result.selected is not None
            assert result.track.age == (step + 1 if step < 20 else step - 19)
            assert result.track.number == (1 if step < 20 else 2)


def test_without_times_frames_are_a_tenth_of_a_second_apart_and_a_film_that_starts_again_is_a_new_track():
    result, timed, untimed = Tracker(CAMERA, DOCK).follow(NOTHING, 0.0), Tracker(CAMERA, DOCK), Tracker(CAMERA, DOCK)
    assert result.track.lost
    assert (result.pose, result.filtered, result.selected, result.track.probability) == (None, None, None, None)
    for step in range(12):
        found = shown((0.1 + 0.01 * step, 0.0, 1.5), facing(10, 20), seed=step)
        one, other = timed.follow(found, 0.1 * step), untimed.follow(found)
        assert one.track.probability == pytest.approx(other.track.probability)
    assert [timed.follow(found, time_s).track.age for time_s in (1.2, 0, 1)] == [13, 1, 2]


def test_a_time_that_comes_after_a_frame_without_one_goes_on_from_the_beginning():
    tracker, found = Tracker(CAMERA, DOCK), shown((0.1, 0.0, 1.5), facing(10, 20))
    assert [tracker.follow(found, time_s).track.age for time_s in (None, 0.5, None, 0.8, 0.7)] == [1, 2, 3, 4, 1]


def test_a_tracks_json_has_what_it_predicted_and_what_it_made_of_the_frame():
    tracker = Tracker(CAMERA, DOCK)
    first, second = (
        tracker.follow(shown((0.1, 0.0, z_m), facing(10, 20)), time_s).to_dict()
        for z_m, time_s in ((1.5, 0.0), (1.4, 0.1))
    )
    assert first["predicted"] is None
    # What was at rest is predicted where it was; what is seen lies nearer to where it is now.
    assert second["predicted"]["position_m"][2] == pytest.approx(1.5, abs=5e-3)
    assert second["filtered"]["position_m"][2] == pytest.approx(1.4, abs=0.03)
    assert first["filtered"]["position_m"][2] == pytest.approx(1.5, abs=5e-3)


def test_a_dock_that_turns_through_square_on_is_followed():
    # The poses coincide on the way; by their motion each goes on to the other side. Then the spacing has the last word.
    tracker = Tracker(CAMERA, DOCK)
    right, chance = [], []
    for step in range(61):
        rotation = facing(0.5, 15 - 0.5 * step)
        found = shown((0.0, 0.0, 1.5), rotation, noise_px=0.1, seed=step)
        result = tracker.follow(found, 0.05 * step)
        right.append(is_right(result.pose, found, -rotation[:, 2]))
        chance.append(result.track.probability)
    assert all(right[:24])
    assert all(right[37:])
    assert min(chance[25:36]) < chance[20]  # some certainty is lost on the way


def sweep(camera_turns, *, noise_px=0.1, seed=0, command=False):
    """Whether the tracker was right at the end, of a dock whose lights tell nothing, and how sure it was.

    The vehicle passes the dock sideways, with or without turning its camera towards it.
    """
    tracker, known = Tracker(CAMERA, UNKNOWN), None
    position, rotation = np.array([-0.5, 0.0, 2.0]), facing(8, -25)
    travel = np.array([-0.02, 0.0, 0.0])
    for step in range(60):
        found = shown(position, rotation, dock=UNKNOWN, noise_px=noise_px, seed=1000 * seed + step)
        assert found.choice.selected_by == "none"
        turn = np.eye(3)
        result = tracker.follow(found, 0.1 * step, known if command else None)
        right = is_right(result.pose, found, -rotation[:, 2])
        if camera_turns:
            turn = cv2.Rodrigues(np.array([0.0, 0.8 * math.atan2(-travel[0], position[2]), 0.0]))[0]
        position, rotation = turn.T @ (position - travel), turn.T @ rotation
        known = travel, turn
    return right, result.track.probability


@pytest.mark.parametrize("seed", range(3))
def test_motion_alone_tells_the_right_pose_where_the_lights_do_not(seed):
    # The wrong pose turns twice as fast as the line of sight, 11 degrees a second; 10 are usual for a fastest of 30.
    # Such a speed speaks against it by (11 / 10)^2 / 4 a second, of which a half counts: 0.9 in 6 s, or 71 %.
    right, probability = sweep(False, seed=seed)
    assert right
    assert 0.6 < probability < 0.9


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("turns", [False, True])
def test_a_known_motion_tells_it_for_sure(seed, turns):
    right, probability = sweep(turns, seed=seed, command=True)
    assert right
    assert probability > 0.99


def test_nothing_tells_the_poses_of_a_dock_at_rest_apart():
    tracker, rotation = Tracker(CAMERA, UNKNOWN), facing(8, -25)
    for step in range(60):
        result = tracker.follow(shown((0.1, 0.0, 2.0), rotation, dock=UNKNOWN, seed=step), 0.1 * step)
    assert result.track.probability < 0.8


def test_errors_that_stay_do_not_add_up_while_nothing_moves():
    tracker = Tracker(CAMERA, DOCK)
    found = with_odds(shown((0.1, 0.0, 1.5), facing(10, 20)), 0.7)
    for step in range(20):
        result = tracker.follow(found, 0.1 * step)
    assert result.track.probability < 0.9  # twenty independent ones would be 1 - 4e-8


def test_steering_by_the_track_corrects_a_wrong_start():
    # Known commands, unknown lights: the chosen pose is squared up to, and what the ring does then tells.
    tracker, motion = Tracker(CAMERA, UNKNOWN), ClosedLoop(rate_hz=5.0)
    position, rotation = np.array([0.1, 0.0, 2.5]), facing(-12, 24)
    command, right, chance = None, [], []
    for step in range(12):
        found = shown(position, rotation, dock=UNKNOWN, seed=step)
        if step == 0:
            wrong = 0 if not is_right(found.candidates[0], found, -rotation[:, 2]) else 1
            found = with_odds(found, 0.7 if wrong == 0 else 0.3)
        result = tracker.follow(found, 0.2 * step, command)
        right.append(is_right(result.pose, found, -rotation[:, 2]))
        command = travel, turn = steer(result.pose, motion)
        position, rotation = turn.T @ (position - travel), turn.T @ rotation
        chance.append(result.track.probability)
    assert not right[0]
    assert all(right[5:12])  # later it is square on, where both poses are the same
    assert max(chance[5:12]) > 0.95


# Pictures.


def approach(seed, *, frames=30, **lights):
    rng = np.random.default_rng([seed, 41])
    place = Pose(
        position_m=(0.1, -0.05, 3.0), theta_x_deg=rng.uniform(5, 25), theta_y_deg=rng.uniform(-25, 25), roll_deg=9
    )
    scene = Scene(camera=CAMERA, dock=DOCK, pose=place, lights=Lights(level=3000.0, **lights), seed=seed)
    motion = Approach(frames=frames, start_m=3.0, end_m=0.8, drift_m=0.02, drift_deg=1.0)
    return film(FilmPlan(scene=scene, motion=motion))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_simulated_approach_with_flickering_lights(seed):
    tracker, apart = Tracker(CAMERA, DOCK), Tracker(CAMERA, DOCK, follow_lights=False)
    for frame in approach(seed, flicker=0.3):
        result = tracker.see(frame.image, frame.time_s)
        whole = estimate(frame.image, CAMERA, DOCK)
        followed = apart.follow(whole, frame.time_s)
        assert not result.track.lost
        for each in (result, followed):
            if frame.number >= 10 and each.selected is not None:
                assert is_right(each.pose, each.estimate, frame.truth.normal)
        # What is followed is what the whole picture shows.
        assert result.estimate.status == whole.status
        np.testing.assert_allclose(result.pose.position_m, followed.pose.position_m, rtol=0.01, atol=2e-3)


@pytest.mark.slow
def test_estimates_may_be_made_in_any_order_beforehand():
    frames = list(approach(7, frames=12))
    beforehand = {frame.number: estimate(frame.image, CAMERA, DOCK) for frame in reversed(frames)}
    seeing, following = (Tracker(CAMERA, DOCK, follow_lights=False) for _ in range(2))
    for frame in frames:
        one = seeing.see(frame.image, frame.time_s).to_dict()
        other = following.follow(beforehand[frame.number], frame.time_s).to_dict()
        assert one | {"elapsed_ms": 0} == other | {"elapsed_ms": 0}


@pytest.mark.parametrize(("seed", "kind"), [(0, "nearer"), (2, "brighter")])
def test_a_second_dock_does_not_take_over(seed, kind):
    followed = list(follow(seed, kind))
    assert len(followed[-1][0].estimate.ring.rivals) == 1
    assert stays(followed)


def test_a_second_dock_takes_over_where_the_first_is_gone():
    followed = list(follow(0, "nearer", 14, leaves=9))
    assert [tracked.track.predicted for tracked, _ in followed] == [False] * 9 + [True] + [False] * 4
    assert [tracked.track.age for tracked, _ in followed] == [*range(1, 11), 2, 3, 4, 5]
    assert [tracked.track.number for tracked, _ in followed] == [1] * 10 + [2] * 4
    assert all(off_m > 0.3 for _, off_m in followed[10:])


@pytest.mark.slow
def test_following_does_not_hold_on_to_a_part_of_the_ring():
    # From one frame to the next the dock is five times as large, which no window holds.
    poses = [Pose(position_m=(0.0, 0.0, z), theta_x_deg=20.0) for z in (4.0, 0.8)]
    still = Hover(frames=5, drift_m=0.0, drift_deg=0.0)
    plans = [FilmPlan(scene=Scene(camera=CAMERA, dock=DOCK, pose=pose, seed=1), motion=still) for pose in poses]
    tracker = Tracker(CAMERA, DOCK, Settings(max_speed_m_per_s=100.0))
    images = [frame.image for plan in plans for frame in film(plan)]
    found = [tracker.see(image, 0.1 * number) for number, image in enumerate(images)]
    assert [each.estimate.lights_on_ring for each in found[5:]] == [10] * 5
    assert found[-1].pose.position_m[2] == pytest.approx(0.8, rel=0.01)


def test_a_frame_with_one_candidate_alone_continues_either_chain():
    found = shown((0.0, 0.0, 1.5), facing(5, 20), dock=UNKNOWN)
    alone = replace(found, choice=replace(found.choice, candidates=found.candidates[1:], selected=0))
    for first in np.linspace(0.2, 0.8, 50):  # both are even then but for rounding, which may favour the second
        tracker = Tracker(CAMERA, UNKNOWN)
        tracker.follow(with_odds(found, first), 0.0)
        tracked = tracker.follow(alone, 0.1)
        assert (tracked.index, tracked.selected, tracked.pose) == (0, found.candidates[1], found.candidates[1])


def wandering(step, first=0.6):
    """A frame whose lights hardly tell, and whose second pose turns by several degrees to and fro."""
    found = with_odds(shown((0.1, 0.0, 1.5), facing(10, 20), seed=step), first)
    one, other = found.candidates
    turned = replace(
        other, normal=cv2.Rodrigues(np.array([0.0, math.radians(6 * (-1) ** step), 0.0]))[0] @ other.normal
    )
    return replace(found, choice=replace(found.choice, candidates=(one, turned)))


@pytest.mark.parametrize("is_told", [False, True])
def test_motion_makes_a_track_sure_only_where_it_was_told(is_told):
    tracker, still = Tracker(CAMERA, DOCK), (np.zeros(3), np.eye(3))
    for step in range(20):
        result = tracker.follow(wandering(step), 0.1 * step, still if is_told else None)
    assert result.index == 0
    assert (result.track.probability >= 0.95) == is_told
    assert result.track.probability > 0.8


def moving(step, first, focal_px):
    """A frame of a dock that moves, whose first pose has this probability, and which fits this focal length."""
    found = with_odds(shown((0.02 * step, 0.0, 1.5), facing(10, 20), seed=step), first)
    return replace(found, choice=replace(found.choice, focal_px=focal_px))


@pytest.mark.parametrize("focal_px", [1000.0, None])
def test_a_camera_file_that_frames_have_shown_to_be_off_does_not_choose_by_places_in_the_next(focal_px):
    tracker = Tracker(CAMERA, DOCK)
    before = [tracker.follow(moving(step, 0.99, focal_px), 0.1 * step).index for step in range(10)]
    after = [tracker.follow(moving(step, 0.01, None), 0.1 * step).index for step in range(10, 18)]
    assert before == [0] * 10
    assert after[-1] == (1 if focal_px is None else 0)


def test_by_another_camera_a_track_is_no_surer_than_its_last_frame():
    tracker = Tracker(CAMERA, DOCK)
    chances = [
        tracker.follow(moving(step, first, 1000.0), 0.1 * step).track.probability
        for step, first in enumerate([0.9999] * 10 + [0.6])
    ]
    assert min(chances[3:10]) > 0.95
    assert chances[10] < 0.95


def test_the_first_ring_of_a_track_weighs_as_much_as_one_that_moved():
    ring = fit_ellipse([[50, 0], [0, 40], [-50, 0], [0, -40], [30, 32]])
    assert Tracker(CAMERA, DOCK)._worth(ring) == Tracker(CAMERA, DOCK)._worth(None) == WORTH
