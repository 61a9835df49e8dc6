import numpy as np
import pytest
from dockpose.paper import rivals
from dockpose.paper.rivals import ANY_LEVEL, COLUMNS, LITERAL, OURS, PER_LIGHT, RIVALS, literal_hats, local_peaks
from dockpose.thresholds import histogram_of


def test_local_peaks_of_a_histogram_by_hand():
    counts = np.zeros(256, int)
    counts[[0, 1, 2, 3, 7, 8, 9, 255]] = [5, 2, 4, 4, 1, 3, 3, 1]
    # 0 and 255 are ends; of 2 and 3, and of 8 and 9, the darker is the peak.
    assert local_peaks(counts).tolist() == [255, 8, 2, 0]


@pytest.mark.parametrize(
    ("noise", "elected"),
    [
        # Peaks at 200, 100 and 10 with 3, 4 and 1 groups; of counts with one vote each the largest is elected.
        ({}, 100),
        # Single pixels make peaks at 60 and 50 with 5 and 6 groups.
        ({5: 60, 15: 50}, 50),
        # A rim of 90 on a light gives four groups a second vote, more than five and six have; 100 is brighter.
        ({5: 60, 15: 50, "rim": 90}, 100),
    ],
)
def test_votes_by_hand(noise, elected):
    noise = dict(noise)
    # Three lights of level 200 and one of 100, four pixels each, on a background of 10; and single pixels.
    picture = np.full((20, 20), 10, np.uint8)
    for row, column, level in ((2, 2, 200), (2, 10, 200), (10, 2, 200), (10, 10, 100)):
        picture[row : row + 2, column : column + 2] = level
    picture[2, 4] = noise.pop("rim", 10)
    for column, level in noise.items():
        picture[17, column] = level
    assert literal_hats(histogram_of(picture)) == elected


@pytest.mark.slow
def test_what_every_method_finds_is_counted_scene_by_scene(monkeypatch):
    monkeypatch.setattr(rivals, "SCENES_A_HALF", 2)
    methods, schemes = rivals.compare_methods(4), rivals.compare_schemes(4)
    for tally, names in ((methods, ["hats", *RIVALS]), (schemes, [LITERAL, OURS])):
        more = {"exact": [ANY_LEVEL], "plain_chain": [], "right": [PER_LIGHT]}
        assert {column: list(of) for column, of in tally.items()} == {one: [*names, *more[one]] for one in COLUMNS}
        assert {len(came) for of in tally.values() for came in of.values()} == {4}
    for column in ("exact", "right"):  # the same scenes and the same method in both
        np.testing.assert_array_equal(methods[column]["hats"], schemes[column][OURS])
    # No method shows the lights where no level does.
    assert not any((came & ~methods["exact"][ANY_LEVEL]).any() for came in methods["exact"].values())
