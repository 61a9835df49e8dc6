"""Clocks, mount, dock and scale found beside a trajectory: by hand, at random, and what the motion cannot tell."""

import json
from dataclasses import replace

import numpy as np
import pytest
from dockpose.truth import DockTrack, Placement, Trajectory, compare_trajectory
from scipy.spatial.transform import Rotation

from tests.support.moving import MOUNT, draw

NOISES = ((2e-4, 0.2), (1e-5, 0.001))  # metres and degrees


@pytest.fixture(scope="module")
def drawn():
    moved = draw(3, wrong_pose=0.1, wrong_dock=0.05, scale=1.01)
    return moved, compare_trajectory(moved.results, moved.truth)


def by_hand(offset_s=0.5):
    """A body that is the camera sways before a dock 2 m ahead of the world's origin, which faces it; nothing is off."""
    times = np.arange(0, 20, 0.1)
    clock = np.arange(-1, 22, 0.02)

    def body(t):
        place = np.column_stack([0.2 * np.sin(t), 0.1 * np.sin(1.7 * t), 0.3 * np.sin(0.6 * t)])
        return place, Rotation.from_rotvec(0.1 * np.column_stack([np.sin(1.3 * t), np.sin(0.9 * t), np.sin(2.1 * t)]))

    place, turn = body(times)
    seen = turn.inv().apply([0, 0, 2] - place)
    covariances = np.tile(1e-6 * np.eye(5), (len(times), 1, 1))
    results = DockTrack(times, seen, turn.inv().apply(np.tile([0, 0, -1.0], (len(times), 1))), covariances)
    place, turn = body(clock)
    return results, Trajectory("by hand", clock + offset_s, place, turn.as_quat())


def test_of_exact_numbers_all_is_found_exactly():
    found = compare_trajectory(*by_hand())
    assert found.offset_s == pytest.approx(0.5, abs=1e-5)
    assert found.drift_ppm == pytest.approx(0, abs=2)
    assert found.scale == pytest.approx(1, abs=1e-5)
    assert found.mount.position_m == pytest.approx(np.zeros(3), abs=1e-4)
    assert np.abs(np.array(found.mount.quaternion_xyzw)) == pytest.approx([0, 0, 0, 1], abs=1e-5)
    assert found.dock_in_world.position_m == pytest.approx([0, 0, 2], abs=1e-4)
    assert found.dock_in_world.quaternion_xyzw == pytest.approx([0, 0, 0, 1], abs=1e-5)
    # In degrees the curve through rows 20 ms apart is smoothed; below what the trajectory is off there is none.
    assert max(value or 0.0 for value in found.report["rms"].values()) < 5e-3
    assert 0.0 not in found.report["rms"].values()
    assert found.report["wrong_pose"]["count"] == found.report["frames"]["wrong_dock"] == 0


def test_what_was_drawn_is_found(drawn):
    moved, found = drawn
    assert found.offset_s == pytest.approx(3.7, abs=2e-3)
    assert found.drift_ppm == pytest.approx(20, abs=5 * found.drift_sigma_ppm)
    assert found.scale == pytest.approx(1.01, abs=5e-4)
    turned = (MOUNT.inv() * Rotation.from_quat(found.mount.quaternion_xyzw)).magnitude()
    assert np.degrees(turned) < 0.1
    assert found.mount.position_m == pytest.approx(moved.lever_m, abs=2e-3)
    assert found.dock_in_world.position_m == pytest.approx(moved.dock_m, abs=2e-3)
    normal = -Rotation.from_quat(found.dock_in_world.quaternion_xyzw).as_matrix()[:, 2]
    assert np.degrees(np.arccos(normal @ moved.dock_normal)) < 0.1


def test_frames_with_the_wrong_pose_and_a_wrong_dock_are_told(drawn):
    moved, found = drawn
    known = np.isfinite(found.errors[:, 0])
    assert (found.is_wrong_dock == moved.wrong_dock)[known].mean() > 0.99
    # Where both candidates are nearly the same nothing is wrong with either.
    apart = np.linalg.norm(moved.results.normals - moved.results.other_normals, axis=1) > 0.2
    assert (found.is_wrong_pose == moved.wrong_pose)[known & apart].mean() > 0.99


