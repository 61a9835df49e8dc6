from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.estimate.geometry import centres, extra_seen, light_labels, outside, pose_lines, scale_bar
from dockpose.lights.markers import Markers
from dockpose.lights.ring import Ring
from dockpose.pose.circle import CirclePose

CAMERA, DOCK = Camera(700.0, 700.0, 320.0, 240.0, 641, 481), Dock(0.30, 4)

LINE = np.array([[0.0, 0.0], [10.0, 0.0]])


def pieces(points, *circles):
    centres = np.array([circle[:2] for circle in circles]).reshape(-1, 2)
    found = outside(np.asarray(points, dtype=float), centres, np.array([circle[2] for circle in circles]))
    return [piece.round(6).tolist() for piece in found]


def test_a_line_stops_at_a_circle_and_goes_on_behind_it():
    assert pieces(LINE, (5, 0, 2)) == [[[0, 0], [3, 0]], [[7, 0], [10, 0]]]
    assert pieces(LINE, (5, 3, 5)) == [[[0, 0], [1, 0]], [[9, 0], [10, 0]]]  # 3, 4, 5


def test_a_line_beside_all_circles_or_touching_one_stays_whole():
    assert pieces(LINE) == [[[0, 0], [10, 0]]]
    assert pieces(LINE, (5, 2, 2), (20, 0, 3), (-4, 0, 3)) == [[[0, 0], [10, 0]]]


def test_circles_that_overlap_leave_one_gap_and_one_over_all_of_it_leaves_nothing():
    assert pieces(LINE, (4, 0, 2), (6, 0, 2)) == [[[0, 0], [2, 0]], [[8, 0], [10, 0]]]
    assert pieces(LINE, (5, 0, 6)) == []


def test_a_line_with_corners_is_one_piece_up_to_the_circle():
    corners = [[0, 0], [10, 0], [10, 10], [0, 10]]
    assert pieces(corners, (10, 5, 1)) == [[[0, 0], [10, 0], [10, 4]], [[10, 6], [10, 10], [0, 10]]]
    assert pieces(corners, (10, 0, 2)) == [[[0, 0], [8, 0]], [[10, 2], [10, 10], [0, 10]]]


@pytest.mark.parametrize("gone", [[np.nan, 0], [np.inf, 0]])
def test_what_is_behind_the_camera_is_not_drawn(gone):
    assert pieces([[0, 0], [1, 0], gone, [3, 0], [4, 0]], (100, 100, 1)) == [[[0, 0], [1, 0]], [[3, 0], [4, 0]]]


def test_a_poses_lines_are_its_circle_two_diameters_and_its_normal():
    """Square on in the middle, at 1 m: the normal comes towards the camera, and is seen as a point."""
    for tilt_rad in (0.0, 0.4):
        normal = np.array([-np.sin(tilt_rad), 0.0, -np.cos(tilt_rad)])
        pose = CirclePose.at(np.array([0.0, 0.0, 1.0]), normal, CAMERA)
        stages: Any = SimpleNamespace(camera=CAMERA, dock=DOCK)
        circle, (one, other), (start, end) = pose_lines(pose, stages)
        ends_m = 0.15 * np.array([np.cos(tilt_rad), 0, -np.sin(tilt_rad)])
        on_x = [CAMERA.project([[0, 0, 1] + side * ends_m])[0] for side in (-1, 1)]
        np.testing.assert_allclose(np.sort(one[:, 0]), np.sort([u for u, _ in on_x]), atol=1e-9)
        np.testing.assert_allclose(np.sort(other[:, 1]), [240 - 105, 240 + 105], atol=1e-9)
        np.testing.assert_allclose(circle.min(axis=0)[1], 240 - 105, atol=0.2)
        np.testing.assert_allclose(start, [320, 240], atol=1e-9)
        towards = CAMERA.project([np.array([0.0, 0.0, 1.0]) + 0.05 * normal])[0] - start
        assert np.sign(np.round(end - start, 9)).tolist() == np.sign(np.round(towards, 9)).tolist()


def stages(position_m=(0.0, 0.0, 1.0), **more) -> Any:
    """Four lights of 100 pixels around (200, 100), of which the third is none of the ring's, and a group beside."""
    points = np.array([[230.0, 100.0], [200.0, 130.0], [170.0, 100.0], [200.0, 70.0], [300.0, 100.0]])
    areas = np.full(5, 100)
    pose = CirclePose.at(np.array(position_m), np.array([0.0, 0.0, -1.0]), CAMERA)
    known = {"markers": Markers(points, areas, areas), "ring": Ring(np.array([1, 1, 0, 1, 0], dtype=bool), "")}
    known |= {
        "choice": None,
        "by_hand": None,
        "selected": pose,
        "ellipse": None,
        "camera": CAMERA,
        "dock": DOCK,
        "width": 641,
    }
    known |= {"light_numbers": lambda: [2, None, None, 0, None]}
    return SimpleNamespace(**known | more)


@pytest.mark.parametrize(("z_m", "length_m"), [(0.8, 0.1), (1.0, 0.2), (3.0, 0.5), (6.0, 1.0), (10.0, 2.0)])
def test_the_scale_is_the_longest_round_length_within_a_quarter_of_the_picture_at_the_docks_distance(z_m, length_m):
    """A pinhole of 700 px sees a length L at z as 700 L / z: a quarter of 641 px are .229 z."""
    assert scale_bar(stages((0.2, 0.1, z_m))) == pytest.approx((length_m, 700 * length_m / z_m))
    assert scale_bar(stages(selected=None)) is None
    assert scale_bar(stages((0.2, 0.1, -1.0))) is None  # behind the camera


def test_centres_are_those_of_ellipse_and_pose_where_there_are_any():
    assert centres(stages(selected=None)) == (None, None)
    both = centres(stages((0.2, 0.1, 1.0), ellipse=SimpleNamespace(centre_px=(100.0, 90.0))))
    np.testing.assert_allclose(np.array(both), [[100, 90], [320 + 140, 240 + 70]])


def test_an_extra_light_is_the_group_around_its_place_unless_that_is_on_the_ring():
    """100 pixels have a radius of 5.6: 1.6 of it are 9."""
    places = np.array([[308.0, 100.0], [np.nan, np.nan], [170.0, 110.0], [232.0, 100.0]])
    seen, is_extra = extra_seen(stages(choice=SimpleNamespace(extra_px=places)))
    np.testing.assert_allclose(seen, places[[0, 2, 3]])
    assert is_extra.tolist() == [False, False, False, False, True]
    for none in (stages(choice=SimpleNamespace(extra_px=None)), stages()):
        assert extra_seen(none)[0].shape == (0, 2)
    assert extra_seen(stages(markers=None, ring=None, choice=SimpleNamespace(extra_px=places)))[1].tolist() == []


def test_a_light_has_its_number_from_one_or_its_groups_and_stands_outwards_of_it():
    labels = light_labels(stages())
    assert [(index, label) for index, label, _ in labels] == [(0, "3"), (1, "2"), (3, "1")]
    for index, _, way in labels:  # from the middle of the three, (210, 100)
        off = stages().markers.points_px[index] - [210, 100]
        np.testing.assert_allclose(way, off / np.linalg.norm(off))
    assert light_labels(stages(selected=None)) == light_labels(stages(markers=None, ring=None)) == []
