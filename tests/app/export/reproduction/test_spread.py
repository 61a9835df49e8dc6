import pytest
from dockpose.app.export.reproduction.spread import figure_7


@pytest.mark.slow
def test_a_part_made_twice_from_one_seed_is_the_same_byte_for_byte():
    assert figure_7(5) == figure_7(5)
