from dockpose.app.web.panels.tank import with_focal


def test_one_focal_length_or_both(view):
    assert with_focal(view, "fx", 800, both=False).camera.fy == view.camera.fy
    both = with_focal(view, "fy", 800, both=True).camera
    assert (both.fx, both.fy) == (800, 800)
