import numpy as np
import pytest
from dockpose.paper import rivals
from dockpose.paper.levels import Picture
from dockpose.paper.rivals import ANY_LEVEL, COLUMNS, OURS, PER_LIGHT, RIVALS, STEPS, Scheme, literal_hats, local_peaks
from dockpose.paper.scenes import tank_scenes
from dockpose.thresholds import histogram_of
from dockpose.thresholds.hats import hats


def test_local_peaks_of_a_histogram_by_hand():
    counts = np.zeros(256, int)
    counts[[0, 1, 2, 3, 7, 8, 9, 255]] = [5, 2, 4, 4, 1, 3, 3, 1]
    # 0 and 255 are ends; of 2 and 3, and of 8 and 9, the darker is the peak.
    assert local_peaks(counts).tolist() == [255, 8, 2, 0]


@pytest.mark.parametrize(
    ("noise", "min_area_px", "candidates", "counts", "elected"),
    [
        # Of several counts with one vote each the largest is elected.
        ({}, 1, [200, 100, 10], [3, 4, 1], (100, 4)),
        # Single pixels mislead the literal reading, and not the one with a minimum area.
        ({5: 60, 15: 50}, 1, [200, 100, 60, 50, 10], [3, 4, 5, 6, 1], (50, 6)),
        ({5: 60, 15: 50}, 2, [200, 100, 60, 50, 10], [3, 4, 4, 4, 1], (100, 4)),
    ],
)
def test_votes_by_hand(noise, min_area_px, candidates, counts, elected):
    # Three lights of level 200 and one of 100, four pixels each, on a background of 10; and single pixels.
    picture = np.full((20, 20), 10, np.uint8)
    for row, column, level in ((2, 2, 200), (2, 10, 200), (10, 2, 200), (10, 10, 100)):
        picture[row : row + 2, column : column + 2] = level
    for column, level in noise.items():
        picture[17, column] = level
    vote = literal_hats(histogram_of(picture), Scheme(min_area_px))
    assert (vote.candidates.tolist(), vote.counts.tolist()) == (candidates, counts)
    assert (vote.level, vote.groups) == elected


def test_a_count_that_is_interrupted_has_the_votes_of_its_longest_run():
    picture = np.full((12, 30), 10, np.uint8)
    # Two lights of 40 and 200, joined at 100: two groups above 100, one below it, and from 40 down the third light.
    picture[2:4, 2:4] = picture[2:4, 6:8] = 200
    picture[2:4, 4:6] = 100
    picture[2:4, 20:22] = 40
    histogram = histogram_of(picture)
    every = literal_hats(histogram, Scheme(has_every_level=True))
    in_a_row = literal_hats(histogram, Scheme(has_every_level=True, in_a_row=True))
    # Two groups at 101 to 200 and at 11 to 40: 130 levels; one at 41 to 100 and 0 to 10.
    counts = [every.counts[every.candidates == level][0] for level in (200, 101, 100, 41, 40, 11, 10)]
    assert counts == [2, 2, 1, 1, 2, 2, 1]
    assert (every.level, every.groups) == (in_a_row.level, in_a_row.groups) == (200, 2)


@pytest.mark.parametrize("name", ["plain tank", "glow in turbid water", "reflections"])
def test_the_last_step_before_ours_chooses_as_ours_where_its_first_look_is_sure(name):
    picture = Picture(tank_scenes(3)[name])
    vote = literal_hats(picture.histogram, STEPS["+ clear of noise"])
    assert vote.level == hats(picture.histogram, 2).level
    assert vote.groups == picture.groups[vote.level]


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
