import numpy as np
import pytest
from dockpose.app.web.panels.calibration import board_of, coverage_html, picture_with_board, pictures_html, seen_html
from dockpose.camera.board import find_board
from dockpose.camera.calibrate import BoardView
from dockpose.camera.coverage import coverage_of

from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, picture
from tests.support.boards import SIZE, sightings


def test_the_board_that_is_typed_is_read():
    board = board_of(" 10 x 7", 24.0)
    assert (board.columns, board.rows, board.square_m) == (10, 7, 0.024)


@pytest.mark.parametrize(("squares", "side_mm"), [("10 by 7", 24.0), ("", 24.0), ("2x7", 24.0), ("10x7", 0.0)])
def test_what_is_no_board_is_refused(squares, side_mm):
    with pytest.raises(ValueError, match=r"board is|columns is|square_m is"):
        board_of(squares, side_mm)


def test_the_board_is_drawn_where_it_was_found():
    grey = picture(CHESSBOARD, TRUE, 0)
    found = find_board(grey, CHESSBOARD)
    assert found is not None
    plain, drawn = (picture_with_board(grey, each, CHESSBOARD, "squares").astype(int) for each in (None, found))
    assert drawn.shape == (255, 340, 3)
    changed = np.argwhere(np.abs(drawn - plain).sum(axis=2) > 0)[:, ::-1] * 640 / 340
    low, high = found.picture_px.min(axis=0), found.picture_px.max(axis=0)
    assert (np.abs(changed.min(axis=0) - low) < 8).all()
    assert (np.abs(changed.max(axis=0) - high) < 8).all()


def test_what_was_seen_or_dropped_is_told_and_names_are_escaped():
    found = sightings(TRUE, 0, count=3)[0]
    assert "board seen and taken</b>, 54 corners" in seen_html("a.png", found, "")
    assert "board seen, not taken: it is blurred" in seen_html("a.png", found, "it is blurred")
    assert "no board was found in it" in seen_html("a.png", None, "no board was found in it")
    assert "<script>" not in seen_html("<script>", None, "x") + pictures_html([BoardView("<script>", None, 5)])
    views = BoardView("a", 0.1234, 54), BoardView("b", None, 54, "you dropped it"), BoardView("c", None, 54)
    for words in ("0.123 px over 54 corners", "dropped: you dropped it", ">54 corners<"):
        assert words in pictures_html(views)


def test_coverage_counts_views_and_says_what_is_wanted():
    few = coverage_html(coverage_of(sightings(TRUE, 0, count=3), SIZE))
    assert "3 views" in few
    assert "Still wanted" in few
    assert "That is enough." in coverage_html(coverage_of(sightings(TRUE, 0, count=60), SIZE, TRUE.fx))
    assert "0 views" in coverage_html(coverage_of([], SIZE))
