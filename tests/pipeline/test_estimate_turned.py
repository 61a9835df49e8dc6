"""A picture with its rows and columns changed for one another, or as a mirror shows it, has all of its answers so."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false, reportOptionalSubscript=false
# pyright: reportAttributeAccessIssue=false, reportCallIssue=false

import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.pose.circle import rotation_from_angles

WIDTH, HEIGHT = 320, 240
CAMERA = Camera(
    300.0, 310.0, 155.0, 118.0, WIDTH, HEIGHT, sigma={"fx_px": 3.0, "fy_px": 4.0, "cx_px": 1.0, "cy_px": 2.0}
)
DOCK = Dock(0.30, 10)
SWAP = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])
FLIP = np.diag([-1.0, 1, 1])


class Transposed:
    """Rows for columns."""

    turn = SWAP
    camera = Camera(
        310.0, 300.0, 118.0, 155.0, HEIGHT, WIDTH, sigma={"fx_px": 4.0, "fy_px": 3.0, "cx_px": 2.0, "cy_px": 1.0}
    )

    @staticmethod
    def image(grey):
        return np.ascontiguousarray(grey.T)

    @staticmethod
    def points(points_px, width=WIDTH):
        return points_px[..., ::-1]

    @staticmethod
    def boxes(boxes_px, width=WIDTH):
        return boxes_px[:, [1, 0, 3, 2]]


class Mirrored:
    """Left for right."""

    turn = FLIP
    camera = Camera(
        300.0, 310.0, 319 - 155.0, 118.0, WIDTH, HEIGHT, sigma={"fx_px": 3.0, "fy_px": 4.0, "cx_px": 1.0, "cy_px": 2.0}
    )

    @staticmethod
    def image(grey):
        return np.ascontiguousarray(grey[:, ::-1])

    @staticmethod
    def points(points_px, width=WIDTH):
        return points_px * [-1, 1] + [width - 1, 0]

    @staticmethod
    def boxes(boxes_px, width=WIDTH):
        return np.column_stack([width - 1 - boxes_px[:, 2], boxes_px[:, 1], width - 1 - boxes_px[:, 0], boxes_px[:, 3]])


WAYS = pytest.mark.parametrize("way", [Transposed, Mirrored])


def lamps(position_m, angles_rad, count=10, radius_m=0.15):
    around = 2 * np.pi * np.arange(count) / count + 0.3
    flat = radius_m * np.column_stack([np.cos(around), np.sin(around), 0 * around])
    return position_m + flat @ rotation_from_angles(*angles_rad).T


def drawn(lights_m, height=150.0, spread_px=1.6, *, noise=2.0, slope=0.05, seed=0):
    """Gaussian lamps on water that brightens to one corner, with noise; some saturate where they are bright."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    grey = 20 + slope * (x + 0.6 * y) + np.random.default_rng(seed).normal(0, noise, (HEIGHT, WIDTH))
    for u, v in CAMERA.project(lights_m):
        grey += height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * spread_px**2))
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


NEAR, TILT = np.array([0.06, -0.04, 0.75]), (0.35, -0.4)
SCENES = {
    "plain": drawn(lamps(NEAR, TILT)),
    "saturated": drawn(lamps(NEAR, TILT), 900.0),
    "faint": drawn(lamps(NEAR, TILT), 14.0, noise=3.0),
    "some out": drawn(np.delete(lamps(NEAR, TILT), [2, 3, 7], axis=0)),
    "four": drawn(lamps(NEAR, TILT)[:4]),
    "two docks": drawn(
        np.vstack([lamps([-0.27, 0.02, 1.0], (0.1, 0.3)), lamps([0.27, -0.03, 1.15], (-0.2, 0.3))]), spread_px=1.2
    ),
    "cut": drawn(lamps([0.3, 0.0, 0.75], TILT)),
}


def same_as(found, other, way):
    """Hold all numbers of one picture's estimate against those of the other."""
    assert (found.status, found.lights_on_ring) == (other.status, other.lights_on_ring)
    assert found.threshold.level == other.threshold.level
    if found.status != "ok":
        return
    one, twins = (each.markers.part(each.ring.on_ring) for each in (found, other))
    apart = np.linalg.norm(way.points(one.points_px)[:, None] - twins.points_px[None], axis=2)
    order = apart.argmin(axis=1)
    # What squares of pixels show begins with other pixels; and centres of few lights are not fitted.
    is_exact = found.threshold.groups is None and found.lights_on_ring > 4
    assert apart.min(axis=1).max() < (0.02 if is_exact else 0.15)
    if not is_exact:
        return
    np.testing.assert_allclose(one.areas_px, twins.areas_px[order], atol=1)
    np.testing.assert_array_equal(one.peaks, twins.peaks[order])
    assert [rival.sum() for rival in found.ring.rivals] == [rival.sum() for rival in other.ring.rivals]
    assert found.detection == pytest.approx(other.detection, abs=1e-3)
    turned = [way.turn @ pose.position_m for pose in found.candidates]
    pairs = [
        min(other.candidates, key=lambda b, a=a: np.linalg.norm(way.turn @ a.normal - b.normal))
        for a in found.candidates
    ]
    for pose, place_m, twin in zip(found.candidates, turned, pairs, strict=True):
        np.testing.assert_allclose(twin.position_m, place_m, atol=2e-5)
        np.testing.assert_allclose(twin.normal, way.turn @ pose.normal, atol=1e-3)
        np.testing.assert_allclose(twin.centre_px, way.points(pose.centre_px), atol=2e-2)
        assert twin.probability == pytest.approx(pose.probability, abs=1e-3)
        assert twin.rms_px == pytest.approx(pose.rms_px, abs=1e-3)
        np.testing.assert_allclose(twin.sigma_position_m, np.abs(way.turn @ pose.sigma_position_m), rtol=2e-2)
        np.testing.assert_allclose(
            twin.sigma_total_position_m, np.abs(way.turn @ pose.sigma_total_position_m), rtol=2e-2
        )


@WAYS
@pytest.mark.parametrize("scene", SCENES)
def test_an_estimate_turns_with_its_picture(scene, way):
    grey = SCENES[scene]
    same_as(estimate(grey, CAMERA, DOCK), estimate(way.image(grey), way.camera, DOCK), way)


@pytest.mark.parametrize("scene", SCENES)
def test_a_dock_twice_as_large_is_seen_twice_as_far_away(scene):
    one, other = (estimate(SCENES[scene], CAMERA, Dock(diameter, 10)) for diameter in (0.30, 0.60))
    assert (one.status, one.lights_on_ring) == (other.status, other.lights_on_ring)
    assert one.detection == pytest.approx(other.detection)
    for pose, twin in zip(one.candidates, other.candidates, strict=True):
        np.testing.assert_allclose(twin.position_m, 2 * pose.position_m, rtol=1e-5)
        np.testing.assert_allclose(twin.normal, pose.normal, atol=1e-5)
        assert twin.probability == pytest.approx(pose.probability, abs=1e-5)
        assert twin.rms_px == pytest.approx(pose.rms_px, rel=1e-3)
        np.testing.assert_allclose(twin.sigma_position_m, 2 * np.array(pose.sigma_position_m), rtol=1e-3)
        np.testing.assert_allclose(twin.sigma_total_position_m, 2 * np.array(pose.sigma_total_position_m), rtol=1e-3)
        np.testing.assert_allclose(twin.sigma_total_theta_rad, pose.sigma_total_theta_rad, rtol=1e-3)
