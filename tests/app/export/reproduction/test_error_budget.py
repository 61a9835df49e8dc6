import numpy as np
import pytest
from dockpose.app.export.reproduction.error_budget import part_of
from dockpose.paper.tank.error_budget import CAMERA, ITEMS, Budget


def budget(together):
    """A budget whose errors are all as large as given."""
    items = {name: np.full((2, 12, 5), 0.1) for name in ITEMS}
    pictures = {name: np.full((2, 12, 5), 0.01) for name in ("quiet", "noise", "jpeg", "both")}
    return Budget(items, pictures, np.full((2, 12, 5), together), 1.0, 0.02, 0.1, [CAMERA, CAMERA])


def test_rows_as_they_were_put_in():
    part = part_of(budget(-0.3))
    rows = {row[0]: row[1:] for row in part.tables[0].rows}
    assert rows["diameter off by 1 mm"] == pytest.approx([0.1] * 5)
    assert rows["all together, without ignored distortion"] == pytest.approx([0.3] * 5)
    # Half a centimetre and a degree, by their rounding: over the square root of 12.
    assert rows["rounding of the measured values"] == pytest.approx([0.1443] * 3 + [0.2887] * 2)
    assert rows["all together, and rounding"][0] == pytest.approx(np.hypot(0.3, 0.1443), abs=1e-3)
    assert rows["the paper"][2] == pytest.approx(1.39, abs=0.01)
    by_table = {row[0]: row[1:] for row in part.tables[1].rows}
    assert by_table["Table 4: ours, believable camera and ring"] == pytest.approx([0.3] * 5)


def test_columns_in_which_it_exceeds_the_paper_are_named():
    text = part_of(budget(0.25)).differs
    assert "theta x of Table 2 (0.25 against 0.2)" in text
    assert "theta x of Table 4" not in text
    assert "In no column" in part_of(budget(0.05)).differs


def test_the_same_budget_gives_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        part_of(budget(0.3)).write(tmp_path / name)
    for file in sorted((tmp_path / "one").iterdir()):
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes(), file.name
