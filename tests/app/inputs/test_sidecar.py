import pytest
from dockpose import Dock
from dockpose.app.inputs.sidecar import load_dock, save_dock
from dockpose.camera.files import load_camera
from dockpose.files.yaml_file import FileError

from tests.support.docks import CAMERA, uneven


def test_a_dock_comes_back_to_the_same_numbers(tmp_path):
    save_dock(uneven(0), tmp_path / "dock.yaml")
    assert load_dock(tmp_path / "dock.yaml") == uneven(0)


def test_the_camera_lies_beside_it(tmp_path):
    save_dock(Dock(0.30), tmp_path / "dock.yaml", CAMERA)
    assert load_dock(tmp_path / "dock.yaml") == Dock(0.30)
    assert load_camera(tmp_path / "dock.yaml") == CAMERA


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("camera: {}", "it has no key dock; its keys are camera"),
        ("dock: {diameter_m: 0.3, lights: 10, offsets_m: [[0, 0, 0]]}", "offsets_m has 1 values; the dock"),
        ("dock: {diameter_m: 0.3, offsets_m: [[0, 0]]}", "offsets_m"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, why):
    (tmp_path / "dock.yaml").write_text(text)
    with pytest.raises(FileError, match=why):
        load_dock(tmp_path / "dock.yaml")
