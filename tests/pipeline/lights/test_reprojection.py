import numpy as np
import pytest
from dockpose.lights.reprojection import (
    LightRays,
    RingTemplate,
    as_pose,
    farthest_off,
    fit_affine,
    inverse_of,
    one_pose,
    solve,
    stretch,
    sum_products,
    times,
    turn,
)
from scipy.spatial.transform import Rotation

FOCAL_PX = 700.0
ANGLES = np.arange(7) * 2 * np.pi / 7 + 0.3
UNIT = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


def homography(rotvec, t):
    """Of the plane of a circle of radius 1 in the picture, from the principal point; 1 at the circle's middle."""
    mapping = np.diag([FOCAL_PX, FOCAL_PX, 1]) @ np.column_stack([Rotation.from_rotvec(rotvec).as_matrix()[:, :2], t])
    return mapping / mapping[2, 2]


def seen(mapping, unit=UNIT):
    places = np.column_stack([unit, np.ones(len(unit))]) @ mapping.T
    return places[:, :2] / places[:, 2:]


def template(points, tolerance_px=2.0):
    return RingTemplate(np.ascontiguousarray(points), UNIT, FOCAL_PX, tolerance_px)


@pytest.fixture
def scene():
    """Lights (5, 3), a bit out of their plane, where they are, and rays that miss them a little, through a port."""
    rng = np.random.default_rng(3)
    lights = np.column_stack([UNIT[:5], rng.normal(0, 0.1, 5)])
    R, t = Rotation.from_rotvec([0.5, -0.4, 0.7]).as_matrix(), np.array([0.3, -0.6, 4.0])
    starts_m = np.array([0.0, 0.1, 0.2, 0.15, 0.05])
    X = lights @ R.T + t
    tangents = X[:, :2] / (X[:, 2] - starts_m)[:, None] + rng.normal(0, 0.01, (5, 2))
    return R, t, lights, LightRays(tangents, starts_m, rng.normal(0, 100, (5, 2, 2)) + 700 * np.eye(2))


def residuals(step, R, t, lights, rays):
    """How far each ray (N, 2) is off its light, at the light's depth and in pixels; turns are about the dock's axes."""
    X = lights @ (R @ Rotation.from_rotvec(step[3:]).as_matrix()).T + t + step[:3]
    off = rays.tangents - (X[:, :2] + rays.tangents * rays.starts_m[:, None]) / X[:, 2:]
    slopes = np.broadcast_to(rays.slopes_px, (len(lights), 2, 2))
    return np.einsum("nij,nj->ni", slopes, off)


def rows_by_differences(*scene):
    """(N, 2, 7): what a step changes, by differences, and the residuals."""
    step = 1e-6 * np.eye(6)
    columns = [(residuals(-one, *scene) - residuals(one, *scene)) / 2e-6 for one in step]
    return np.stack([*columns, residuals(np.zeros(6), *scene)], axis=2)


@pytest.mark.parametrize("has_one_slope", [False, True])
def test_the_normal_equations_are_those_of_the_residuals_differences(scene, has_one_slope):
    R, t, lights, rays = scene
    if has_one_slope:
        rays = rays._replace(slopes_px=rays.slopes_px[:1].copy())
    products = np.full((9, 7), np.nan)
    sum_products(products, R, t, lights, rays, False)
    rows = rows_by_differences(R, t, lights, rays)
    np.testing.assert_allclose(products[7:], rows[-1], rtol=1e-6, atol=1e-5)
    flat = rows.reshape(-1, 7)
    np.testing.assert_allclose(products[:7], flat.T @ flat, rtol=1e-6, atol=1e-3)


def test_a_free_light_counts_across_the_circle_alone(scene):
    products = np.full((9, 7), np.nan)
    sum_products(products, *scene, True)
    rows = rows_by_differences(*scene)
    along = rows[:, :, 5] / np.linalg.norm(rows[:, :, 5], axis=1)[:, None]
    across = np.einsum("ni,nij->nj", np.column_stack([-along[:, 1], along[:, 0]]), rows)
    across[:, 5] = 0  # a turn about the dock's own axis
    np.testing.assert_allclose(products[:7], across.T @ across, rtol=1e-6, atol=1e-2)


