import cv2
import numpy as np
import pytest
from dockpose.camera import board
from dockpose.camera.board import Board, count_squares, find_board

from tests.pipeline.camera.test_calibrate import CHARUCO, CHESSBOARD, COLUMNS, ROWS, SQUARE_M, TRUE, picture, placed


def true_corners_px(seed):
    """The inner corners of the picture with that seed, by the same random numbers."""
    rotation, place, _ = placed(np.random.default_rng(seed), TRUE)
    column, row = np.meshgrid(np.arange(1, COLUMNS), np.arange(1, ROWS))
    flat = SQUARE_M * np.column_stack([column.ravel(), row.ravel(), 0 * row.ravel()])
    return TRUE.project(flat @ rotation.T + place)


def murky(seed):
    """A board in haze: a lamp's uneven light, contrast of a few grey levels, blur, noise, and specks before it."""
    rng = np.random.default_rng(1000 + seed)
    seen = cv2.GaussianBlur(picture(CHESSBOARD, TRUE, seed).astype(float), (0, 0), rng.uniform(0.5, 2.5))
    y, x = np.mgrid[:480, :640]
    off2 = (x - rng.uniform(100, 540)) ** 2 + (y - rng.uniform(80, 400)) ** 2
    lamp = np.exp(-off2 / (2 * rng.uniform(120, 300) ** 2))
    hazy = (seen - 100) * rng.uniform(0.06, 0.4) * (0.25 + lamp) + rng.uniform(40, 90) + 70 * lamp
    hazy += rng.normal(0, rng.uniform(1, 4), hazy.shape)
    for _ in range(rng.integers(0, 120)):
        place, size = (int(rng.integers(0, 640)), int(rng.integers(0, 480))), int(rng.uniform(0.7, 3))
        cv2.circle(hazy, place, size, float(rng.uniform(120, 220)), -1)
    return np.clip(hazy, 0, 255).astype(np.uint8)


