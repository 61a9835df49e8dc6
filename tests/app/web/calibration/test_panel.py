import pytest
from dockpose.app.web.calibration.panel import board_of


def test_the_board_that_is_typed_is_read():
    board = board_of(" 10 x 7", 24.0)
    assert (board.columns, board.rows, board.square_m) == (10, 7, 0.024)


@pytest.mark.parametrize(("squares", "side_mm"), [("10 by 7", 24.0), ("", 24.0), ("2x7", 24.0), ("10x7", 0.0)])
def test_what_is_no_board_is_refused(squares, side_mm):
    with pytest.raises(ValueError, match=r"board is|columns is|square_m is"):
        board_of(squares, side_mm)
