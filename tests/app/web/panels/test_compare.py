from dataclasses import replace

import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, error_words
from dockpose.app.state.parameters import put
from dockpose.app.state.view import open_source
from dockpose.app.web.panels.compare import COLUMNS, compare_html, method_cells


@pytest.fixture(scope="module")
def view():
    return open_source(None, None, None)


def test_table_has_a_row_a_method_and_the_error_where_the_truth_is_known(view):
    found = compare_view(view, Progress(lambda share: None))
    assert all(len(method_cells(one, view)) == len(COLUMNS) for one in found.values())
    assert "cm" in method_cells(found["hats"], view)[-1]
    assert "Kapur" in compare_html(found, view)
    assert error_words(found["hats"], replace(view, truth=None)) == ""
    nothing = analyse(put(view, "min_area_px", 999)).estimate
    assert method_cells(nothing, view)[3] in ("no lights", "not a ring", "too few markers")
