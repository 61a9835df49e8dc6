import numpy as np
import pytest
from dockpose.paper.lights import rivals
from dockpose.paper.lights.literal import STEPS, Scheme, Vote


@pytest.mark.slow
def test_what_every_method_finds_is_counted_scene_by_scene():
    methods, schemes = rivals.compare_methods(4, 2), rivals.compare_schemes(4, 2)
    for tally, names in ((methods, [*rivals.METHODS_COMPARED]), (schemes, [*STEPS, rivals.OURS])):
        assert tally.is_hard.tolist() == [False, False, True, True]
        assert list(tally.plain_chain) == names
        assert list(tally.right) == [*names, rivals.PER_LIGHT]
        assert {len(column) for part in (tally.exact, tally.plain_chain, tally.right) for column in part.values()} == {
            4
        }
    # The same scenes and the same method in both.
    np.testing.assert_array_equal(methods.exact["hats"], schemes.exact[rivals.OURS])
    np.testing.assert_array_equal(methods.right["hats"], schemes.right[rivals.OURS])
    # No method shows the lights where no level does.
    for name in rivals.METHODS_COMPARED:
        assert not (methods.exact[name] & ~methods.exact[rivals.ANY_LEVEL]).any()


def test_where_nothing_is_elected_the_highest_level_is_searched():
    nothing = np.empty(0, int)
    settings = rivals.settings_of(Scheme(), Vote(256, 0, nothing, nothing, nothing.astype(float)))
    assert (settings.method, settings.level, settings.min_area_px) == ("fixed", 255, 1)
