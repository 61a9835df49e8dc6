"""Boards rendered here, through cameras that are known."""

import functools
from dataclasses import replace

import cv2
import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.board import Board
from dockpose.camera.calibrate import BoardView, Gathering, calibrate_gathered, calibrate_pictures
from dockpose.camera.fitting import LENSES, CalibrationError, fit, sigmas_of
from dockpose.camera.sigma import errors_of
from dockpose.pose.circle import rotation_from_angles

from tests.support.boards import sightings

TRUE = Camera(520, 515, 322, 236, 640, 480, (-0.18, 0.05, 0.001, -0.001, 0.0))
FISHEYE = Camera(300, 300, 322, 236, 640, 480, (-0.02, 0.01, -0.004, 0.001), fisheye=True)
SQUARE_M, COLUMNS, ROWS = 0.024, 10, 7
CHESSBOARD = Board(COLUMNS, ROWS, SQUARE_M)
CHARUCO = Board(COLUMNS, ROWS, SQUARE_M, "DICT_4X4_50", 0.018)
_PX = 40  # of a square in the drawing of the board
_COARSE = 4


@functools.cache
def drawing(board):
    """The board itself, with a white rim of one square."""
    if board.dictionary:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
        pattern = cv2.aruco.CharucoBoard((COLUMNS, ROWS), SQUARE_M, board.marker_m, dictionary)
        flat = pattern.generateImage((COLUMNS * _PX, ROWS * _PX), marginSize=0)
    else:
        row, column = np.indices((ROWS, COLUMNS))
        flat = np.kron(255 * ((row + column) % 2), np.ones((_PX, _PX))).astype(np.uint8)
    return cv2.copyMakeBorder(flat, _PX, _PX, _PX, _PX, cv2.BORDER_CONSTANT, value=255)


@functools.cache
def rays_of(camera):
    """Unit rays (121, 161, 3) of every fourth pixel, and where they start."""
    x, y = np.meshgrid(np.arange(0.0, 641, _COARSE), np.arange(0.0, 481, _COARSE))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    return camera.rays(pixels).reshape(*x.shape, 3), camera.ray_starts(pixels).reshape(*x.shape, 3)


def placed(rng, camera, farther=1.0):
    """Where a board is: its rotation, its first corner, and how far its middle is ahead."""
    rotation = rotation_from_angles(*rng.uniform(-0.5, 0.5, 2))
    z = farther * rng.uniform(0.28, 0.36) * camera.fx / 520
    middle = np.array([*rng.uniform(-0.03, 0.03, 2), z])
    return rotation, middle - rotation @ [COLUMNS * SQUARE_M / 2, ROWS * SQUARE_M / 2, 0], z


def picture(board, camera, seed, farther=1.0):
    """Look along every pixel's ray at the board, whose drawing is as sharp as a pixel.

    Where the rays meet the board is computed for every fourth one, and is a hundredth of a pixel off between them.
    """
    rng = np.random.default_rng(seed)
    rotation, place, z = placed(rng, camera, farther)
    rays, starts = rays_of(camera)
    ahead = ((place - starts) @ rotation[:, 2]) / (rays @ rotation[:, 2])
    on_board = (starts + rays * ahead[..., None] - place) @ rotation
    coarse = (on_board[..., :2] / SQUARE_M * _PX + _PX - 0.5).astype(np.float32)
    x, y = np.meshgrid(np.arange(640, dtype=np.float32) / _COARSE, np.arange(480, dtype=np.float32) / _COARSE)
    warp = cv2.remap(coarse, x, y, cv2.INTER_LINEAR)
    sharp = cv2.GaussianBlur(drawing(board), (0, 0), 0.5 * _PX * z / SQUARE_M / camera.fx)
    seen = cv2.remap(sharp, warp[..., 0], warp[..., 1], cv2.INTER_LINEAR, borderValue=90).astype(float)
    return np.clip(0.7 * seen + 20 + rng.normal(0, 2, seen.shape), 0, 255).astype(np.uint8)


