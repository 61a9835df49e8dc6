import cv2
import dockpose
import numpy as np
import pytest
from dockpose.camera.calibrate import Gathering
from dockpose.sources import Frame, Frames
from dockpose.sources.boards import gather

from tests.pipeline.camera.test_calibrate import CHESSBOARD, SQUARE_M, TRUE, picture, pictures


class Shown(Frames):
    """Frames from memory."""

    def __init__(self, images, *, is_live=False):
        super().__init__("shown")
        self.images, self.is_live = images, is_live

    def __iter__(self):
        for index, image in enumerate(self.images):
            yield Frame(image, index, None, "shown")


def test_only_frames_that_differ_are_kept():
    boards = [picture(CHESSBOARD, TRUE, seed) for seed in range(4)]
    smeared = cv2.blur(picture(CHESSBOARD, TRUE, 5), (15, 1))
    blank = np.full((480, 640), 90, np.uint8)
    gathering = Gathering(CHESSBOARD, distinct=True)
    looked = gather(Shown([boards[0], boards[0], *boards[1:], smeared, blank]), gathering)
    assert [each.name for each in gathering.sightings] == ["frame 0", "frame 2", "frame 3", "frame 4", "frame 5"]
    assert looked.left_out == {"were like others": 1, "show no board": 1}
    assert looked.in_words(5) == "7 frames looked at: 5 used, 1 were like others, 1 show no board"


def test_a_sharper_frame_takes_the_place_of_a_like_one():
    sharp = picture(CHESSBOARD, TRUE, 0)
    gathering = Gathering(CHESSBOARD, distinct=True)
    gather(Shown([cv2.GaussianBlur(sharp, (0, 0), 1.5), sharp]), gathering)
    assert [each.name for each in gathering.sightings] == ["frame 1"]
    assert list(gathering.views) == ["frame 1"]


def test_what_is_covered_is_told_when_a_board_was_added():
    told = []
    frames = Shown([picture(CHESSBOARD, TRUE, seed) for seed in (0, 0, 1)], is_live=True)
    gather(frames, Gathering(CHESSBOARD, distinct=True), lambda looked, covered: told.append(covered))
    assert [covered.pictures if covered else None for covered in told] == [1, None, 2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boards")
    for name, image in pictures(CHESSBOARD, TRUE, 6):
        cv2.imwrite(str(folder / name), image)
    return folder


def test_python_takes_what_the_command_takes(folder):
    by_name = dockpose.calibrate(folder, square_m=SQUARE_M, lens="k2")
    assert by_name.camera.fx == pytest.approx(TRUE.fx, rel=0.02)
    arrays = [(path.name, cv2.imread(str(path), 0)) for path in sorted(folder.glob("*.png"))]
    by_arrays = dockpose.calibrate(arrays, CHESSBOARD, "k2")
    # OpenCV sums in threads, in whatever order: the last digits of where it converges differ from run to run.
    rays = [[-0.4, -0.3, 1.0], [0.1, 0.2, 1.0], [0.4, 0.3, 1.0]]
    np.testing.assert_allclose(by_arrays.camera.project(rays), by_name.camera.project(rays), atol=1e-5)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        *(({}, "board and square_m"), ({"board": CHESSBOARD, "square_m": 0.1}, "board and square_m")),
        *(({"board": "10x7"}, "must be a Board"), ({"square_m": 0.1, "lens": "zoom"}, "lens is 'zoom'")),
    ],
)
def test_what_is_asked_for_wrongly_is_named(folder, words, message):
    with pytest.raises(ValueError, match=message):
        dockpose.calibrate(folder, **words)


def test_what_shows_no_board_is_refused():
    with pytest.raises(ValueError, match="no chessboard whole"):
        dockpose.calibrate([("a", np.full((480, 640), 90, np.uint8))], square_m=0.02)


def test_a_picture_that_is_damaged_is_told_as_such(tmp_path):
    whole = cv2.imencode(".png", picture(CHESSBOARD, TRUE, 0))[1].tobytes()
    (tmp_path / "board.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ValueError, match=r"board\.png: the picture is damaged or cut short"):
        dockpose.calibrate(tmp_path / "board.png", square_m=0.02)
