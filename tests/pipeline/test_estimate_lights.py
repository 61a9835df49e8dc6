"""What estimate() makes of lights that are uneven or behind a port."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import itertools
import math

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.camera.port import FlatPort
from dockpose.estimate import stages
from dockpose.lights.chance import LEAST_PX
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate import Lights, render

from tests.support.scenes import CAMERA, random_scene

POSE = {"theta_x_deg": 25.0, "theta_y_deg": -20.0, "roll_deg": 130.0, "position_m": (0.05, 0.05, 1.0)}


def angle_deg(pose, truth):
    return math.degrees(math.acos(min(1.0, float(pose.normal @ truth.normal))))


def test_uneven_lights_tell_the_pose_and_the_whole_roll():
    angles = (0.0, 30.0, 75.0, 140.0, 180.0, 230.0, 262.0, 310.0)
    dock = Dock(0.30, angles_deg=angles)
    scene = msgspec.structs.replace(random_scene(3, dock=dock, **POSE), lights=Lights(angles_deg=angles))
    image, truth = render(scene)
    found = estimate(image, CAMERA, dock)
    assert found.choice.selected_by == "spacing"
    assert found.choice.decided
    assert angle_deg(found.selected, truth) < 0.5
    assert math.degrees(found.selected.roll_rad) == pytest.approx(130, abs=0.5)


def test_a_picture_through_a_flat_port_gives_the_true_range():
    camera = Camera(500, 500, 319.5, 239.5, 640, 480, port=FlatPort(0.03, 0.01))
    image, truth = render(random_scene(4, camera=camera, position_m=(0.2, -0.1, 0.9), theta_x_deg=20.0))
    found = estimate(image, camera, Dock(0.30, 10))
    assert np.linalg.norm(found.selected.position_m) == pytest.approx(np.linalg.norm(truth.position_m), rel=0.003)
    assert angle_deg(found.selected, truth) < 0.5


def test_a_dock_square_on_says_so():
    image, _ = render(random_scene(4, position_m=(0.0, 0.0, 1.5), theta_x_deg=0.0, theta_y_deg=0.0))
    found = estimate(image, CAMERA, Dock(0.30, 10))
    assert "square on" in found.message
    assert found.choice.coincide


def test_a_far_dock_is_undecided_and_says_so():
    for seed in range(8):
        scene = random_scene(seed, position_m=(0.0, 0.0, 9.0), theta_x_deg=4.0, theta_y_deg=0.0)
        image, _ = render(msgspec.structs.replace(scene, lights=Lights(level=9000)))
        found = estimate(image, CAMERA, Dock(0.30, 10))
        assert (found.status, found.choice.decided, found.choice.coincide) == ("ok", False, False)
        assert "Undecided between the two poses" in found.message


def test_four_lights_of_ten_are_enough_where_their_number_is_known():
    scene = msgspec.structs.replace(random_scene(3, **POSE), lights=Lights(level=600, missing=(0, 2, 3, 5, 6, 9)))
    image, truth = render(scene)
    found = estimate(image, CAMERA, Dock(0.30, 10))
    assert found.status == "ok"
    assert len(found.markers) == 4
    assert angle_deg(found.selected, truth) < 1
    np.testing.assert_allclose(found.selected.position_m, truth.position_m, rtol=0.005, atol=0.002)
    unknown = estimate(image, CAMERA, Dock(0.30))
    assert unknown.status == "too_few_markers"
    assert unknown.message.endswith("Four do if the dock's number of lights is given: --lights 4.")
    assert unknown.ring is None


@pytest.mark.parametrize("times", [1.0, 2.0])
def test_a_ring_that_another_camera_saw_is_found_and_names_its_focal_length(times):
    dock = Dock(0.30, 24)
    sharp = msgspec.structs.replace(CAMERA, fx=2 * CAMERA.fx, fy=2 * CAMERA.fy)
    seen = sharp.project([0.02, -0.01, 0.9] + dock.light_points() @ rotation_from_angles(0.7, -0.6).T)
    image = np.full((CAMERA.height, CAMERA.width), 20, np.uint8)
    for x, y in 16 * seen:
        cv2.circle(image, (round(x), round(y)), 16 * 3, 220, -1, cv2.LINE_AA, 4)
    told = msgspec.structs.replace(sharp, fx=sharp.fx / times, fy=sharp.fy / times)
    found = estimate(image, told, dock)
    assert found.status == "ok"
    assert found.ring.on_ring.sum() == 24
    assert ("The spacing fits a focal length of about" in found.message) == (times > 1)
    if times > 1:
        assert f"not the camera's {told.fx:.0f} px: check the camera file." in found.message
        assert found.ring.focal_px == pytest.approx(sharp.fx, rel=0.1)  # the steps in which they are tried
        pose, other = found.candidates  # the nearer side shows whatever the camera is
        assert found.choice.decided
        assert (pose.normal - other.normal) @ -rotation_from_angles(0.7, -0.6)[:, 2] > 0
        assert pose.sigma_total_position_m is not None
        assert pose.sigma_total_position_m[2] > 0.5 * pose.position_m[2]  # half of its range comes of the camera file


def test_the_same_lamps_are_searched_for_a_ring_once(monkeypatch):
    # Bright lamps in the dark are the same groups at every level and of every scale up to their own.
    image = np.zeros((480, 640), np.uint8)
    for x, y in np.random.default_rng(1).integers([20, 20], [620, 460], (14, 2)).tolist():
        cv2.circle(image, (x, y), 5, 255, -1)
    searched = []
    find = stages.ring_in

    def watched(points, markers, camera, dock, area_px2, kind):
        if kind != "handmade" and dock.lights == 8:  # nor for lights out of their places, nor for another number
            searched.append(points)
        return find(points, markers, camera, dock, area_px2, kind)

    monkeypatch.setattr(stages, "ring_in", watched)
    assert estimate(image, CAMERA, Dock(0.30, 8)).status == "not_a_ring"
    for one, other in itertools.combinations(searched, 2):
        apart_px = np.linalg.norm(one[:, None] - other, axis=2)
        assert len(one) != len(other) or apart_px.min(axis=1).max() >= LEAST_PX


@pytest.mark.parametrize(
    ("count", "joined", "is_found"), [(12, 1, True), (12, 2, True), (11, 0, False), (10, 1, False)]
)
def test_two_lights_that_run_together_do_not_hide_a_ring_and_another_number_does(count, joined, is_found):
    turn = 2 * np.pi * np.arange(count) / count + 0.1
    ring = 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) @ rotation_from_angles(0.4, -0.5).T
    points = CAMERA.project(ring + [0.05, 0.02, 1.5])
    pairs = 2 + 3 * np.arange(joined)
    middles = (points[pairs] + points[pairs + 1]) / 2
    image = np.full((480, 640), 20, np.uint8)
    for point in [*np.delete(points, [*pairs, *(pairs + 1)], axis=0), *middles]:
        cv2.circle(image, np.round(point).astype(int).tolist(), 4, 220, -1)
    found = estimate(cv2.GaussianBlur(image, (0, 0), 0.7), CAMERA, Dock(0.30, 12))
    assert (found.status == "ok") == is_found
    if is_found:
        assert found.lights_on_ring == 12 - 2 * joined
        assert np.linalg.norm(found.selected.position_m) == pytest.approx(math.hypot(0.05, 0.02, 1.5), rel=0.01)