def test_a_turn_is_a_rotation_about_the_docks_axes():
    start = Rotation.from_rotvec([0.3, 1.1, -0.2]).as_matrix()
    for w in np.array([[0.01, 0, 0], [0, -0.02, 0], [0, 0, 0.03], [0.2, -0.15, 0.1]]):
        R = start.copy()
        turn(R, *w)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        # Cayley's transform turns about w by 2 atan(|w| / 2).
        size = np.linalg.norm(w)
        expected = start @ Rotation.from_rotvec(w / size * 2 * np.arctan(size / 2)).as_matrix()
        np.testing.assert_allclose(R, expected, atol=1e-12)


def test_equations_are_solved_as_by_lapack():
    rng = np.random.default_rng(1)
    factor, right = rng.normal(size=(6, 6)), rng.normal(size=(6, 3))
    A = factor @ factor.T + 0.1 * np.eye(6)
    expected = np.linalg.solve(A, right)
    solve(A, right)
    np.testing.assert_allclose(right, expected, rtol=1e-9)


def test_a_symmetric_matrix_is_inverted_and_multiplied():
    xx, xy, xz, yy, yz, zz = entries = 4.0, 1.0, -0.5, 3.0, 0.7, 2.0
    A = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_allclose(inverse_of(*entries), np.linalg.inv(A)[np.triu_indices(3)], rtol=1e-12)
    np.testing.assert_allclose(times(*entries, 2.0, -3.0, 5.0), A @ [2, -3, 5], rtol=1e-12)


def test_the_affine_part_is_that_of_least_squares():
    points = seen(homography([0.5, 0.2, 0.1], [0.2, 0.1, 5])) + np.random.default_rng(0).normal(0, 1, (7, 2))
    # Two corners have no point, and points are in another order.
    corners, px, py = np.array([3, -1, 5, 0, 2, -1, 4]), 0.05, -0.08
    mapping = np.full((3, 3), np.nan)
    squares = fit_affine(template(points), corners, px, py, mapping)
    lit = corners >= 0
    weight = 1 + UNIT[lit] @ [px, py]
    columns = np.column_stack([UNIT[lit], np.ones(5)]) / weight[:, None]
    # Plain least squares in the picture: what is fitted is (a u + b v + c) / w.
    (rows, left, *_) = np.linalg.lstsq(columns, points[corners[lit]], rcond=None)
    np.testing.assert_allclose(mapping, np.vstack([rows.T, [px, py, 1]]), rtol=1e-7, atol=1e-9)
    assert squares == pytest.approx(left.sum(), rel=1e-6)


def test_points_off_their_corners_are_summed_and_the_worst_is_told():
    mapping = homography([0.4, 0.1, 0], [0.1, 0, 6])
    mapping = mapping * 1.7  # a homography has no scale
    points = seen(mapping)
    points[2] += [3, -4]
    points[4] += [0, 2]
    points[5] += [100, 0]
    corners = np.array([0, 1, 2, 3, 4, -1, 6])
    assert farthest_off(template(points), corners, mapping) == 2


def test_how_the_middle_is_stretched_is_by_singular_values():
    mapping = homography([0.6, -0.3, 0.4], [0.5, -0.2, 3])
    step = 1e-5
    around = seen(mapping, np.array([[step, 0], [-step, 0], [0, step], [0, -step]]))
    slopes = np.column_stack([around[0] - around[1], around[2] - around[3]]) / (2 * step)
    np.testing.assert_allclose(stretch(mapping), np.linalg.svd(slopes, compute_uv=False), rtol=1e-6)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("rotvec", "t"),
    [((0.6, 0.2, 0.3), (0.4, -0.3, 4)), ((-0.5, 0.4, -1), (-0.5, 0.6, 3)), ((0.1, -0.7, 0), (0, 0.8, 3))],
)
def test_one_of_the_two_poses_near_a_homography_is_exact_and_is_taken(rotvec, t, sign):
    truth = homography(rotvec, t)
    points, corners = seen(truth), np.arange(7)
    start = truth.copy()
    start[2, :2] = 0  # without perspective, as three lights give it
    one, other = one_pose(template(points), corners, start, sign), one_pose(template(points), corners, start, -sign)
    least, best = as_pose(template(points), corners, start)
    assert least == min(one[0], other[0]) < 1e-3
    np.testing.assert_allclose(best, truth, rtol=1e-4, atol=1e-4)
    for _, mapping in (one, other):  # each is a circle's picture: of perpendicular, equal radii
        columns = np.linalg.inv(np.diag([FOCAL_PX, FOCAL_PX, 1])) @ mapping
        assert columns[:, 0] @ columns[:, 1] == pytest.approx(0, abs=1e-6)
        assert np.linalg.norm(columns[:, 0]) == pytest.approx(np.linalg.norm(columns[:, 1]), rel=1e-6)
