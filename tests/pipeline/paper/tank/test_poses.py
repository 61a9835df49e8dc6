import numpy as np
import pytest
from dockpose.paper.tables import TABLES
from dockpose.paper.tank.poses import numbers_of, reproduce_row, table_dock
from dockpose.pose.circle import CirclePose


def test_numbers_as_the_tables_have_them():
    normal = np.array([-np.sin(np.radians(20)), 0.0, -np.cos(np.radians(20))])
    pose = CirclePose(np.array([0.08, -0.155, 1.45]), normal, np.zeros(2))
    assert numbers_of(pose) == pytest.approx([8, -15.5, 145, 0, 20])
    assert np.isnan(numbers_of(None)).all()


def test_docks_of_the_tables():
    assert [table_dock(name).lights for name in TABLES] == [10, 10, 12]
    assert table_dock("4").colours.count("red") == table_dock("4").colours.count("blue") == 2
    assert not table_dock("2").colours


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [("2", 3), ("4", 0)])
def test_a_row_comes_back_from_its_pictures(name, number):
    row = reproduce_row(name, number, seed=4, draws=2)
    measured = TABLES[name].measured[number]
    # Centres known to 0.03 px of ten lights around 67 px or more: some hundredths of a per cent of the range.
    np.testing.assert_allclose(row.ours, [measured] * 2, atol=0.1)
    assert row.right.all()
    again = reproduce_row(name, number, seed=4, draws=2)
    np.testing.assert_array_equal(row.ours, again.ours)
    assert (reproduce_row(name, number, seed=5, draws=2).ours != row.ours).all()
