import numpy as np
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_method
from dockpose.app.web.scene.scene import grid_cell_m, picture_on_plane


def test_picture_on_its_plane_is_bright_around_the_ring_and_there_alone(view):
    """The ring's lights lie on an ellipse: at its middle the plane is lit, at the picture's corners it is not."""
    found = analyse(view).estimate
    plane = picture_on_plane(view.image, found, 320)
    assert plane.shape == (240, 320, 4)
    assert found.markers is not None
    assert found.ring is not None
    lights = found.markers.points_px[found.ring.on_ring] / 2
    x, y = lights.mean(axis=0).astype(int)
    corners = plane[[0, 0, -1, -1], [0, -1, 0, -1], :3]
    assert plane[y, x, :3].min() > corners.max() + 40
    for light_x, light_y in lights.astype(int):
        assert plane[light_y, light_x, :3].min() > 200


def test_picture_without_a_ring_is_lit_nowhere(view):
    found = analyse(with_method(view, "fixed", 255)).estimate
    blank = np.full((240, 320), 7, np.uint8)
    assert not picture_on_plane(blank, found, 160)[:, :, :3].any()


def test_grid_has_about_eight_squares_to_the_dock():
    assert [grid_cell_m(depth_m) for depth_m in (0.08, 0.6, 4.0, 1000.0)] == [0.01, 0.1, 0.5, 5.0]