def pictures(board, camera, count=10, farther=1.0):
    return [(f"board{seed}.png", picture(board, camera, seed, farther)) for seed in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("board", [CHESSBOARD, CHARUCO], ids=["chessboard", "charuco"])
def test_a_known_camera_comes_back(board):
    done = calibrate_pictures(pictures(board, TRUE), board, "auto" if board is CHESSBOARD else "tangential")
    assert done.error_px < 0.25
    assert done.camera.fx == pytest.approx(TRUE.fx, rel=0.01)
    assert done.camera.fy == pytest.approx(TRUE.fy, rel=0.01)
    assert (done.camera.cx, done.camera.cy) == pytest.approx((TRUE.cx, TRUE.cy), abs=6)
    # What counts: rays all over the picture, but for its corners, which few boards reach.
    x, y = np.meshgrid(np.linspace(60, 580, 9), np.linspace(60, 420, 7))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    off = np.degrees(np.linalg.norm(done.camera.rays(pixels) - TRUE.rays(pixels), axis=1))
    assert np.median(off) < 0.4
    assert all(view.error_px is not None and not view.dropped for view in done.views)
    names, errors = errors_of(done.camera)  # which go into its file
    assert names[:4] == ["fx", "fy", "cx", "cy"]
    known = dict(zip(names, np.sqrt(np.diag(errors)).tolist(), strict=True))
    assert [known[name] for name in names[:4]] == pytest.approx([done.sigmas.values[name] for name in names[:4]])
    assert known["distortion[0]"] == pytest.approx(done.sigmas.values["k1"])


@pytest.mark.slow
def test_a_fisheye_comes_back():
    done = calibrate_pictures(pictures(CHESSBOARD, FISHEYE), CHESSBOARD, "fisheye")
    assert done.camera.fisheye
    assert done.error_px < 0.25
    assert done.camera.fx == pytest.approx(FISHEYE.fx, rel=0.01)


def test_pictures_are_dropped_with_their_reason():
    good = pictures(CHESSBOARD, TRUE, 7)
    blank = np.full((480, 640), 128, np.uint8)
    bent = picture(CHESSBOARD, Camera(760, 515, 322, 236, 640, 480), 3)
    found = [*good, ("blank.png", blank), ("small.png", blank[::2, ::2]), ("broken.png", None), ("bent.png", bent)]
    done = calibrate_pictures(found, CHESSBOARD, "k2")
    dropped = {view.name: view.dropped for view in done.views if view.dropped}
    assert dropped["blank.png"] == "no board was found in it"
    assert dropped["small.png"] == "it is 320 x 240 pixels, the others are 640 x 480"
    assert dropped["broken.png"] == "it cannot be read as a picture"
    assert "stands out" in dropped["bent.png"]
    assert len(dropped) == 4
    assert done.camera.fx == pytest.approx(TRUE.fx, rel=0.015)


@pytest.mark.slow
def test_a_board_described_by_its_corners_is_understood():
    by_corners = Board(COLUMNS - 1, ROWS - 1, SQUARE_M)
    done = calibrate_pictures(pictures(CHESSBOARD, TRUE, 3), by_corners, "k2")
    assert done.counted_as == "corners"
    assert done.views[0].corners == (COLUMNS - 1) * (ROWS - 1)


def test_boards_that_lie_alike_are_refused():
    gathering = Gathering(CHESSBOARD, sightings=sightings(TRUE, 0, tilt_rad=0.0, ranges_m=(0.4, 0.41)), size=(640, 480))
    gathering.views |= {each.name: BoardView(each.name, None, 54) for each in gathering.sightings}
    with pytest.raises(
        CalibrationError, match=r"(cannot tell the|no) focal length.*: tilt the board by 20 to 40 degrees"
    ):
        calibrate_gathered(gathering, "k2")


@pytest.mark.parametrize(("poses", "alike"), [(1, "alike in 18"), (2, "in 2 ways only in 18")])
@pytest.mark.parametrize("noise_px", [0.0, 0.1])
def test_pictures_of_one_or_two_poses_are_refused(poses, alike, noise_px):
    rng, gathering = np.random.default_rng(3), Gathering(CHESSBOARD, size=(640, 480))
    for number in range(18):
        seen = sightings(TRUE, 0, count=poses)[number % poses]
        off = rng.normal(0, noise_px, seen.picture_px.shape).astype(np.float32)
        gathering.sightings.append(replace(seen, name=f"{number}", picture_px=seen.picture_px + off))
        gathering.views[f"{number}"] = BoardView(f"{number}", None, 54)
    for lens in ("auto", "k3"):
        with pytest.raises(CalibrationError, match=f"the board lies {alike} pictures; 3 poses .* tilt the board by"):
            calibrate_gathered(gathering, lens)


def test_boards_that_fit_less_well_count_less():
    """Of a third of the boards the corners are found nearly three times less well."""
    exact, rough = sightings(TRUE, 1, count=9, noise_px=0.05), sightings(TRUE, 2, count=4, noise_px=0.14)
    seen = [*exact, *(replace(each, name=f"rough{number}") for number, each in enumerate(rough))]
    gathering = Gathering(CHESSBOARD, sightings=seen, size=(640, 480))
    gathering.views |= {each.name: BoardView(each.name, None, 54) for each in seen}
    done = calibrate_gathered(gathering, "k2")
    assert [each.sigma for each in done.used[9:]] == pytest.approx([2.8] * 4, rel=0.25)
    assert max(each.sigma for each in done.used[:9]) < 1.4
    equal = fit(seen, (640, 480), LENSES["k2"])
    assert done.sigmas.values["fx"] < sigmas_of(equal, seen).values["fx"]
    assert abs(done.camera.fx - 520) < 3 * done.sigmas.values["fx"]


def test_too_few_boards_are_named():
    blank = np.full((480, 640), 128, np.uint8)
    with pytest.raises(CalibrationError, match="of 10 x 7 squares was found in 0 of 1 pictures; 3 are needed"):
        calibrate_pictures([("blank.png", blank)], CHESSBOARD)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((2, 7, 0.024), "columns is 2"),
        ((10, 7, 0.0), "square_m is 0.0"),
        ((10, 7, 0.024, "DICT_NONE"), "dictionary is 'DICT_NONE'"),
        ((10, 7, 0.024, "DICT_4X4_50", 0.03), "marker_m is 0.03"),
    ],
)
def test_impossible_boards_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        Board(*values)
