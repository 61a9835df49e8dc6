from dataclasses import replace

from dockpose.app.processing import comparison
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, compared
from dockpose.app.state.parameters import put


def quiet():
    return Progress(lambda share: None)


def test_every_method_with_the_settings_of_the_view(view):
    told = []
    found = compare_view(put(view, "min_area_px", 3), Progress(told.append))
    assert tuple(found) == compared()
    assert all(one.settings.method == name and one.settings.min_area_px == 3 for name, one in found.items())
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_times_are_those_of_later_runs_and_what_takes_long_by_itself_is_not_repeated(view, monkeypatch):
    """The first run of a method may import what it needs; one of 0.8 s is run once more, and one of 4 s never."""
    runs = {"hats": [1100.0, 20.0, 22.0, 21.0], "otsu": [800.0, 810.0], "li": [4000.0]}
    left = {name: iter(times) for name, times in runs.items()}
    one = analyse(view).estimate

    def compare(image, camera, dock, settings, methods):
        return {name: replace(one, elapsed_ms=next(left[name])) for name in methods}

    monkeypatch.setattr(comparison, "compare", compare)
    monkeypatch.setattr(comparison, "compared", lambda: tuple(runs))
    found = compare_view(view, quiet())
    assert {name: one.elapsed_ms for name, one in found.items()} == {"hats": 21.0, "otsu": 810.0, "li": 4000.0}
    assert [next(rest, None) for rest in left.values()] == [None] * 3
