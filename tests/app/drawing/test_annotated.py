import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, estimate
from dockpose.app.drawing.annotated import annotate
from dockpose.camera.port import FlatPort
from dockpose.estimate.geometry import in_picture
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.fixture(scope="module")
def scene() -> tuple[np.ndarray, Estimate]:
    image, _ = render(random_scene(2, theta_x_deg=25.0, theta_y_deg=-20.0, position_m=(0.0, 0.05, 0.9)))
    return image, estimate(image, CAMERA, DOCK)


def test_the_picture_is_full_size_colour_and_a_copy(scene):
    image, found = scene
    before = image.copy()
    drawn = annotate(image, found)
    assert drawn.shape == (480, 640, 3)
    assert drawn.dtype == np.uint8
    np.testing.assert_array_equal(image, before)


def changed_near(image, drawn, point, reach=12):
    x, y = np.rint(point).astype(int)
    window = np.s_[y - reach : y + reach + 1, x - reach : x + reach + 1]
    return bool((drawn[window] != image[window][..., None]).any())


def test_lights_centres_and_normals_are_marked_where_they_are(scene):
    image, found = scene
    drawn = annotate(image, found)
    for point in found.markers.points_px:
        assert changed_near(image, drawn, point)
    assert changed_near(image, drawn, found.ellipse.centre_px, reach=3)
    for pose in found.candidates:
        tip = CAMERA.project([pose.position_m + 1.3 * DOCK.radius * pose.normal])[0]
        assert changed_near(image, drawn, tip, reach=3)
    assert not changed_near(image, drawn, (600, 400))


def test_the_two_poses_have_their_own_colours(scene):
    image, found = scene
    drawn = annotate(image, found)
    for colour in ((178, 114, 0), (0, 159, 230)):  # Okabe-Ito blue and orange, BGR
        # Thin antialiased lines mix with the water, hence near the colour.
        assert (np.abs(drawn.astype(int) - colour).max(axis=2) < 40).sum() > 50


@pytest.mark.parametrize("picture", ["grey", "bgr", "16 bit"])
def test_any_kind_of_picture_can_be_drawn_on(scene, picture):
    image, _ = scene
    kinds = {"grey": image, "bgr": np.dstack([image] * 3), "16 bit": image.astype(np.uint16) << 8}
    found = estimate(kinds[picture], CAMERA, DOCK)
    assert annotate(kinds[picture], found).shape == (480, 640, 3)


def test_a_picture_without_a_dock_says_so_and_is_drawn():
    image = np.full((480, 640), 10, np.uint8)
    drawn = annotate(image, estimate(image, CAMERA, DOCK))
    assert (drawn[:60, :200] != 10).any()
    assert (drawn[200:] == 10).all()


def test_a_tiny_picture_is_no_fault():
    image = np.full((3, 4), 10, np.uint8)
    camera = CAMERA.for_size(4, 3)
    assert annotate(image, estimate(image, camera, Dock(0.3))).shape == (3, 4, 3)


def test_behind_a_port_the_ellipse_runs_through_the_lights():
    camera = Camera(500, 500, 319.5, 239.5, 640, 480, port=FlatPort(0.03, 0.01))
    image, truth = render(random_scene(2, camera=camera, position_m=(0.15, -0.08, 0.9), theta_x_deg=25.0))
    found = estimate(image, camera, DOCK)
    assert found.ellipse is not None
    outline = in_picture(found, found.ellipse.points(720))
    for light in truth.lights_px:
        assert np.linalg.norm(outline - light, axis=1).min() < 0.8  # a step of the outline is 1 px
    drawn = annotate(image, found)
    for point in outline[::60]:
        assert changed_near(image, drawn, point, reach=2)
    # The lens alone, which does not know how far away the dock is, would put it elsewhere.
    assert np.linalg.norm(camera.distort(found.ellipse.points(720)) - outline, axis=1).max() > 10
