# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from dockpose import Dock, Tracker, estimate
from dockpose.lights.markers import Markers
from dockpose.pose.extra import _densities, _own_px2, _refined, _spots, places_px, with_extra_lights
from dockpose.pose.solve import find_poses
from dockpose.simulate import Lights, Pose, render
from dockpose.simulate.parts import Background, Glare, Lamp
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tests.support.scenes import CAMERA, changed

RING = Dock(0.30, 8)
DOCK = Dock(0.30, 8, extra_lights_m=((0.0, 0.0, 0.05),))
PLACE = (0.1, -0.05, 2.0)
# 3 degrees along the rim and more, so that spacing tells nothing or is wrong.
UNEVEN = tuple((45 * light + off) % 360 for light, off in enumerate((3.1, -2.4, 4.0, -3.3, 1.2, -4.1, 2.2, 0.4)))


def shown(dock, theta_x_deg=0.0, theta_y_deg=20.0, roll_deg=13.0, **parts):
    pose = Pose(position_m=PLACE, theta_x_deg=theta_x_deg, theta_y_deg=theta_y_deg, roll_deg=roll_deg)
    scene = changed(camera=CAMERA, dock=dock, pose=pose, lights=Lights(level=900, angles_deg=UNEVEN), **parts)
    return render(scene)


def angle_deg(pose, truth):
    return math.degrees(math.acos(min(1.0, float(pose.normal @ truth.normal))))


@pytest.mark.parametrize("extra", [(0.0, 0.0, 0.05), (0.0, 0.0, -0.05), (0.0, 0.0, 0.1), (0.04, 0.02, 0.05)])
@pytest.mark.parametrize(("theta_x_deg", "theta_y_deg"), [(0, 20), (0, -20), (25, 5), (-15, -15)])
def test_a_lamp_out_of_the_plane_tells_the_pose(extra, theta_x_deg, theta_y_deg):
    dock = Dock(0.30, 8, extra_lights_m=(extra,))
    image, truth = shown(dock, theta_x_deg, theta_y_deg)
    found = estimate(image, CAMERA, dock)
    assert found.lights_on_ring == 8
    assert angle_deg(found.selected, truth) < angle_deg(found.candidates[1], truth)
    assert found.choice.decided
    scene_m = truth.position_m + np.array(extra)[2] * -truth.normal
    if not any(extra[:2]):
        np.testing.assert_allclose(found.choice.extra_px, CAMERA.project([scene_m]), atol=0.3)
        np.testing.assert_allclose(places_px(found.selected, CAMERA, dock), CAMERA.project([scene_m]), atol=1.5)
    assert "Extra lights seen: 1 of 1." in found.message
    assert found.to_dict()["extra_lights"][0]["x_px"] == found.choice.extra_px[0, 0]


@pytest.mark.parametrize("theta_y_deg", [8.0, 20.0, 35.0])
def test_a_dead_lamp_says_nothing(theta_y_deg):
    image, _ = shown(RING, theta_y_deg=theta_y_deg)
    alone, told = (estimate(image, CAMERA, dock) for dock in (RING, DOCK))
    for one, other in zip(alone.candidates, told.candidates, strict=True):
        assert one.probability == other.probability
        np.testing.assert_array_equal(one.normal, other.normal)
    assert (alone.detection, alone.choice.selected_by) == (told.detection, told.choice.selected_by)
    assert told.to_dict()["extra_lights"] == [None]
    assert alone.to_dict()["extra_lights"] == []


def test_one_drowned_in_glare_says_nothing():
    x, y = CAMERA.project([PLACE])[0]
    glare = Background(glares=(Glare(x_px=float(x), y_px=float(y), size_px=8.0, level=4000.0),))
    image, _ = shown(DOCK, background=glare)
    alone, told = (estimate(image, CAMERA, dock) for dock in (RING, DOCK))
    assert told.status == alone.status
    assert np.isnan(told.choice.extra_px).all()
    assert told.selected.probability == pytest.approx(alone.selected.probability, abs=0.01)


def test_a_lamp_at_both_places_decides_nothing():
    image, _ = shown(DOCK)
    twin = estimate(image, CAMERA, DOCK).candidates[1]
    other_m = twin.position_m - 0.05 * twin.normal
    image, _ = shown(DOCK, lamps=(Lamp(position_m=tuple(other_m.tolist()), level=900.0, radius_m=0.004),))
    found = estimate(image, CAMERA, DOCK)
    assert found.selected.probability < 0.95


