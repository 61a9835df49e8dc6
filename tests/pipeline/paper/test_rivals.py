import numpy as np
import pytest
from dockpose.paper import rivals
from dockpose.paper.levels import Picture
from dockpose.paper.rivals import ANY_LEVEL, COLUMNS, OURS, PER_LIGHT, RIVALS, STEPS, literal_hats, local_peaks
from dockpose.paper.scenes import tank_scenes
from dockpose.thresholds import histogram_of
from dockpose.thresholds.hats import hats


def test_local_peaks_of_a_histogram_by_hand():
    counts = np.zeros(256, int)
    counts[[0, 1, 2, 3, 7, 8, 9, 255]] = [5, 2, 4, 4, 1, 3, 3, 1]
    # 0 and 255 are ends; of 2 and 3, and of 8 and 9, the darker is the peak.
    assert local_peaks(counts).tolist() == [255, 8, 2, 0]


@pytest.mark.parametrize(
    ("noise", "steps", "elected"),
    [
        # Peaks at 200, 100 and 10 with 3, 4 and 1 groups; of counts with one vote each the largest is elected.
        ({}, (), 100),
        # Single pixels make peaks at 60 and 50 with 5 and 6 groups, which a minimum area does not count.
        ({5: 60, 15: 50}, (), 50),
        ({5: 60, 15: 50}, ("minimum area",), 100),
    ],
)
def test_votes_by_hand(noise, steps, elected):
    # Three lights of level 200 and one of 100, four pixels each, on a background of 10; and single pixels.
    picture = np.full((20, 20), 10, np.uint8)
    for row, column, level in ((2, 2, 200), (2, 10, 200), (10, 2, 200), (10, 10, 100)):
        picture[row : row + 2, column : column + 2] = level
    for column, level in noise.items():
        picture[17, column] = level
    assert literal_hats(histogram_of(picture), steps) == elected


def test_a_count_that_is_interrupted_has_the_votes_of_its_longest_run():
    picture = np.full((12, 30), 10, np.uint8)
    # Two lights of 150, joined at 100: two groups above 100, one below it, and from 40 down the third light.
    picture[2:4, 2:4] = picture[2:4, 6:8] = 150
    picture[2:4, 4:6] = 100
    picture[2:4, 20:22] = 40
    # Two groups at 101 to 150 and at 11 to 40, 80 levels; one at 41 to 100 and 0 to 10, 71 levels, but 60 in a row.
    for steps, elected in (("every level",), 150), (("every level", "unbroken run"), 100):
        assert literal_hats(histogram_of(picture), steps) == elected


@pytest.mark.parametrize("name", ["plain tank", "glow in turbid water", "reflections"])
def test_the_last_step_before_ours_chooses_as_ours_where_its_first_look_is_sure(name):
    histogram = Picture(tank_scenes(3)[name]).histogram
    assert literal_hats(histogram, STEPS["+ clear of noise"]) == hats(histogram, 2).level


@pytest.mark.slow
def test_what_every_method_finds_is_counted_scene_by_scene(monkeypatch):
    monkeypatch.setattr(rivals, "SCENES_A_HALF", 2)
    methods, schemes = rivals.compare_methods(4), rivals.compare_schemes(4)
    for tally, names in ((methods, ["hats", *RIVALS]), (schemes, [*STEPS, OURS])):
        more = {"exact": [ANY_LEVEL], "plain_chain": [], "right": [PER_LIGHT]}
        assert {column: list(of) for column, of in tally.items()} == {one: [*names, *more[one]] for one in COLUMNS}
        assert {len(came) for of in tally.values() for came in of.values()} == {4}
    for column in ("exact", "right"):  # the same scenes and the same method in both
        np.testing.assert_array_equal(methods[column]["hats"], schemes[column][OURS])
    # No method shows the lights where no level does.
    assert not any((came & ~methods["exact"][ANY_LEVEL]).any() for came in methods["exact"].values())
