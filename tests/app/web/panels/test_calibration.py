import numpy as np
import pytest
from dockpose.app.web.panels.calibration import board_of, card_html, coverage_html, picture_with_board, seen_html
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
    with pytest.raises(ValueError, match=r"board's size is|columns is|square_m is"):
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
    hostile = '<script>"'
    assert "<script>" not in seen_html(hostile, None, "x") + card_html(BoardView(hostile, None, 5), "", 0)
    assert 'data-board="&lt;script&gt;&quot;"' in card_html(BoardView(hostile, None, 5), "", 0)


def test_a_card_has_the_error_and_its_share_of_the_largest_and_is_dropped_by_a_click():
    used = card_html(BoardView("a", 0.1234, 54), "abc", 0.2468)
    for words in ("0.123 px over 54 corners", "width: 50%", 'aria-pressed="true"', "Drop it.", "base64,abc"):
        assert words in used
    mine = card_html(BoardView("b", None, 54, "you dropped it"), "", 0.2)
    for words in ("dropped: you dropped it", "width: 0%", 'aria-pressed="false"', "Take it back."):
        assert words in mine
    assert " disabled>" in card_html(BoardView("c", None, 0, "no board was found in it"), "", 0.2)
    assert ">54 corners<" in card_html(BoardView("d", None, 54), "", 0)


def test_coverage_counts_views_and_says_what_is_wanted():
    few = coverage_html(coverage_of(sightings(TRUE, 0, count=3), SIZE))
    assert "3 views" in few
    assert "Still wanted" in few
    assert "That is enough." in coverage_html(coverage_of(sightings(TRUE, 0, count=60), SIZE, TRUE.fx))
    assert "0 views" in coverage_html(coverage_of([], SIZE))