def test_it_is_seen_where_lights_are_followed_too():
    image, truth = shown(DOCK)
    tracker = Tracker(CAMERA, DOCK)
    frames = [tracker.see(image, number / 10) for number in range(3)]
    assert [frame.estimate.found_by for frame in frames] == ["search", "following", "following"]
    for frame in frames:
        assert np.isfinite(frame.estimate.choice.extra_px).all()
        assert angle_deg(frame.selected, truth) < 5


@pytest.mark.parametrize("height_m", [0.15, 0.3])
@pytest.mark.parametrize("tilt_deg", [{"theta_x_deg": 2.0, "theta_y_deg": 0.0}, {"theta_y_deg": 5.0}])
def test_where_both_poses_end_up_within_their_errors_neither_is_much_likelier(height_m, tilt_deg):
    dock = Dock(0.30, 8, extra_lights_m=((0.0, 0.0, height_m),))
    image, truth = shown(dock, **tilt_deg)
    found = estimate(image, CAMERA, dock)
    for pose in found.candidates:
        # Put there by hand to half a per cent of 0.30 m, over the rod's length, and as the ring's lights may be.
        assert 0.0015 / height_m < min(pose.sigma_theta_rad) < max(pose.sigma_theta_rad) < 3 * 0.0015 / height_m
        assert math.radians(angle_deg(pose, truth)) < min(pose.sigma_theta_rad)
        assert 0.35 < pose.probability < 0.65
    assert sum(pose.probability for pose in found.candidates) == pytest.approx(1)


@pytest.mark.parametrize(("noise_px", "own_px2"), [(0.3, 0.09 + 0.25), (0.7, 0.49 + 0.25), (9.0, 1.0 + 0.25)])
def test_a_lamp_is_off_its_place_as_the_ring_s_lights_are_up_to_a_hundredth_of_the_diameter(noise_px, own_px2):
    image, _ = shown(RING)
    pose = estimate(image, CAMERA, RING).selected
    placed = replace(pose, position_m=np.array([0, 0, 700 * 0.30 / 100]), errors=replace(pose.errors, noise=noise_px))
    assert _own_px2(placed, CAMERA, DOCK) == pytest.approx(own_px2)  # by ruler half a pixel


@pytest.mark.parametrize("least", [0.0, 1e-310, 1e-12])
def test_a_pose_that_its_lights_rule_out_stays_ruled_out_by_a_lamp_that_is_seen(least):
    image, truth = shown(DOCK)
    found = estimate(image, CAMERA, RING)
    right = min((0, 1), key=lambda k: angle_deg(found.candidates[k], truth))
    sure = [replace(pose, probability=1.0 if k == right else least) for k, pose in enumerate(found.candidates)]
    choice, lights = replace(found.choice, candidates=tuple(sure)), found.markers.part(found.ring.on_ring)
    told = with_extra_lights(choice, image.astype(np.float32), (0, 0), lights, 1e-6, CAMERA, DOCK)
    assert np.isfinite(told.extra_px).all()
    assert angle_deg(told.candidates[0], truth) < 1
    assert [pose.probability for pose in told.candidates] == pytest.approx([1, 0], abs=1e-9)
    assert told.selected_by == found.choice.selected_by  # the lights had said so


def test_its_number_of_lights_untold_it_is_none_of_the_ring():
    dock = msgspec.structs.replace(DOCK, lights=None)
    image, _ = shown(DOCK)
    found = estimate(image, CAMERA, dock)
    assert found.lights_on_ring == 8
    assert np.isfinite(found.choice.extra_px).all()


def test_where_a_lamp_is_seen_has_a_density_that_sums_to_one_about_where_it_must_be():
    mean, spread = np.array([3.0, -2.0]), np.array([[4.0, 1.5], [1.5, 2.0]])
    edge = np.arange(-60, 60.5, 0.5)
    spots = mean + np.stack(np.meshgrid(edge, edge), axis=-1).reshape(-1, 2)
    density = _densities(spots, mean, spread)
    assert density.sum() * 0.25 == pytest.approx(1, abs=0.02)  # what is beyond 60 px of such long tails
    assert spots[density.argmax()].tolist() == mean.tolist()
    # Student's distribution of two dimensions and four degrees of freedom, at three deviations.
    across = np.linalg.cholesky(spread) @ [3.0, 0.0]
    there, here = _densities(np.array([mean + across, mean]), mean, spread)
    assert there / here == pytest.approx((1 + 3**2 / 4) ** -3)


