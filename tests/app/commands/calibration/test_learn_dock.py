import cv2
import numpy as np
import pytest
from dockpose.app.cli import main
from dockpose.app.inputs.sidecar import load_dock
from dockpose.camera.files import save_camera
from dockpose.simulate import Pose, Scene, render

from tests.support.docks import CAMERA, uneven


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Twelve pictures of a dock whose lights are a millimetre off."""
    folder, rng = tmp_path_factory.mktemp("dock"), np.random.default_rng(0)
    save_camera(CAMERA, folder / "camera.yaml")
    for number in range(12):
        z = rng.uniform(0.8, 1.6)
        x, y = rng.uniform(-0.12, 0.12, 2) * z
        theta_x, theta_y, roll = rng.uniform(-30, 30, 3)
        pose = Pose(position_m=(x, y, z), theta_x_deg=theta_x, theta_y_deg=theta_y, roll_deg=roll)
        image, _ = render(Scene(camera=CAMERA, dock=uneven(0), pose=pose, seed=number))
        cv2.imwrite(str(folder / f"{number:02}.png"), image)
    return folder


def words(folder, *more):
    return [str(folder), "--camera", str(folder / "camera.yaml"), *more]


def test_a_folder_becomes_a_dock_file_that_the_estimate_uses(folder, tmp_path, capsys):
    out = str(tmp_path / "dock.yaml")
    assert main(["learn-dock", *words(folder, "--dock-diameter", "0.30", "--lights", "10", "--out", out)]) == 0
    text = capsys.readouterr().out
    assert "Learned from 12 of 12 views" in text
    assert "the dock's roll is known over the whole turn" in text
    assert np.abs(load_dock(out).offsets_m).max() > 0.5e-3
    assert main(["estimate", *words(folder, "--dock", out)]) == 0
    assert "10 lights on the ring" in capsys.readouterr().out


def test_what_cannot_be_learned_is_said(folder, tmp_path, capsys):
    picture = str(folder / "00.png")
    camera = ["--camera", str(folder / "camera.yaml"), "--dock-diameter", "0.30", "--lights", "10"]
    assert main(["learn-dock", picture, *camera, "--out", str(tmp_path / "d.yaml")]) == 2
    assert "can't tell where the lights are: 1 of 1 views" in capsys.readouterr().err
    assert not (tmp_path / "d.yaml").exists()


def test_a_dock_file_does_not_go_with_a_diameter(folder, tmp_path, capsys):
    assert main(["estimate", *words(folder, "--dock", "d.yaml", "--dock-diameter", "0.30")]) == 2
    assert "--dock d.yaml says it all" in capsys.readouterr().err
