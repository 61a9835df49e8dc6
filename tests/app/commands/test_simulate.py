import csv

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera
from dockpose.app.cli import main
from dockpose.app.commands import simulate as simulate_command
from dockpose.files import to_yaml
from dockpose.simulate import FilmPlan, Hover, Lights, Pose, Scene, Sensor
from dockpose.simulate.files import load_sequence, save_sequence
from dockpose.truth import read_trajectory
from scipy.spatial.transform import Rotation

from tests.support.scenes import CAMERA, DOCK
from tests.support.trajectories import known

SMALL = Camera(175.0, 175.0, 79.5, 59.5, 160, 120)
SCENE = Scene(camera=SMALL, dock=DOCK, pose=Pose(position_m=(0.05, 0.02, 0.9), theta_y_deg=20.0), seed=5)
SEQUENCE = FilmPlan(scene=SCENE, motion=Hover(frames=3, rate_hz=4.0))


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder to work in, with a scene file of three small pictures."""
    monkeypatch.chdir(tmp_path)
    save_sequence(SEQUENCE, "s.yaml")
    return tmp_path


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_numbered_pictures_with_their_truth(desk, capsys):
    assert main(["simulate", "--scene", "s.yaml", "--out", "deep/o"]) == 0
    numbered = [f"frame_000{number}.{ending}" for number in (1, 2, 3) for ending in ("png", "yaml")]
    assert names(desk / "deep/o") == [*numbered, "scene.yaml", "truth.csv"]
    table = rows(desk / "deep/o/truth.csv")
    assert [(row["frame"], row["time_s"]) for row in table] == [("1", "0.0"), ("2", "0.25"), ("3", "0.5")]
    assert {row["visible_lights"] for row in table} == {"10"}
    assert load_sequence(desk / "deep/o/scene.yaml") == SEQUENCE
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "3 pictures in" in captured.err


def test_the_truth_as_a_trajectory_has_the_camera_in_the_docks_frame(desk):
    assert main(["simulate", "--scene", "s.yaml", "--out", "o", "--truth", "tum"]) == 0
    found, table = read_trajectory(desk / "o/truth.tum"), rows(desk / "o/truth.csv")
    assert found.times_s.tolist() == [0.0, 0.25, 0.5]
    assert found.notes == ()
    for place, turn, row in zip(found.positions_m, known(found.quaternions_xyzw), table, strict=True):
        # The dock, which is that frame's origin, as the camera sees it.
        docked = Rotation.from_quat(turn).inv()
        assert docked.apply(-place) == pytest.approx([float(row[f"{axis}_m"]) for axis in "xyz"], abs=1e-6)
        theta_x, theta_y, roll = (np.radians(float(row[f"{name}_deg"])) for name in ("theta_x", "theta_y", "roll"))
        turned = Rotation.from_euler("YXZ", [theta_y, theta_x, roll])
        assert (turned.inv() * docked).magnitude() == pytest.approx(0, abs=1e-6)


def test_what_it_writes_can_be_estimated_as_it_lies(desk, json_lines):
    save_sequence(FilmPlan(scene=msgspec.structs.replace(SCENE, camera=CAMERA, lights=Lights(level=900.0))), "s.yaml")
    assert main(["simulate", "--scene", "s.yaml", "--out", "o", "--frames", "2"]) == 0
    found = json_lines("estimate", "o")
    for line, truth in zip(found, rows(desk / "o/truth.csv"), strict=True):
        x_m, _, z_m = line["candidates"][line["selected"]]["position_m"]
        assert (x_m, z_m) == pytest.approx((float(truth["x_m"]), float(truth["z_m"])), abs=0.01)


def test_without_a_scene_it_is_an_approach_from_20_m_to_1_m(desk):
    assert main(["simulate", "--out", "o", "--frames", "3"]) == 0
    table = rows(desk / "o/truth.csv")
    assert [float(row["z_m"]) for row in table] == pytest.approx([20, 10.5, 1])
    for row in table:
        image = cv2.imread(f"o/frame_000{row['frame']}.png", cv2.IMREAD_UNCHANGED)
        x, y = round(float(row["centre_x_px"])), round(float(row["centre_y_px"]))
        assert image[y - 140 : y + 140, x - 140 : x + 140].max() > image[:20].max() + 10  # something is to be seen


@pytest.mark.parametrize(("name", "loss"), [("v.mkv", 0), ("v.MP4", 12)])
def test_a_video_with_its_truth_beside_it(desk, name, loss):
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 0
    assert main(["simulate", "--scene", "s.yaml", "--out", name]) == 0
    assert (desk / "v.csv").read_bytes() == (desk / "o/truth.csv").read_bytes()
    assert load_sequence("v.yaml") == SEQUENCE
    video = cv2.VideoCapture(name)
    assert video.get(cv2.CAP_PROP_FPS) == 4
    for number in (1, 2, 3):
        read, image = video.read()
        assert read
        still = cv2.imread(f"o/frame_000{number}.png", cv2.IMREAD_UNCHANGED)
        assert np.abs(image[:, :, 0].astype(int) - still).mean() <= loss
    assert not video.read()[0]


def test_a_coloured_video_keeps_its_colours(desk):
    red = msgspec.structs.replace(SCENE, lights=Lights(colours=("red",) * 10), sensor=Sensor(colour="bgr"))
    save_sequence(FilmPlan(scene=red), "red.yaml")
    assert main(["simulate", "--scene", "red.yaml", "--out", "film.mkv"]) == 0
    image = cv2.VideoCapture("film.mkv").read()[1].astype(int)
    assert image[:, :, 2].max() > image[:, :, 0].max() + 50


def test_interrupted_it_leaves_what_was_done(desk, capsys, monkeypatch):
    rendered = simulate_command.film

    def interrupted(*arguments):
        frames = rendered(*arguments)
        yield next(frames)
        yield next(frames)
        raise KeyboardInterrupt

    monkeypatch.setattr(simulate_command, "film", interrupted)
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 130
    assert "frame_0002.png" in names(desk / "o")
    assert len(rows(desk / "o/truth.csv")) == 2
    assert main(["simulate", "--scene", "s.yaml", "--out", "v.mkv"]) == 130
    video = cv2.VideoCapture("v.mkv")
    assert [video.read()[0] for _ in range(3)] == [True, True, False]
    assert "stopped" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fog": 3}, "fog"),
        ({"psf": {"model": "mtf", "mtf_csv": "none.csv"}}, "none.csv: cannot be read"),
        ({"psf": {"model": "hou", "theta0_rad": 5.0}}, "holds for c r below"),
        ({"motion": {"kind": "hover", "drift_m": 50.0}}, "position_m z is -"),
    ],
)
def test_a_wrong_scene_ends_with_2_and_one_sentence(desk, refusal, change, message):
    (desk / "wrong.yaml").write_text(to_yaml(msgspec.to_builtins(SCENE) | change))
    assert message in refusal("simulate", "--scene", "wrong.yaml", "--out", "o")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--scene", "gone.yaml", "--out", "o"], "--scene gone.yaml: cannot be read"),
        (["--out", "o", "--frames", "0"], "--frames is 0"),
        (["--out", "o", "--seed", "-1"], "--seed is -1"),
        (["--scene", "s.yaml", "--out", "no/such/v.mp4"], "--out no/such/v.mp4: cannot be written, there is no folder"),
        (["--scene", "deep.yaml", "--out", "v.mp4"], "--out v.mp4: stores 8 bits, the scene's sensor has 12; use"),
        (["--scene", "odd.yaml", "--out", "v.mp4"], "even width and height, the camera has 161 x 120 pixels"),
    ],
)
def test_bad_arguments_end_with_2_and_one_sentence(desk, refusal, arguments, message):
    save_sequence(FilmPlan(scene=msgspec.structs.replace(SCENE, sensor=Sensor(bits=12))), "deep.yaml")
    odd = Camera(175.0, 175.0, 79.5, 59.5, 161, 120)
    save_sequence(FilmPlan(scene=msgspec.structs.replace(SCENE, camera=odd)), "odd.yaml")
    assert message in refusal("simulate", *arguments)


def test_a_shorter_run_does_not_mix_with_a_longer_one(desk, capsys):
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 0
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 0
    assert main(["simulate", "--scene", "s.yaml", "--out", "o", "--frames", "2"]) == 2
    assert "--out o: holds frame_0003.png of a longer run" in capsys.readouterr().err


def test_progress_is_shown_on_standard_error_where_a_person_sits_before_it(desk, capsys, monkeypatch):
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 0
    assert "\x1b" not in capsys.readouterr().err
    monkeypatch.setenv("FORCE_COLOR", "1")  # tells rich that this is a terminal,
    monkeypatch.setenv("TERM", "xterm")  # and one that can draw
    assert main(["simulate", "--scene", "s.yaml", "--out", "o"]) == 0
    captured = capsys.readouterr()
    assert "\x1b" in captured.err
    assert "simulate" in captured.err
    assert captured.out == ""
