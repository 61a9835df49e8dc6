import math

import msgspec
import numpy as np
import pytest

from pipeline.camera_files import FileError, to_yaml
from pipeline.simulate import Scene, load_scene, render, render_folder, save_scene, truth_of
from pipeline.simulate.render import gaussian_spots
from tests.scenes import CAMERA, DOCK, random_scene

PLAIN = Scene(camera=CAMERA, dock=DOCK, position_m=(0.0, 0.0, 1.0))


def test_a_spot_holds_its_energy_and_its_centre():
    image = gaussian_spots(np.array([[20.3, 15.8]]), np.array([1.7]), np.array([500.0]), (40, 50))
    assert image.sum() == pytest.approx(500)
    rows, columns = np.mgrid[:40, :50]
    assert (image * columns).sum() / 500 == pytest.approx(20.3, abs=1e-6)
    assert (image * rows).sum() / 500 == pytest.approx(15.8, abs=1e-6)


def test_truth_by_hand():
    truth = truth_of(PLAIN)
    np.testing.assert_allclose(truth.lights_px[0], [319.5 + 105, 239.5])  # 700 * 0.15 m / 1 m, on the x axis
    np.testing.assert_allclose(truth.centre_px, [319.5, 239.5])
    assert truth.visible.all()


def test_the_same_scene_gives_the_same_bytes_and_another_seed_other_noise():
    first, _ = render(PLAIN)
    again, _ = render(PLAIN)
    other, _ = render(msgspec.structs.replace(PLAIN, seed=1))
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


def test_scattered_light_leaves_the_lamp_and_lands_around_it():
    quiet = {"noise_levels": 0.0, "background_level": 0.0, "light_level": 2000.0, "attenuation_per_m": 0.5}
    clear = render(msgspec.structs.replace(PLAIN, scattered_per_m=0.0, **quiet))[0]
    hazy = render(msgspec.structs.replace(PLAIN, scattered_per_m=0.5, **quiet))[0]
    x, y = np.rint(truth_of(PLAIN).lights_px[0]).astype(int)
    assert hazy[y, x] == clear[y, x] == 255
    assert clear[y + 12, x] == 0  # nine standard deviations of the lamp's spot away
    assert hazy[y + 12, x] > 0


def test_direct_light_fades_by_beer_and_lambert():
    quiet = {"noise_levels": 0.0, "background_level": 0.0, "light_level": 200.0, "scattered_per_m": 0.0}
    clear = render(msgspec.structs.replace(PLAIN, attenuation_per_m=0.0, **quiet))[0]
    dim = render(msgspec.structs.replace(PLAIN, attenuation_per_m=0.7, **quiet))[0]
    distance = math.hypot(1.0, 0.15)
    assert dim.max() / clear.max() == pytest.approx(math.exp(-0.7 * distance), abs=1 / clear.max())


def test_a_dock_that_looks_away_shows_no_light():
    image, truth = render(msgspec.structs.replace(PLAIN, theta_y_deg=180.0, noise_levels=0.0))
    assert not truth.visible.any()
    assert image.max() == image.min() == 12


def test_a_dock_out_of_view_is_an_empty_picture():
    image, truth = render(msgspec.structs.replace(PLAIN, position_m=(5.0, 0.0, 1.0), noise_levels=0.0))
    assert not truth.visible.any()
    assert image.max() < 20


def test_bright_lights_saturate_at_255():
    image, _ = render(msgspec.structs.replace(PLAIN, light_level=5000.0))
    assert image.max() == 255
    assert image.dtype == np.uint8


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position_m": (0.0, 0.0, -1.0)}, "position_m z is -1.0"),
        ({"position_m": (0.0, math.nan, 1.0)}, "position_m y is nan"),
        ({"light_level": 0.0}, "light_level is 0.0"),
        ({"noise_levels": -1.0}, "noise_levels is -1.0"),
        ({"scattered_per_m": 0.9}, "scattered_per_m is 0.9"),
        ({"theta_x_deg": math.inf}, "theta_x_deg is inf"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_bad_numbers_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        msgspec.structs.replace(PLAIN, **change)


def test_a_scene_file_comes_back_and_renders_the_same_bytes(tmp_path):
    scene = random_scene(3)
    save_scene(scene, tmp_path, "one")
    assert load_scene(tmp_path / "one.yaml") == scene
    before = (tmp_path / "one.png").read_bytes(), (tmp_path / "one.yaml").read_bytes()
    assert render_folder(tmp_path) == ["one"]
    assert ((tmp_path / "one.png").read_bytes(), (tmp_path / "one.yaml").read_bytes()) == before


def test_an_unknown_key_of_a_scene_is_named(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text(to_yaml(msgspec.to_builtins(PLAIN) | {"fog": 3}))
    with pytest.raises(FileError, match="fog"):
        load_scene(path)
