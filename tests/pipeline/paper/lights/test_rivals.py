import numpy as np
import pytest
from dockpose.paper.lights.literal import STEPS, Scheme, Vote
from dockpose.paper.lights.rivals import (
    ANY_LEVEL,
    METHODS_COMPARED,
    OURS,
    PER_LIGHT,
    compare_methods,
    compare_schemes,
    settings_of,
)


@pytest.mark.slow
def test_what_every_method_finds_is_counted_scene_by_scene():
    methods, schemes = compare_methods(4, 2), compare_schemes(4, 2)
    for tally, names in ((methods, [*METHODS_COMPARED]), (schemes, [*STEPS, OURS])):
        assert tally.is_hard.tolist() == [False, False, True, True]
        assert list(tally.plain_chain) == names
        assert list(tally.right) == [*names, PER_LIGHT]
        assert {len(column) for part in (tally.exact, tally.plain_chain, tally.right) for column in part.values()} == {
            4
        }
    # The same scenes and the same method in both.
    np.testing.assert_array_equal(methods.exact["hats"], schemes.exact[OURS])
    np.testing.assert_array_equal(methods.right["hats"], schemes.right[OURS])
    # No method shows the lights where no level does.
    for name in METHODS_COMPARED:
        assert not (methods.exact[name] & ~methods.exact[ANY_LEVEL]).any()


def test_where_nothing_is_elected_the_highest_level_is_searched():
    nothing = np.empty(0, int)
    settings = settings_of(Scheme(), Vote(256, 0, nothing, nothing, nothing.astype(float)))
    assert (settings.method, settings.level, settings.min_area_px) == ("fixed", 255, 1)
