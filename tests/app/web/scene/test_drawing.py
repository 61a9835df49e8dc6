import math
from dataclasses import replace

import numpy as np
from dockpose import Camera, Dock, estimate
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_method
from dockpose.app.state.view import MeasuredPose
from dockpose.app.web.scene import drawing as drawn
from dockpose.camera.port import FlatPort
from dockpose.simulate import Pose, Scene, render
from dockpose.simulate.optics.water import preset


def test_image_plane_puts_the_corner_pixels_on_their_rays():
    camera = Camera(700, 650, 300, 260, 640, 480)
    width, height, (x, y, z) = drawn.image_plane(camera)
    corner = np.array([[x - width / 2, y - height / 2, z], [x + width / 2, y + height / 2, z]])
    np.testing.assert_allclose(camera.project(corner), [[-0.5, -0.5], [639.5, 479.5]])


def check_ends(found, lights):
    """Where the rays start, which all end on the lights of the pose."""
    lines, pose = drawn.rays_to_lights(found), found.selected
    model = drawn.lights_on_ring(found.dock, pose.roll_rad) * found.dock.radius @ pose.T_camera_dock[:3, :3].T
    gaps = np.linalg.norm(lines[:, 1][:, None] - (model + pose.position_m)[None], axis=2).min(axis=1)
    assert len(lines) == lights
    assert gaps.max() < 0.001
    return lines


def test_rays_end_on_the_lights(found):
    assert not check_ends(found, 10)[:, 0].any()


def test_rays_leave_the_port_and_end_on_the_lights():
    camera = Camera(700, 700, 319.5, 239.5, 640, 480, port=FlatPort(air_gap_m=0.03, glass_m=0.01))
    scene = Scene(
        camera=camera,
        dock=Dock(0.30, angles_deg=(0, 50, 100, 170, 220, 300)),
        pose=Pose(position_m=(0.05, 0.02, 0.9), theta_x_deg=20, theta_y_deg=-25, roll_deg=10),
        water=preset("clear"),
    )
    found = estimate(render(scene)[0], camera, scene.dock)
    lines = check_ends(found, 6)
    assert found.markers is not None
    assert found.ring is not None
    np.testing.assert_allclose(lines[:, 0, 2], 0.04)  # the outer face of the glass
    np.testing.assert_allclose(camera.project(lines[:, 1]), found.markers.points_px[found.ring.on_ring], atol=1e-6)


def test_lights_are_where_the_dock_has_them():
    quarter = drawn.lights_on_ring(Dock(0.30, angles_deg=(0, 90, 180)), math.pi / 2)
    np.testing.assert_allclose(quarter, [[0, 1, 0], [-1, 0, 0], [0, -1, 0]], atol=1e-12)
    assert drawn.lights_on_ring(Dock(0.30), None).shape == (0, 3)


def test_no_rays_without_a_pose(view):
    empty = analyse(with_method(view, "fixed", 255)).estimate
    assert drawn.rays_to_lights(empty).shape == (0, 2, 3)


def test_near_places_are_drawn_where_they_are_and_far_ones_nearer_in_their_order():
    """Half the dock's diameter is 0.1 m: to 0.15 m as it is, at 0.3 m at 0.15 (2 - 1/2), never beyond 0.3 m."""
    ranges = np.array([0.05, 0.15, 0.3, 0.6, 1e6])
    way = np.array([0.6, 0.0, 0.8])
    placed = drawn.shortened(ranges[:, None] * way, 0.1)
    np.testing.assert_allclose(placed, np.array([0.05, 0.15, 0.225, 0.2625, 0.3])[:, None] * way, atol=1e-6)


def test_lines_to_a_dock_that_is_drawn_nearer_leave_the_camera_and_reach_it_as_they_would():
    rays = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 2.0]], [[0.0, 0.0, 0.0], [-0.1, 0.2, 2.0]]])
    to = np.array([0.0, 0.0, 0.4])
    shift = to - (0.0, 0.0, 2.0)
    segments, marks = drawn.broken(rays, to, shift, 0.1)
    near, far = np.split(segments, 2)
    for segments in (near, far):
        ways = segments[:, 1] - segments[:, 0]
        np.testing.assert_allclose(np.cross(ways, rays[:, 1]), 0, atol=1e-12)  # in the rays' own directions
    np.testing.assert_array_equal(near[:, 0], rays[:, 0])
    np.testing.assert_allclose(far[:, 1], rays[:, 1] + shift)
    assert near[:, 1, 2].max() < far[:, 0, 2].min()
    assert near[:, 1, 2].max() <= marks[:, :, 2].max() <= 0.4
    whole, marks = drawn.broken(rays, rays[0, 1], np.zeros(3), 0.1)
    np.testing.assert_array_equal(whole, rays)
    assert not len(marks)


def test_known_dock_far_behind_those_found_is_in_the_drawing_and_all_stand_before_the_camera(view):
    near = analyse(view)
    far = analyse(replace(view, measured=MeasuredPose(0.0, 0.0, 900.0, 0.0, 0.0)))
    assert drawn.drawing_of(near).depth_m < 1
    assert drawn.drawing_of(far).depth_m > 7
    for one in (near, far):
        assert drawn.drawing_of(one).docks[:, 2].min() > 0
    empty = analyse(with_method(view, "fixed", 255))
    assert drawn.drawing_of(empty).docks[:, 2].max() < 1
