from dockpose import Camera
from dockpose.app.state.view import open_source
from dockpose.app.web.panels.tank import with_focal


def test_one_focal_length_or_both(view):
    assert with_focal(view, "fx", 800, both=False).camera.fy == view.camera.fy
    both = with_focal(view, "fy", 800, both=True).camera
    assert (both.fx, both.fy) == (800, 800)


def test_both_keep_the_ratio_of_the_file_where_pixels_are_not_square():
    tall = open_source(None, Camera(600, 900, 319.5, 239.5, 640, 480), None)
    by_fx, by_fy = with_focal(tall, "fx", 700, both=True).camera, with_focal(tall, "fy", 750, both=True).camera
    assert (by_fx.fx, by_fx.fy, by_fy.fx, by_fy.fy) == (700, 1050, 500, 750)