def test_errors_are_those_against_the_exact_truth(drawn):
    moved, found = drawn
    right = ~found.is_fitted & np.isfinite(found.errors[:, 0]) & ~moved.wrong_pose & ~moved.wrong_dock
    exact = moved.results.positions_m - moved.positions_m
    rms = np.sqrt((exact[right] ** 2).mean(axis=0))
    assert [found.report["right"]["rms"][name] for name in ("x_m", "y_m", "z_m")] == pytest.approx(rms, rel=0.2)


def test_everything_can_be_written_as_json(drawn):
    text = json.dumps(drawn[1].to_dict(), allow_nan=False)
    assert {"offset_s", "drift_ppm", "mount", "dock_in_world", "scale", "rms", "by_range", "by_tilt"} <= set(
        json.loads(text)
    )


def test_what_is_given_is_held():
    moved = draw(5)
    mount = Placement(moved.lever_m, MOUNT.as_quat())
    found = compare_trajectory(moved.results, moved.truth, mount=mount, offset_s=3.7)
    assert found.mount.to_dict() == mount.to_dict()
    assert (found.offset_s, found.offset_sigma_s) == (3.7, None)
    assert found.dock_in_world.position_m == pytest.approx(moved.dock_m, abs=2e-3)


def test_times_since_1970_are_found_as_well():
    moved = draw(2, offset_s=1.7e9)
    found = compare_trajectory(moved.results, moved.truth)
    assert found.offset_s == pytest.approx(1.7e9, abs=2e-3)


def still(t):
    return np.tile([0.1, 0.0, -2.0], (len(t), 1)), np.zeros((len(t), 3))


def straight(t):
    return np.column_stack([0 * t, 0 * t, -3 + 2 * t / 60]), np.zeros((len(t), 3))


def rolling(t):
    return still(t)[0], np.column_stack([0 * t, 0 * t, 0.5 * np.sin(t)])


@pytest.mark.parametrize("seed", [0, 4, 11])
@pytest.mark.parametrize(
    ("path", "untold"),
    [
        (still, {"offset_s", "drift_ppm", "mount_turn", "mount_place", "dock_place", "scale"}),
        (straight, {"offset_s", "mount_turn", "mount_place", "dock_place", "dock_turn"}),
        (rolling, {"offset_s", "mount_place", "dock_place"}),  # half a period later it is the same
    ],
)
def test_what_the_motion_cannot_tell_is_said_and_left_out(path, untold, seed):
    moved = draw(seed, path=path)
    found = compare_trajectory(moved.results, moved.truth)
    values = {
        "offset_s": found.offset_s,
        "drift_ppm": found.drift_ppm,
        "mount_turn": found.mount.quaternion_xyzw,
        "mount_place": found.mount.position_m,
        "dock_place": found.dock_in_world.position_m,
        "dock_turn": found.dock_in_world.quaternion_xyzw,
        "scale": found.scale,
    }
    assert untold <= {name for name, value in values.items() if value is None}
    told = " ".join(found.notes)
    words = {
        "offset_s": "offset",
        "mount_turn": "turned in the body",
        "mount_place": "sits in the body",
        "scale": "scale",
    }
    assert all(words[name] in told for name in untold & set(words))


def test_docks_without_standard_errors_are_compared_and_that_is_said():
    moved = draw(4)
    unknown = np.where(np.arange(1200)[:, None, None] < 300, np.nan, moved.results.covariances)
    found = compare_trajectory(replace(moved.results, covariances=unknown), moved.truth)
    assert found.offset_s == pytest.approx(3.7, abs=2e-3)
    assert any("300 docks have no standard errors" in note for note in found.notes)
    json.dumps(found.to_dict(), allow_nan=False)


def test_a_trajectory_that_is_worse_than_the_docks_is_told():
    worse, better = (compare_trajectory((m := draw(4, truth_noise=noise)).results, m.truth) for noise in NOISES)
    assert any("trajectory itself is off in x by" in note for note in worse.notes)
    assert not any("trajectory itself" in note for note in better.notes)


def test_another_films_trajectory_is_refused():
    with pytest.raises(ValueError, match="does not match the docks"):
        compare_trajectory(draw(1).results, draw(2).truth)


def test_a_trajectory_without_attitudes_is_refused():
    moved = draw(1, duration_s=10)
    with pytest.raises(ValueError, match="drawn has no attitudes"):
        compare_trajectory(moved.results, Trajectory("drawn", moved.truth.times_s, moved.truth.positions_m))


def test_too_few_frames_are_refused():
    moved = draw(1, duration_s=2)
    with pytest.raises(ValueError, match="40 frames with a dock; 60 are needed"):
        compare_trajectory(moved.results, moved.truth)
