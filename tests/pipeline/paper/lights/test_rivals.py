import numpy as np
import pytest
from dockpose.paper.lights import rivals
from dockpose.paper.lights.levels import picture_of
from dockpose.paper.lights.rivals import STEPS, Scheme, literal_hats, local_peaks
from dockpose.paper.lights.scenes import tank_scenes
from dockpose.thresholds import histogram_of
from dockpose.thresholds.hats import hats


def small_picture(*, noise: bool):
    """Three lights of level 200 and one of 100, four pixels each, on a background of 10; and two single pixels."""
    picture = np.full((20, 20), 10, np.uint8)
    for row, column, level in ((2, 2, 200), (2, 10, 200), (10, 2, 200), (10, 10, 100)):
        picture[row : row + 2, column : column + 2] = level
    if noise:
        picture[17, 5], picture[17, 15] = 60, 50
    return histogram_of(picture)


def test_local_peaks_of_a_histogram_by_hand():
    counts = np.zeros(256, int)
    counts[[0, 1, 2, 3, 7, 8, 9, 255]] = [5, 2, 4, 4, 1, 3, 3, 1]
    # 0 and 255 are ends; of 2 and 3, and of 8 and 9, the darker is the peak.
    assert local_peaks(counts).tolist() == [255, 8, 2, 0]


def test_of_several_counts_with_one_vote_each_the_largest_is_elected():
    vote = literal_hats(small_picture(noise=False))
    assert vote.candidates.tolist() == [200, 100, 10]
    assert vote.counts.tolist() == [3, 4, 1]
    assert (vote.level, vote.groups) == (100, 4)


def test_single_pixels_mislead_the_literal_reading_and_not_the_one_with_a_minimum_area():
    vote = literal_hats(small_picture(noise=True))
    assert vote.candidates.tolist() == [200, 100, 60, 50, 10]
    assert vote.counts.tolist() == [3, 4, 5, 6, 1]
    assert (vote.level, vote.groups) == (50, 6)
    with_area = literal_hats(small_picture(noise=True), Scheme(min_area_px=2))
    assert with_area.counts.tolist() == [3, 4, 4, 4, 1]
    assert (with_area.level, with_area.groups) == (100, 4)


def test_an_unbroken_run_counts_for_more_than_the_same_count_here_and_there():
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
    picture = picture_of(tank_scenes(3)[name])
    vote = literal_hats(picture.histogram, STEPS["+ clear of noise"])
    assert vote.level == hats(picture.histogram, 2).level
    assert vote.groups == picture.groups[vote.level]


@pytest.mark.slow
def test_what_every_method_finds_is_counted_scene_by_scene():
    methods, schemes = rivals.compare_methods(4, 2), rivals.compare_schemes(4, 2)
    for tally, names in ((methods, [*rivals.METHODS_COMPARED]), (schemes, [*STEPS, rivals.OURS])):
        assert tally.is_hard.tolist() == [False, False, True, True]
        assert list(tally.plain_chain) == names
        assert list(tally.right) == [*names, rivals.PER_LIGHT]
        for column in (*tally.exact.values(), *tally.plain_chain.values(), *tally.right.values()):
            assert len(column) == 4
    # The same scenes and the same method in both.
    np.testing.assert_array_equal(methods.exact["hats"], schemes.exact[rivals.OURS])
    np.testing.assert_array_equal(methods.right["hats"], schemes.right[rivals.OURS])
    # No method shows the lights where no level does.
    for name in rivals.METHODS_COMPARED:
        assert not (methods.exact[name] & ~methods.exact[rivals.ANY_LEVEL]).any()
