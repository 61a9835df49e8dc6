"""The course over the frames: what is noted, thinned and drawn; and stored results that are estimated again."""

import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings, Track, Tracked
from dockpose.app.processing.analysis import COLUMNS, MOST_POINTS, Trajectory, differences, estimate_again
from dockpose.app.processing.following import chosen_by_track
from dockpose.pose.circle import CirclePose
from dockpose.simulate import Pose, Scene, render
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracker

from tests.support.scenes import DOCK

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
BLANK = np.zeros((2, 2), np.uint8)
NOTHING = Estimate("no_lights", "nothing", 640, 480, 8, CAMERA, Dock(0.3), Settings())
LOST = Tracked(NOTHING, Track())


def frame(index, time_s=None):
    return Frame(BLANK, index, time_s, "x")


def seen(x_m, chance=0.9):
    pose = CirclePose(np.array([x_m, 0.2, 1.5]), np.array([0, 0, -1.0]), np.zeros(2))
    return Tracked(NOTHING, Track(chance, 3, False, False), None, None, pose, pose, 0)


def test_a_frame_is_noted_with_its_place_angles_and_probability():
    trajectory = Trajectory()
    trajectory.note(frame(4, 0.8), seen(0.1))
    ((index, values),) = trajectory.rows()
    row = dict(zip(COLUMNS, values, strict=True))
    assert index == 4
    assert (row["time_s"], row["x_m"], row["z_m"], row["probability"], row["lost"]) == (0.8, 0.1, 1.5, 0.9, 0)
    assert row["theta_x_deg"] == row["theta_y_deg"] == 0
    assert math.isnan(row["eccentricity"])


def course(*tracked):
    trajectory = Trajectory()
    for index, each in enumerate(tracked):
        trajectory.note(frame(index), each)
    return trajectory


def test_lost_frames_are_marked_and_are_not_on_the_path():
    trajectory = course(seen(0.1), LOST, seen(0.3))
    assert [row[COLUMNS.index("lost")] for _, row in trajectory.rows()] == [0, 1, 0]
    np.testing.assert_array_equal(trajectory.path_m(2, 5.0), [[0.1, 0.2, 1.5], [0.3, 0.2, 1.5]])


def test_rows_are_in_the_order_of_frames_whatever_was_seen_first():
    trajectory = Trajectory()
    for index in (5, 1, 3, 1):
        trajectory.note(frame(index), seen(index / 10))
    assert [(index, row[1]) for index, row in trajectory.rows()] == [(1, 0.1), (3, 0.3), (5, 0.5)]
    assert [index for index, _ in trajectory.rows(2, 4)] == [3]


def test_oldest_frames_go():
    trajectory = course(*[LOST] * (MOST_POINTS + 5))
    rows = trajectory.rows()
    assert (len(rows), rows[0][0]) == (MOST_POINTS, 5)


def test_what_the_frames_before_chose_is_chosen_again():
    tracker, chosen_by = Tracker(CAMERA, DOCK, follow_lights=False), set()
    for index in range(6):
        pose = Pose(position_m=(0.05, 0.02, 6.0 - 0.3 * index), theta_x_deg=4.0, theta_y_deg=-5.0)
        image = render(Scene(camera=CAMERA, dock=DOCK, pose=pose, seed=index))[0]
        line = msgspec.json.decode(msgspec.json.encode(chosen_by_track(tracker.see(image, 0.1 * index)).to_dict()))
        assert differences(line, estimate_again(image, line)) == []
        chosen_by.add(line["selected_by"])
    assert "tracking" in chosen_by


@pytest.mark.parametrize("by_hand", ["lights", {"lights_px": [[1]]}, {"places": []}, [[1, 2]]])
def test_lights_by_hand_that_a_line_cannot_mean_are_named(found, by_hand):
    line = msgspec.json.decode(msgspec.json.encode(found.to_dict())) | {"by_hand": by_hand}
    with pytest.raises(ValueError, match="by_hand: "):
        estimate_again(np.zeros((found.height, found.width), np.uint8), line)


def test_rounding_is_no_difference(found):
    for change, names in ((1e-13, []), (1e-6, ["candidates[0].position_m[2]"])):
        line = msgspec.json.decode(msgspec.json.encode(found.to_dict()))
        line["candidates"][0]["position_m"][2] += change
        assert [name for name, *_ in differences(line, found)] == names
