import cv2
import numpy as np
import pytest
from dockpose import Camera
from dockpose.app.cli import main
from dockpose.camera.files import load_camera, save_camera
from dockpose.camera.port import FlatPort
from dockpose.sidecar import load_dock
from dockpose.simulate import Pose, Scene, render
from msgspec.structs import replace

from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures
from tests.support.docks import CAMERA, uneven


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boards")
    for name, picture in pictures(CHESSBOARD, TRUE, 6):
        cv2.imwrite(str(folder / name), picture)
    cv2.imwrite(str(folder / "wall.png"), np.full((480, 640), 128, np.uint8))
    return folder


def test_the_squares_of_a_chessboard_are_counted(folder, tmp_path, capsys):
    out = tmp_path / "camera.yaml"
    assert (
        main(["calibrate", str(folder), "--square", "0.024", "--lens", "k2", "--out", str(out), "--format", "kalibr"])
        == 0
    )
    assert "the board has 10 x 7 squares, as most pictures show" in capsys.readouterr().err
    assert load_camera(out).fx == pytest.approx(TRUE.fx, rel=0.02)
    (tmp_path / "none").mkdir()
    cv2.imwrite(str(tmp_path / "none" / "wall.png"), np.full((480, 640), 128, np.uint8))
    for words, told in (([str(tmp_path / "none")], "no chessboard is found whole"), (["0"], "--board is needed")):
        assert main(["calibrate", *words, "--square", "0.024", "--out", str(tmp_path / "b.yaml")]) == 2
        assert told in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--board", "10by7", "--square", "0.024"], "--board 10by7: must be columns x rows"),
        (["--board", "10x7", "--square", "0.024", "--charuco", "DICT_9"], "dictionary is 'DICT_9'"),
        (["--board", "5x4", "--square", "0.024"], "a board of 5 x 4 squares was found in 0 of 2 pictures"),
        (
            ["--board", "10x7", "--square", "0.024", "--out", "/nowhere/c.yaml"],
            "c.yaml: cannot be written, there is no",
        ),
        (["--board", "10x7", "--square", "0.024", "--out", "."], "--out .: is a folder"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(folder, words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", str(folder / "board0.png"), str(folder / "wall.png"), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_broken_picture_is_told_and_the_rest_is_done(folder, tmp_path, capsys):
    (tmp_path / "broken.png").write_bytes(b"no picture")
    words = ["calibrate", str(folder), str(tmp_path / "broken.png"), "--board", "10x7", "--square", "0.024"]
    assert main([*words, "--lens", "k2", "--out", str(tmp_path / "c.yaml")]) == 1
    assert "broken.png  dropped: it cannot be read as a picture" in capsys.readouterr().out


def test_a_video_becomes_a_camera_file(tmp_path, capsys):
    video = cv2.VideoWriter(str(tmp_path / "run.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 5.0, (640, 480), False)
    for _, picture in pictures(CHESSBOARD, TRUE, 6):
        for _ in range(2):
            video.write(picture)
    video.release()
    words = ["calibrate", str(tmp_path / "run.avi"), "--board", "10x7", "--square", "0.024", "--in", "water"]
    assert main([*words, "--lens", "k2", "--out", str(tmp_path / "c.yaml")]) == 0
    assert load_camera(tmp_path / "c.yaml").fx == pytest.approx(TRUE.fx, rel=0.02)
    text = capsys.readouterr().out
    assert "12 frames looked at: 6 used, 6 were like others." in text
    assert "Calibrated in water" in text


def test_a_video_is_calibrated_alone(tmp_path, refusal):
    (tmp_path / "run.mp4").write_bytes(b"")
    words = ["calibrate", str(tmp_path / "run.mp4"), str(tmp_path), "--board", "10x7", "--square", "0.024"]
    assert "a video or live camera is calibrated alone" in refusal(*words)


@pytest.mark.slow
def test_the_port_is_found_from_pictures_under_water(tmp_path, capfd, refusal):
    air = Camera(520, 515, 322, 236, 640, 480)
    save_camera(air, tmp_path / "air.yaml")
    for name, picture in pictures(CHESSBOARD, replace(air, port=FlatPort(0.03, 0.01)), 4, farther=1.4):
        cv2.imwrite(str(tmp_path / name), picture)
    words = ["calibrate", str(tmp_path), "--board", "10x7", "--square", "0.024", "--camera", str(tmp_path / "air.yaml")]
    assert main([*words, "--in", "water", "--out", str(tmp_path / "water.yaml")]) == 0
    port = load_camera(tmp_path / "water.yaml").port
    assert port.air_gap_m == pytest.approx(0.03, abs=0.005)
    text = capfd.readouterr().out
    assert "mm (one sigma, from the camera's centre of projection to the window); 4 boards" in text
    assert "Glass taken to be 10.0 mm: the pictures cannot tell it from the gap" in text
    assert "say --in water" in refusal(*words)
    assert "would overwrite the input" in refusal(*words, "--in", "water", "--out", str(tmp_path / "air.yaml"))
    assert load_camera(tmp_path / "air.yaml").port is None


@pytest.fixture(scope="module")
def docks(tmp_path_factory):
    """Twelve pictures of a dock whose lights are a millimetre off."""
    docks, rng = tmp_path_factory.mktemp("dock"), np.random.default_rng(0)
    save_camera(CAMERA, docks / "camera.yaml")
    for number in range(12):
        z = rng.uniform(0.8, 1.6)
        x, y = rng.uniform(-0.12, 0.12, 2) * z
        theta_x, theta_y, roll = rng.uniform(-30, 30, 3)
        pose = Pose(position_m=(x, y, z), theta_x_deg=theta_x, theta_y_deg=theta_y, roll_deg=roll)
        image, _ = render(Scene(camera=CAMERA, dock=uneven(0), pose=pose, seed=number))
        cv2.imwrite(str(docks / f"{number:02}.png"), image)
    return docks


def words(docks, *more):
    return [str(docks), "--camera", str(docks / "camera.yaml"), *more]


def test_a_folder_becomes_a_dock_file_that_the_estimate_uses(docks, tmp_path, capsys):
    out = str(tmp_path / "dock.yaml")
    assert main(["learn-dock", *words(docks, "--dock-diameter", "0.30", "--lights", "10", "--out", out)]) == 0
    text = capsys.readouterr().out
    assert "Learned from 12 of 12 views" in text
    assert "the dock's roll is known over the whole turn" in text
    assert np.abs(load_dock(out).offsets_m).max() > 0.5e-3
    assert main(["estimate", *words(docks, "--dock", out)]) == 0
    assert "10 lights on the ring" in capsys.readouterr().out


def test_what_cannot_be_learned_is_said(docks, tmp_path, refusal):
    picture = str(docks / "00.png")
    camera = ["--camera", str(docks / "camera.yaml"), "--dock-diameter", "0.30", "--lights", "10"]
    assert "can't tell where the lights are: 1 of 1 views" in refusal(
        "learn-dock", picture, *camera, "--out", str(tmp_path / "d.yaml")
    )
    assert not (tmp_path / "d.yaml").exists()


def test_a_dock_file_does_not_go_with_a_diameter(docks, tmp_path, refusal):
    assert "--dock d.yaml says it all" in refusal(
        "estimate", *words(docks, "--dock", "d.yaml", "--dock-diameter", "0.30")
    )
