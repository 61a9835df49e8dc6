import numpy as np
from dockpose.app.export.reproduction.duality import part_of
from dockpose.paper.closed_loop import RULES, Course


def course(right, off_axis_deg=0.5):
    flags = np.array(right, dtype=bool)
    return Course(2.0, 20.0, flags, np.linspace(20.0, off_axis_deg, len(flags)))


def courses():
    """Ten approaches each: all right but three of the letter, that are wrong at the end, one of them astray."""
    good, lost, astray = course([0, 1, 1]), course([1, 1, 0]), course([1, 1, 0], off_axis_deg=30)
    return {rule: [good] * 10 if rule != "literal" else [good] * 7 + [lost] * 2 + [astray] for rule in RULES}


def test_what_is_counted():
    part = part_of(courses())
    rows = {row[0]: row[1:] for row in part.tables[0].rows}
    assert rows["Table 1 by the letter"][::2] == [10, 7, 9]
    assert rows["tracker"][::2] == [10, 10, 10]
    # By Wilson 7 of 10 is 39.7 to 89.2 %, 10 of 10 is 72.2 to 100 %.
    assert rows["Table 1 by the letter"][3] == "39.7 to 89.2"
    assert rows["tracker"][1] == "72.2 to 100.0"
    assert "3 approaches by the letter and 0 as we read it" in part.differs
    assert "1 approaches by the letter and 0 as we read it" in part.differs


def test_the_same_approaches_give_the_same_bytes():
    assert part_of(courses()) == part_of(courses())
