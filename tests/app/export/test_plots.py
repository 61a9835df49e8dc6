import cv2
import numpy as np
from dockpose.app.export.plots import methods_beside, side_by_side
from dockpose.app.processing.analysis import analyse


def test_no_light_is_lost_where_pictures_are_small_and_what_is_kept_is_white():
    """Ten single pixels, far apart, in a picture that is drawn at a quarter of its size."""
    lit = np.zeros((480, 640), bool)
    lit[np.arange(20, 470, 47), np.arange(13, 620, 63)] = True
    assert lit.sum() == 10
    figure = side_by_side([("kept", lit)] * 7, 5)
    assert len(figure.axes) == 10  # the last three are empty
    for axes in figure.axes[:7]:
        shown = np.asarray(axes.images[0].get_array())
        assert shown.shape[1] <= 640 / 3
        assert cv2.connectedComponents(shown.astype(np.uint8))[0] - 1 == 10
    assert [len(axes.images) for axes in figure.axes[7:]] == [0] * 3


def test_picture_and_methods_have_their_levels_above_them(view):
    found = analyse(view).estimate
    assert found.threshold is not None
    (first, grey), (second, kept) = methods_beside("tank", view.image, {"hats": found}, {"hats": "HATS"})
    assert (first, second) == ("tank", f"HATS: {found.threshold.level}")
    np.testing.assert_array_equal(kept, grey >= found.threshold.level)