def clutter(seed):
    rng, seen = np.random.default_rng(seed), np.full((480, 640), 90, np.uint8)
    for _ in range(300):
        (x, y), size, grey = rng.integers(0, [640, 480]).tolist(), int(rng.integers(5, 80)), int(rng.integers(0, 256))
        if rng.random() < 0.5:
            cv2.rectangle(seen, (x, y), (x + size, y + size), grey, -1)
        else:
            cv2.circle(seen, (x, y), size // 2, grey, -1)
    return seen


def test_corners_are_where_they_are():
    off = []
    for seed in range(6):
        found = find_board(picture(CHESSBOARD, TRUE, seed), CHESSBOARD)
        true = true_corners_px(seed)
        # A chessboard of 10 x 7 squares looks the same from either end, but for its colours.
        off.append(min((found.picture_px - true, found.picture_px[::-1] - true), key=lambda each: (each**2).sum()))
    assert np.sqrt(np.mean(np.square(off))) < 0.1
    assert np.abs(np.mean(off, axis=(0, 1))).max() < 0.03


def test_a_large_picture_is_searched_small_and_measured_large():
    large = cv2.resize(picture(CHESSBOARD, TRUE, 0), None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC)
    found = find_board(large, CHESSBOARD, thorough=False)
    true = 3 * (true_corners_px(0) + 0.5) - 0.5
    off = min((found.picture_px - true, found.picture_px[::-1] - true), key=lambda each: (each**2).sum())
    assert np.sqrt(np.mean(np.square(off))) < 0.3


def drawn(columns, rows, seed):
    """A board of so many squares, seen askew."""
    rng, flat = np.random.default_rng(seed), np.full((20 * rows + 40, 20 * columns + 40), 255, np.uint8)
    flat[20:-20, 20:-20] = np.kron(20 + 235 * (np.indices((rows, columns)).sum(axis=0) % 2), np.ones((20, 20)))
    height, width = flat.shape
    ends = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    moved = (ends - [width / 2, height / 2]) * 400 / max(flat.shape) + [320, 240] + rng.uniform(-40, 40, (4, 2))
    warp = cv2.getPerspectiveTransform(ends, moved.astype(np.float32))
    return cv2.GaussianBlur(cv2.warpPerspective(flat, warp, (640, 480), borderValue=90), (0, 0), 0.8)


@pytest.mark.parametrize(("columns", "rows"), [(10, 7), (12, 12), (9, 6), (5, 4), (14, 9)])
def test_squares_are_counted_by_what_most_pictures_show(columns, rows):
    greys = [drawn(columns, rows, seed) for seed in range(4)]
    other = [np.full((480, 640), 90, np.uint8), drawn(8, 8, 0)]
    assert count_squares([*other, *map(np.rot90, greys[:2]), *greys[2:]]) == (columns, rows)
    assert count_squares(other[:1]) is None


@pytest.mark.parametrize("seed", range(12))
def test_no_board_is_missed_in_haze(seed):
    assert find_board(murky(seed), CHESSBOARD) is not None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_clutter_is_no_board(seed):
    assert find_board(clutter(seed), Board(6, 5, SQUARE_M)) is None


@pytest.mark.slow
@pytest.mark.parametrize("squares", [(8, 7), (11, 7), (5, 4)])
def test_a_board_of_another_size_is_not_taken_for_it(squares):
    columns, rows = squares
    assert find_board(picture(CHESSBOARD, TRUE, 0), Board(columns, rows, SQUARE_M)) is None


def test_blurred_boards_are_told():
    sharp = picture(CHESSBOARD, TRUE, 0)
    found = [find_board(each, CHESSBOARD) for each in (sharp, cv2.blur(sharp, (15, 1)))]
    assert [each and each.is_blurred for each in found] == [False, True]
    # Smeared over 15 px, edges rise from 10 to 90 % over 12.
    assert found[1].edge_px == pytest.approx(12, abs=1)


def with_rim(share, margin_px):
    """A slanted board of 10 x 7 squares, of which the outer ones are longer or shorter than the others by a share."""
    lengths = [[round(40 * share), *[40] * (count - 2), round(40 * share)] for count in (COLUMNS, ROWS)]
    column, row = (np.repeat(np.arange(len(each)), each) for each in lengths)
    flat = (255 * ((column + row[:, None]) % 2)).astype(np.uint8)
    flat = np.pad(flat, margin_px, constant_values=255)
    corners = np.array([[0, 0], [flat.shape[1], 0], flat.shape[::-1], [0, flat.shape[0]]], np.float32)
    seen = np.array([[80, 90], [570, 60], [540, 420], [110, 380]], np.float32)
    warp = cv2.getPerspectiveTransform(corners, seen)
    drawn = cv2.warpPerspective(cv2.GaussianBlur(flat, (0, 0), 1.2), warp, (640, 480), borderValue=90)
    return (0.6 * cv2.GaussianBlur(drawn, (0, 0), 0.7) + 30).astype(np.uint8)


@pytest.mark.parametrize(("share", "margin_px"), [(0.6, 40), (1.5, 0), (2.0, 40), (3.0, 0)])
def test_a_rim_of_longer_squares_is_part_of_the_board(share, margin_px):
    seen = with_rim(share, margin_px)
    assert find_board(seen, CHESSBOARD, thorough=False) is not None
    assert find_board(seen, Board(COLUMNS - 1, ROWS, SQUARE_M), thorough=False) is None


def test_where_the_first_look_finds_nothing_the_classic_one_does(monkeypatch):
    seen = murky(1)
    monkeypatch.setattr(board, "_QUICK", lambda *_: (False, None))
    monkeypatch.setattr(board, "_EXHAUSTIVE", lambda *_: (False, None))
    assert find_board(seen, CHESSBOARD) is not None
    monkeypatch.setattr(board, "_CLASSIC", lambda *_: (False, None))
    assert find_board(seen, CHESSBOARD) is None


def test_part_of_a_charuco_board_is_enough():
    half = picture(CHARUCO, TRUE, 0)
    half[:, :300] = 90
    found = find_board(half, CHARUCO)
    assert 8 <= len(found.picture_px) < 54
