import cv2
import numpy as np
import pytest
from dockpose import Dock, Settings, estimate
from dockpose.estimate.flow import picture_in
from dockpose.pose.circle import rotation_from_angles

from tests.support.scenes import CAMERA

PLACE_M = np.array([0.05, 0.02, 1.2])


def drawn(lights, *spots):
    """So many lights of four pixels 1.2 m ahead, and spots (x, y) as large, and the dock's normal."""
    turn = rotation_from_angles(0.3, -0.4, 0.4)
    picture = np.zeros((480, 640), np.uint8)
    for x, y in [*CAMERA.project(PLACE_M + Dock(0.30, lights).light_points() @ turn.T), *spots]:
        cv2.circle(picture, (round(16 * x), round(16 * y)), 4 * 16, 255, -1, cv2.LINE_AA, 4)
    return cv2.GaussianBlur(picture, (0, 0), 1), -turn[:, 2]


@pytest.mark.parametrize("told", [4, None])
def test_four_lights_beside_a_spot_are_a_dock_of_four_whether_that_is_told_or_not(told):
    image, normal = drawn(4, (60, 60))
    found = estimate(image, CAMERA, Dock(0.30, told))
    assert found.status == "ok"
    assert found.ring is not None
    assert found.selected is not None
    assert (found.ring.lights, found.lights_on_ring) == (4, 4)
    np.testing.assert_allclose(found.selected.position_m, PLACE_M, atol=0.002)
    assert found.selected.normal @ normal > np.cos(np.radians(1))


@pytest.mark.parametrize(
    ("lights", "told", "words"),
    [
        (4, None, "Only 4 groups of bright pixels at level {level}; an ellipse needs 5. Four do if the dock's number"),
        (3, None, "Only 3 groups of bright pixels at level {level}; an ellipse needs 5."),
        (3, 10, "Only 3 groups of bright pixels at level {level}; an ellipse needs 5."),
    ],
)
def test_too_few_lights_are_counted_and_what_would_help_is_said(lights, told, words):
    found = estimate(drawn(lights)[0], CAMERA, Dock(0.30, told))
    assert found.status == "too_few_markers"
    assert found.threshold is not None
    assert found.message.startswith(words.format(level=found.threshold.level))
    assert ("Four do" in found.message) == ("Four do" in words)


def test_a_region_is_all_that_is_looked_at():
    image = np.arange(40 * 60, dtype=np.uint16).reshape(40, 60)
    picture = picture_in(image, CAMERA, Settings(), (10, 6, 20, 14))
    assert (picture.part, picture.width, picture.height) == ((10, 6, 30, 20), 60, 40)
    np.testing.assert_array_equal(picture.image, image[6:20, 10:30])