@pytest.mark.parametrize("turn_deg", [0.0, 90.0])
def test_a_pose_and_a_lamp_that_is_seen_together_have_the_likeliest_pose_and_its_errors(turn_deg):
    """Held against the least squares of the pose's step, over its errors, and of the lamp, over its own."""
    dock = Dock(0.30, 8, extra_lights_m=((0.04, 0.02, 0.05), (-0.03, 0.0, 0.08)))
    rotation = Rotation.from_euler("yxz", [25.0, -15.0, 10.0], degrees=True).as_matrix()
    rng = np.random.default_rng(2)
    points_px = CAMERA.project(np.array(PLACE) + dock.light_points() @ rotation.T) + rng.normal(0, 0.3, (8, 2))
    pose = find_poses(points_px, CAMERA, dock)[1].candidates[0]
    turn = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    own_px = math.hypot(pose.errors.noise, 0.005 * 0.30 * CAMERA.fx / pose.position_m[2])  # and hands place a lamp
    rolled = pose.rotation @ Rotation.from_euler("z", pose.roll_rad).as_matrix() @ turn
    root = np.linalg.inv(np.linalg.cholesky(pose.errors.noise**2 * pose.errors.covariance))

    def lamps_px(step):
        turned = Rotation.from_rotvec(pose.errors.rotation @ step[3:]).apply(np.array(dock.extra_lights_m) @ rolled.T)
        return CAMERA.project(pose.position_m + step[:3] + turned)

    seen_px = lamps_px(np.zeros(6)) + [[2.0, -1.0], [np.nan, np.nan]]
    best = least_squares(
        lambda step: np.concatenate([root @ step, (seen_px - lamps_px(step))[0] / own_px]),
        np.zeros(6),
        x_scale=np.sqrt(np.diag(pose.errors.covariance)),
        xtol=1e-12,
        ftol=1e-12,
    )
    told = _refined(pose, turn, seen_px, 8, CAMERA, dock)
    np.testing.assert_allclose(told.position_m, pose.position_m + best.x[:3], atol=1e-5)
    turned = Rotation.from_rotvec(pose.errors.rotation @ best.x[3:])
    np.testing.assert_allclose(told.normal, turned.apply(pose.normal), atol=1e-4)
    told_whole = told.rotation @ Rotation.from_euler("z", told.roll_rad).as_matrix()
    np.testing.assert_allclose(told_whole, turned.as_matrix() @ rolled, atol=1e-4)
    assert 0 <= told.roll_rad < math.tau
    known = np.linalg.inv(best.jac.T @ best.jac)
    np.testing.assert_allclose(told.sigma_position_m, np.sqrt(np.diag(known)[:3]), rtol=0.02)
    assert math.hypot(*told.sigma_theta_rad) < math.hypot(*pose.sigma_theta_rad)
    # The lights' residuals grow by what the step costs them, over the noise.
    cost_px2 = float(((root @ best.x) ** 2).sum()) * pose.errors.noise**2
    assert 8 * told.rms_px**2 == pytest.approx(8 * pose.rms_px**2 + cost_px2, rel=0.02)


def test_spots_are_what_stands_out_beside_the_rings_lights_by_itself_and_is_no_glare():
    """Squares on a picture of which a part is shown: the ring's two of 5 pixels, others, one that runs together."""
    corner_px, light = np.array([20, 10]), np.full((120, 160), 10.0)
    for x, y, half, level in (
        *((40, 30, 2, 210), (100, 30, 2, 210)),  # the ring's
        *((60, 60, 2, 200), (90, 62, 1, 90)),  # a lamp, and a fainter one
        *((70, 90, 9, 255), (75, 30, 1, 30)),  # glare, and what is too faint
        *((105, 30, 2, 60), (110, 30, 2, 210)),  # a lamp that runs together with one of the ring's
        (150, 110, 2, 200),  # beyond what is looked at
    ):
        light[y - half : y + half + 1, x - half : x + half + 1] = level
    ring_px = np.array([[40.0, 30.0], [100.0, 30.0]])
    boxes, areas = np.hstack([ring_px - 2, ring_px + 2]).astype(int) + np.tile(corner_px, 2), np.array([25, 25])
    ring = Markers(ring_px + corner_px, areas, areas, boxes_px=boxes)
    means = np.array([[[[95.0, 70.0]]]])  # of one pose, turn and lamp; 4 standard errors of 10 px, and two lights
    spots, region_px2 = _spots(
        light, tuple(corner_px.tolist()), ring, means, np.full((1, 1, 1, 2, 2), 100.0) * np.eye(2)
    )
    assert sorted(spots.tolist()) == [[80.0, 70.0], [110.0, 72.0], [130.0, 40.0]]
    assert region_px2 == 97 * 97
