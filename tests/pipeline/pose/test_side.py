import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.side import _first_is_right, other_focal_px, poses_by_side
from dockpose.pose.solve import find_poses
from msgspec.structs import replace

from tests.support.docks import CAMERA

DOCK, POSITION = Dock(0.30, 24), np.array([0.1, -0.05, 0.9])


def scaled(times):
    return replace(CAMERA, fx=times * CAMERA.fx, fy=times * CAMERA.fy)


def seen(rotation, *, position=POSITION, lights=24, noise_px=0.05, along_deg=0.0, seed=0):
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * np.arange(lights) / lights + np.radians(along_deg) * rng.normal(0, 1, lights)
    ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = CAMERA.project(position + ring @ rotation.T)
    return points + rng.normal(0, noise_px, points.shape)


@pytest.mark.parametrize("times", [0.6, 1.6])
@pytest.mark.parametrize("angles", [(0.3, 0.4), (-0.4, 0.2), (0.1, -0.5)])
def test_the_nearer_side_and_the_focal_length_show_whatever_the_camera_file_says(angles, times):
    rotation, camera = rotation_from_angles(*angles), scaled(times)
    points = seen(rotation)
    ellipse, choice = find_poses(points, camera, DOCK)
    told = other_focal_px(points, camera, DOCK, ellipse, choice)
    assert told is not None
    assert told == (pytest.approx(CAMERA.fx, rel=0.05), 24)
    _, choice = poses_by_side(points, camera, replace(DOCK, lights=None), *told)
    assert (choice.decided, choice.focal_px) == (True, told[0])
    pose, other = choice.candidates
    right = -rotation[:, 2] - POSITION / np.linalg.norm(POSITION) * float(-rotation[:, 2] @ POSITION) / 0.9
    assert (pose.normal - other.normal) @ right > 0
    # The error of the range that comes of it is said.
    sigma_m = pose.sigma_total_position_m[2]  # pyright: ignore[reportOptionalSubscript]
    assert abs(pose.position_m[2] - POSITION[2]) < 1.96 * sigma_m
    assert sigma_m == pytest.approx(abs(1 / times - 1) * pose.position_m[2], rel=0.1)  # what the camera file is off by


def test_the_right_camera_has_no_other_focal_length_nor_have_lights_that_hands_spaced():
    for seed in range(20):
        rotation = rotation_from_angles(0.3, 0.4)
        for lights, along_deg in ((24, 0.0), (8, 4.0)):
            points = seen(rotation, lights=lights, along_deg=along_deg, seed=seed)
            dock = Dock(0.30, lights)
            assert other_focal_px(points, CAMERA, dock, *find_poses(points, CAMERA, dock)) is None


@pytest.mark.parametrize(
    ("times", "angles", "is_told"),
    [(0.6, (0.12, -0.16), True), (1.6, (0.12, -0.16), True), (1.06, (0.25, -0.4), False), (0.94, (0.25, -0.4), False)],
)
def test_by_less_than_half_a_pixel_a_focal_length_shows_that_is_off_by_more_than_a_tenth(times, angles, is_told):
    rotation, camera = rotation_from_angles(*angles), scaled(times)
    for seed in range(5):
        points = seen(rotation, position=np.array([0.1, -0.05, 1.2]), noise_px=0.02, seed=seed)
        ellipse, choice = find_poses(points, camera, DOCK)
        assert 3 * ellipse.rms_px < (choice.candidates[0].rms_px or 0.0) < 0.5
        told = other_focal_px(points, camera, DOCK, ellipse, choice)
        assert told == ((pytest.approx(CAMERA.fx, rel=0.05), 24) if is_told else None)


def test_the_side_stays_open_where_noise_hides_it():
    sure = 0
    for seed in range(40):
        points = seen(rotation_from_angles(0.1, 0.05), position=np.array([0.1, 0.0, 6.0]), noise_px=0.3, seed=seed)
        sure += poses_by_side(points, scaled(0.6), replace(DOCK, lights=None), CAMERA.fx, 24)[1].decided
    assert sure <= 8  # 2 x 5 % by chance, and as much for the drawing


@pytest.mark.parametrize(("range_m", "lights"), [(5.0, 24), (3.0, 6)])
def test_a_side_is_right_at_least_as_often_as_it_says(range_m, lights):
    """In noise that leaves it open now and then. By how the rise falls about the middle of both it says too little.

    Of two that are d deviations to either side one is right with the probability F(d), and F(d / sqrt(2)) is said: by
    no more than .09 less.
    """
    rotation, position = rotation_from_angles(0.25, -0.2), np.array([0.1, 0.0, range_m])
    poses = find_poses(seen(rotation, position=position, noise_px=0, lights=lights), CAMERA, Dock(0.30, lights))[1]
    assert poses.candidates[0].normal @ -rotation[:, 2] > 0.9999
    angles = 2 * np.pi * np.arange(lights) / lights
    firsts = []
    for seed in range(200):
        points = seen(rotation, position=position, noise_px=0.3, lights=lights, seed=seed)
        firsts.append(_first_is_right(points, angles, poses.candidates, CAMERA)[1])
    right, said = np.array(firsts) > 0.5, np.maximum(firsts, np.subtract(1, firsts))
    assert 0.7 < said.mean() < 0.98  # or this tells nothing
    spread = np.sqrt(np.sum(said * (1 - said)))
    assert -3 * spread < right.sum() - said.sum() < 3 * spread + 0.09 * len(said)
