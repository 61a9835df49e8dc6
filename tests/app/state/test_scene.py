import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.received import read_sent
from dockpose.app.processing.analysis import analyse
from dockpose.app.state import scene as scenes
from dockpose.app.state import view as state
from dockpose.app.state.scene import KNOBS, with_knob, with_missing, with_psf, with_scene, with_text, with_water
from dockpose.app.web.panels.simulator import scene_bytes
from dockpose.simulate import Scene, load_scene
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.optics.water import PRESETS
from dockpose.simulate.scene import Snow, Text


@pytest.fixture(scope="module")
def view():
    return state.open_source(None, None, None)


def scene_of(view) -> Scene:
    assert view.scene is not None
    return view.scene


@pytest.mark.parametrize("name", KNOBS)
def test_every_knob_reads_back_what_it_was_turned_to(view, name):
    knob = KNOBS[name]
    for share in (0.25, 0.6):
        value = knob.limits.low + share * (knob.limits.high - knob.limits.low)
        value = round(value / knob.limits.step) * knob.limits.step
        turned = with_knob(view, name, value)
        assert knob.get(scene_of(turned)) == pytest.approx(value, abs=1e-6)
        assert (turned.is_stale, turned.sample, turned.source) == (True, None, scenes.SOURCE_NAME)
        assert turned.camera == view.camera


@pytest.mark.parametrize("name", KNOBS)
@pytest.mark.parametrize("value", [math.nan, "3", None, True])
def test_knobs_refuse_what_is_no_number(view, name, value):
    with pytest.raises(UserError, match="must be a number"):
        with_knob(view, name, value)


def test_knobs_clamp(view):
    assert scene_of(with_knob(view, "z", 1e9)).pose.position_m[2] == 20
    assert scene_of(with_knob(view, "z", -5)).pose.position_m[2] == 0.1
    assert scene_of(with_knob(view, "snow", 0)).snow is None
    assert scene_of(with_knob(view, "surface", 0)).mirror is None


def test_moved_dock_is_rendered_and_found_where_it_is(view):
    moved = with_knob(with_knob(view, "z", 150), "theta_x", 20)
    analysis = analyse(moved)
    assert analysis.view.truth is not None
    assert analysis.view.truth["position_m"][2] == 1.5
    assert analysis.estimate.selected is not None
    assert analysis.estimate.selected.position_m[2] == pytest.approx(1.5, abs=0.02)
    assert not analysis.view.is_stale
    assert not np.array_equal(analysis.view.image, view.image)


def test_own_picture_starts_from_the_default_scene(view):
    own = state.with_upload(view, b"P5 4 3 255\n" + bytes(12), "a.pgm")
    turned = with_knob(own, "x", 10)
    assert turned.camera == scenes.DEFAULT.camera == turned.given_camera
    assert analyse(turned).view.image.shape == (480, 640)


def test_camera_in_use_is_kept_while_the_scene_changes_and_can_be_taken_over(view):
    wrong = state.with_intrinsic(view, "fx", 800)
    assert with_knob(wrong, "z", 120).camera.fx == 800
    taken = scenes.with_camera_in_use(wrong)
    assert scene_of(taken).camera.fx == 800


def test_presets_and_psf(view):
    assert scene_of(with_water(view, "harbour")).water == PRESETS["harbour"]
    assert scene_of(with_psf(view, "gaussian")).psf.model == "gaussian"
    for refused in (lambda: with_water(view, "mud"), lambda: with_psf(view, "mtf"), lambda: with_psf(view, ["voss"])):
        with pytest.raises(UserError, match="There is no"):
            refused()


def test_presets_turbidity():
    places = [scenes.turbidity_of(water) for water in PRESETS.values()]
    assert places == pytest.approx([0, 1 / 3, 2 / 3, 1])


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
        {"snow": Snow(count=10**9)},
        {"texts": (Text(text="x", x_px=0, y_px=0, height_px=1e6),)},
        {"dock": Dock(0.3, 500)},
        {"psf": Psf(model="mtf", mtf_csv="/etc/passwd")},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_scenes_that_would_cost_too_much_or_read_files_are_refused(view, changes):
    with pytest.raises(UserError):
        with_scene(view, msgspec.structs.replace(scenes.DEFAULT, **changes))


def test_scene_file_is_read_back_and_its_errors_name_the_file(view):
    scene = scene_of(with_knob(view, "noise", 7))
    assert read_sent(scene_bytes(scene), "a.yaml", load_scene) == scene
    with pytest.raises(ValueError, match=r"^mine\.yaml: .*colour_of_sea"):
        read_sent(scene_bytes(scene) + b"colour_of_sea: 3\n", "mine.yaml", load_scene)
    with pytest.raises(ValueError, match=r"mine\.yaml: has .* KiB"):
        read_sent(b"#" * 10**6, "mine.yaml", load_scene)
    with pytest.raises(ValueError, match=r"mine\.yaml"):
        read_sent(b"[" * 200_000, "mine.yaml", load_scene)


def test_scene_that_cannot_be_rendered_raises_a_sentence(view):
    far = with_psf(with_water(with_knob(view, "z", 2000), "harbour"), "hou")
    with pytest.raises(ValueError, match="Hou"):
        analyse(far)
