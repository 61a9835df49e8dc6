from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, compared
from dockpose.app.state.parameters import put

FOUR = ("otsu", "kapur", "kittler", "sezan")


def quiet():
    return Progress(lambda share: None)


def test_every_method_with_the_settings_of_the_view(view):
    told = []
    found = compare_view(put(view, "min_area_px", 3), Progress(told.append))
    assert tuple(found) == compared()
    assert all(one.settings.method == name and one.settings.min_area_px == 3 for name, one in found.items())
    assert told == sorted(told)
    assert told[-1] == 1.0
