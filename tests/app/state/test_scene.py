import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.received import read_sent
from dockpose.app.processing.analysis import analyse
from dockpose.app.state import scene as scenes
from dockpose.app.state import view as state
from dockpose.app.state.parameters import put
from dockpose.app.state.scene import with_missing, with_scene, with_text
from dockpose.app.web.panels.source import scene_bytes
from dockpose.simulate import Scene, load_scene
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.optics.water import PRESETS
from dockpose.simulate.parts import Snow, Text


def scene_of(view) -> Scene:
    assert view.scene is not None
    return view.scene


def test_moved_dock_is_rendered_and_found_where_it_is(view):
    moved = put(put(view, "z_cm", 150), "theta_x_deg", 20)
    analysis = analyse(moved)
    assert analysis.view.truth is not None
    assert analysis.view.truth.position_m[2] == 1.5
    assert analysis.estimate.selected is not None
    assert analysis.estimate.selected.position_m[2] == pytest.approx(1.5, abs=0.02)
    assert not analysis.view.is_stale
    assert not np.array_equal(analysis.view.image, view.image)


def test_own_picture_starts_from_the_default_scene(view):
    own = state.with_upload(view, b"P5 4 3 255\n" + bytes(12), "a.pgm")
    turned = put(own, "x_cm", 10)
    assert turned.camera == scenes.DEFAULT_SCENE.camera == turned.given_camera
    assert analyse(turned).view.image.shape == (480, 640)


def test_camera_in_use_is_kept_while_the_scene_changes_and_can_be_taken_over(view):
    wrong = put(view, "fx", 800)
    assert put(wrong, "z_cm", 120).camera.fx == 800
    taken = scenes.with_camera_in_use(wrong)
    assert scene_of(taken).camera.fx == 800


def test_presets(view):
    assert [scenes.turbidity_of(water) for water in PRESETS.values()] == pytest.approx([0, 1 / 3, 2 / 3, 1])
    at = {"clear": 0, "tank": 0.33, "coastal": 0.67, "harbour": 1}  # where the slider has the measured waters
    assert {name: scene_of(put(view, "turbidity", place)).water for name, place in at.items()} == PRESETS
    assert scene_of(put(view, "turbidity", 0.34)).water not in PRESETS.values()


@pytest.mark.parametrize(("text", "missing"), [("", ()), ("0, 3,3", (0, 3)), (" 9 1 ", (1, 9))])
def test_missing_lights(view, text, missing):
    assert scene_of(with_missing(view, text)).lights.missing == missing


@pytest.mark.parametrize("text", ["a", "1.5", "77", "-1", "9" * 5000])
def test_missing_lights_that_are_none_are_refused(view, text):
    with pytest.raises(ValueError, match=r"[Mm]issing"):
        with_missing(view, text)


def test_text_is_short_and_printable(view):
    scene = scene_of(with_text(view, "ROV 1\x00\n" + "x" * 500))
    assert scene.texts[0].text.startswith("ROV 1xxx")
    assert len(scene.texts[0].text) == scenes.LONGEST_TEXT
    assert scene_of(with_text(view, "")).texts == ()


@pytest.mark.parametrize(
    "changes",
    [
        {"camera": Camera(700, 700, 0, 0, 30000, 30000)},
        {"snow": Snow(count=10**5)},
        {"texts": (Text(text="x", x_px=0, y_px=0, height_px=1e6),)},
        {"dock": Dock(0.3, 500)},
        {"psf": Psf(model="mtf", mtf_csv="/etc/passwd")},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_scenes_that_would_cost_too_much_or_read_files_are_refused(view, changes):
    with pytest.raises(UserError):
        with_scene(view, msgspec.structs.replace(scenes.DEFAULT_SCENE, **changes))


def test_scene_file_is_read_back_and_its_errors_name_the_file(view):
    scene = scene_of(put(view, "noise", 7))
    assert read_sent(scene_bytes(scene), "a.yaml", load_scene) == scene
    with pytest.raises(ValueError, match=r"^mine\.yaml: .*colour_of_sea"):
        read_sent(scene_bytes(scene) + b"colour_of_sea: 3\n", "mine.yaml", load_scene)
    with pytest.raises(ValueError, match=r"mine\.yaml: has .* KiB"):
        read_sent(b"#" * 10**6, "mine.yaml", load_scene)
    with pytest.raises(ValueError, match=r"mine\.yaml"):
        read_sent(b"[" * 200_000, "mine.yaml", load_scene)
