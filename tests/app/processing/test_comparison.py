from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.processing.comparison import compare, compare_view, compared, sweep_levels
from dockpose.app.state.parameters import put
from dockpose.app.web.panels.source import SAMPLE_WORDS
from dockpose.pose.known import pose_error

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


def test_sweep_of_the_true_centre_is_the_best_of_three(view):
    present = analyse(view).estimate
    assert present.threshold is not None
    level = present.threshold.level
    sweep = sweep_levels(view, present, quiet(), [level - 20, level, 255])
    assert sweep.reference == "the true centre"
    assert np.isnan(sweep.errors_px[2]).all()  # nothing is found there
    _, ellipse, true = sweep.errors_px[1]
    assert true < 0.2
    assert ellipse > true


def test_sweep_is_shown_as_it_grows_and_stops_at_the_next_step(view):
    grown, progress = [], quiet()
    whole = sweep_levels(view, analyse(view).estimate, progress, [100, 120, 255], grown.append)
    assert [one.levels.tolist() for one in grown] == [[100], [100, 120], [100, 120, 255]]
    for one in grown:
        np.testing.assert_array_equal(one.errors_px, whole.errors_px[: len(one.levels)])
    progress.stop()
    with pytest.raises(CancelledError):
        sweep_levels(view, analyse(view).estimate, progress, [100, 120, 255], grown.append)
    assert len(grown) == 3


def test_sweep_without_truth_is_measured_against_what_is_found(view):
    unknown = replace(view, truth=None)
    present = analyse(unknown).estimate
    assert present.threshold is not None
    sweep = sweep_levels(unknown, present, quiet(), [present.threshold.level])
    assert sweep.errors_px[0, 2] == pytest.approx(0, abs=0.01)
    assert "present settings" in sweep.reference


@pytest.mark.parametrize(
    ("name", "hats_is_right", "others_right"),
    [
        ("harbour_glare", True, ()),
        ("sunlit", True, ("sezan",)),
        ("faint", True, ("kapur",)),
        ("side_glow", False, ("kapur", "kittler", "sezan")),
    ],
)
def test_methods_differ_on_some_samples_and_hats_is_not_always_the_best(name, hats_is_right, others_right):
    sample = load_sample(name)
    found = compare(sample.image, sample.camera, sample.dock, methods=("hats", "hats_local", *FOUR))
    errors = {method: pose_error(one.selected, sample.truth) for method, one in found.items()}
    right = {method for method, error in errors.items() if error is not None and error.agrees}
    assert right == {"hats_local", *others_right} | ({"hats"} if hats_is_right else set())
    assert name in SAMPLE_WORDS
