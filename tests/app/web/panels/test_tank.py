from dockpose import Dock
from dockpose.app.state.camera import with_own_dock
from dockpose.app.web.panels.tank import CameraPanel, with_focal
from dockpose.dock import DockRing, Entrance


def test_one_focal_length_or_both(view):
    assert with_focal(view, "fx", 800, both=False).camera.fy == view.camera.fy
    both = with_focal(view, "fy", 800, both=True).camera
    assert (both.fx, both.fy) == (800, 800)


def test_numbers_of_a_dock_of_rings_cannot_be_set_and_it_says_why(app):
    panel = app._layout.of(CameraPanel)
    handles = panel.sliders["diameter_cm"].handle, panel._lights, panel._angles, panel._set_angles
    rings = DockRing(0.6, 8, name="outer"), DockRing(0.2, 4, name="inner")
    for dock, has_rings in ((Dock(rings=rings, entrance=Entrance()), True), (Dock(0.3, 10), False)):
        app.change(lambda view, dock=dock: with_own_dock(view, dock), reload=True)
        assert [handle.disabled for handle in handles] == [has_rings] * 4
        assert ("outer 60 cm with 8 lights, inner 20 cm with 4 lights" in panel._rings.content) == has_rings
