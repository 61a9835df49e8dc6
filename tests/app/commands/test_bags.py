"""Bags as sources of the commands: the same poses as from the pictures, and what is said of those cut short."""

import json

import cv2
import pytest
from dockpose import simulate
from dockpose.app.cli import main
from dockpose.camera.files import save_camera
from dockpose.camera.image import read

from tests.support import bags
from tests.support.scenes import CAMERA, random_scene

FRAMES = 16
DOCK_WORDS = ["--dock-diameter", "0.30", "--lights", "10"]
INFO = ("/camera/camera_info", bags.CAMERA_INFO, bags.START_NS, bags.camera_info(CAMERA.matrix.ravel(), (640, 480)))


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A folder with the pictures of an approach, a camera file, and an MCAP of the same pictures."""
    folder = tmp_path_factory.mktemp("course")
    motion = simulate.Approach(start_m=2.0, end_m=0.9, frames=FRAMES, rate_hz=10.0, drift_m=0.005, drift_deg=0.5)
    pictures = [frame.image for frame in simulate.film(simulate.FilmPlan(scene=random_scene(3), motion=motion))]
    (folder / "pictures").mkdir()
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(folder / "pictures" / f"{number:04d}.png"), picture)
    save_camera(CAMERA, folder / "camera.yaml")
    bags.write_mcap(folder / "run.mcap", [INFO, *bags.frames(pictures)])
    return folder


def estimated(words, capsys, status=0):
    assert main(["estimate", *words, "--json", "-"]) == status
    captured = capsys.readouterr()
    return [json.loads(line) for line in captured.out.splitlines()], captured.err


def without_names(line):
    return {
        key: line[key]
        for key in line
        if key not in ("source", "sha256", "camera", "elapsed_ms", "time_unix_s", "time_s")
    }


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_bag_gives_the_poses_of_its_pictures(course, jobs, capsys):
    camera = ["--camera", str(course / "camera.yaml")]
    expected, _ = estimated([str(course / "pictures"), "--rate", "10", *camera, *DOCK_WORDS], capsys)
    found, told = estimated([str(course / "run.mcap"), "--jobs", jobs, "--topic", bags.TOPIC, *DOCK_WORDS], capsys)
    assert len(found) == len(expected) == FRAMES
    assert [without_names(line) for line in found] == [without_names(line) for line in expected]
    assert [line["time_s"] for line in found] == pytest.approx([line["time_s"] for line in expected])
    assert found[3]["time_unix_s"] == pytest.approx(bags.START_NS / 1e9 + 0.3, abs=1e-6)
    assert "the camera is that of the bag's topic /camera/camera_info" in told


def test_a_bag_that_breaks_off_is_done_as_far_as_it_goes(course, tmp_path, capsys):
    path, whole = tmp_path / "cut.mcap", (course / "run.mcap").read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    found, told = estimated([str(path), *DOCK_WORDS], capsys, 1)
    assert FRAMES // 2 < len(found) < FRAMES
    assert told.count("cut short") == 1
    assert f"the bag is cut short: {len(found)} frames are there" in told


def test_what_is_missing_or_open_is_asked_for(course, tmp_path, capsys):
    for command in ("estimate", "compare"):
        assert main([command, str(course / "run.mcap")]) == 2
        assert "how large is the dock?" in capsys.readouterr().err
    pictures = [read(course / "pictures" / "0000.png")] * 2
    path = bags.write_mcap(tmp_path / "a.mcap", bags.frames(pictures) + bags.frames(pictures, topic="/b/image_raw"))
    assert main(["estimate", str(path), *DOCK_WORDS]) == 1
    assert "which topic? Say --topic with one of /b/image_raw, /camera/image_raw" in capsys.readouterr().err
    assert main(["estimate", str(path), "--topic", "/b/image_raw", *DOCK_WORDS]) == 2
    assert "which camera? Give --camera" in capsys.readouterr().err


def test_a_camera_of_another_size_is_refused_and_both_sizes_are_named(course, tmp_path, capsys):
    picture = read(course / "pictures" / f"{FRAMES - 1:04d}.png")
    half = cv2.resize(picture, (320, 240), interpolation=cv2.INTER_AREA)
    path = bags.write_mcap(tmp_path / "half.mcap", [INFO, *bags.frames([half])])
    assert main(["estimate", str(path), *DOCK_WORDS]) == 2
    told = capsys.readouterr().err
    assert "it is for pictures of 640 x 480 pixels, but they have 320 x 240" in told
    assert "which camera? Give --camera" in told
    (line,), told = estimated([str(path), "--camera", str(course / "camera.yaml"), *DOCK_WORDS], capsys)
    assert line["camera"]["fx_px"] == pytest.approx(CAMERA.fx / 2)
    assert "camera_info" not in told
