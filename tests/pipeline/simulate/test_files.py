# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import math

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Dock
from dockpose.files import FileError, to_yaml
from dockpose.simulate import Lights, Pose, Sensor, load_scene, render
from dockpose.simulate.files import save_scene
from dockpose.simulate.optics.psf import Psf, point_spread
from dockpose.simulate.optics.water import Water, preset, water_of_turbidity
from dockpose.simulate.parts import Background, Lamp, Mirror, Panel, Snow

from tests.support.scenes import PLAIN, QUIET, changed, random_scene, render_folder


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pose(position_m=(0.0, 0.0, -1.0)), "position_m z is -1.0"),
        (lambda: Pose(position_m=(0.0, math.nan, 1.0)), "position_m y is nan"),
        (lambda: Pose(position_m=(0.0, 0.0, 1.0), theta_x_deg=math.inf), "theta_x_deg is inf"),
        (lambda: Lights(level=-1.0), "level is -1.0"),
        (lambda: Lights(radius_m=0.0), "radius_m is 0.0"),
        (lambda: Lights(colours=("pink",)), r"colours\[0\] is 'pink'"),
        (lambda: Lights(brightness=(math.nan,)), r"brightness\[0\] is nan"),
        (lambda: Lights(flicker=1.2), "flicker is 1.2"),
        (lambda: Sensor(bits=9), "bits is 9"),
        (lambda: Sensor(bits=12, jpeg_quality=80), "jpeg_quality is 80 with 12 bits"),
        (lambda: Sensor(jpeg_quality=0), "jpeg_quality is 0"),
        (lambda: Sensor(colour="sepia"), "colour is 'sepia'"),
        (lambda: Sensor(exposure=0.0), "exposure is 0.0"),
        (lambda: Snow(count=-1), "snow count is -1"),
        (lambda: changed(seed=-1), "seed is -1"),
        (lambda: changed(dock=Dock(0.3)), "dock.lights is None"),
        (lambda: changed(lights=Lights(brightness=(1.0, 2.0))), "lights.brightness has 2 values"),
        (lambda: changed(lights=Lights(missing=(10,))), "lights.missing has 10"),
        (lambda: Background(colour=(1.0, -0.5, 1.0)), "background colour green is -0.5"),
        (lambda: Background(colour=(1.0, 1.0, math.nan)), "background colour red is nan"),
        (lambda: Mirror(height_m=-0.2), "height_m is -0.2"),
        (lambda: Panel(size_m=-1.0), "size_m is -1.0"),
        (lambda: Lamp(position_m=(0.0, 0.0, math.nan)), "lamp position_m z is nan"),
        (lambda: changed(water="soup"), "water is 'soup'"),
        (lambda: preset("soup"), "water is 'soup'"),
        (lambda: Water(-0.1, 0.1), "absorption_per_m is -0.1"),
        (lambda: Water(0.1, math.nan), "scattering_per_m is nan"),
        (lambda: Water(0.1, 0.1, "soup"), "phase_function is 'soup'"),
        (lambda: water_of_turbidity(1.5), "turbidity is 1.5"),
        (lambda: changed(water=0.3), "water is 0.3; it must be of the class Water"),
        (lambda: changed(psf="voss"), "psf is 'voss'; it must be of the class Psf"),
        (lambda: Psf(model="fog"), "psf model is 'fog'"),
        (lambda: Psf(width_deg=0.0), "width_deg is 0.0"),
        (lambda: Psf(tilt_deg=85.0), "tilt_deg is 85.0"),
        (lambda: Psf(theta0_rad=-1.0), "theta0_rad is -1.0"),
        (lambda: Psf(model="mtf"), "mtf_csv is None"),
        (lambda: point_spread(Psf(), Water(0.1, 0.1), -1.0), "distance_m is -1.0"),
        (lambda: point_spread(Psf(), Water(0.1, 0.1), math.nan), "distance_m is nan"),
    ],
)
def test_bad_numbers_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_water_goes_by_name():
    assert changed(water="harbour") == changed(water=preset("harbour"))
    np.testing.assert_array_equal(render(changed(water="harbour"))[0], render(changed(water=preset("harbour")))[0])


def test_a_scene_file_comes_back_and_renders_the_same_bytes(tmp_path):
    scene = msgspec.structs.replace(random_scene(3), snow=Snow(count=20), lamps=(Lamp(position_m=(0.5, 0.1, 2.0)),))
    save_scene(scene, tmp_path, "one")
    assert load_scene(tmp_path / "one.yaml") == scene
    before = (tmp_path / "one.png").read_bytes(), (tmp_path / "one.yaml").read_bytes()
    assert render_folder(tmp_path) == ["one"]
    assert ((tmp_path / "one.png").read_bytes(), (tmp_path / "one.yaml").read_bytes()) == before


def test_16_bit_scenes_are_stored_whole(tmp_path):
    scene = changed(sensor=msgspec.structs.replace(QUIET, bits=12))
    save_scene(scene, tmp_path, "deep")
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "deep.png"), cv2.IMREAD_UNCHANGED), render(scene)[0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fog": 3}, "fog"),
        ({"lights": {"level": 100, "colour": "red"}}, "colour"),
        ({"water": "soup"}, "water is 'soup'"),
        ({"pose": {"position_m": [0, 0]}}, "position_m"),
        ({"pose": {"position_m": [0, 0, -2]}}, "position_m z is -2"),
        ({"sensor": {"bits": "many"}}, "bits"),
        ({"seed": 1.5}, "seed"),
        ({"motion": {"kind": "approach", "speed": 3}}, "speed"),
        ({"motion": {"kind": "fly"}}, "fly"),
        ({"motion": {"frames": 3}}, "kind"),
        ({"motion": "approach"}, "motion"),
        ({"motion": {"kind": "approach", "start_m": -20.0}}, "start_m is -20"),
        ({"motion": {"kind": "approach", "end_m": 0.0}}, "end_m is 0"),
        ({"motion": {"kind": "approach", "end_m": math.nan}}, "end_m is nan"),
        ({"motion": {"kind": "sweep", "reach_m": -1.0}}, "reach_m is -1"),
        ({"motion": {"kind": "hover", "drift_m": math.inf}}, "drift_m is inf"),
        ({"motion": {"kind": "hover", "frames": 0}}, "frames is 0"),
        ({"motion": {"kind": "hover", "frames": 2.5}}, "frames"),
        ({"motion": {"kind": "hover", "rate_hz": 0.0}}, "rate_hz is 0"),
        ({"motion": {"kind": "hover", "drift_time_s": 0.0}}, "drift_time_s is 0"),
        ({"motion": {"kind": "closed_loop", "end_m": -1.0}}, "end_m is -1"),
        ({"motion": {"kind": "closed_loop", "speed_m_per_s": -1.0}}, "speed_m_per_s is -1"),
    ],
)
def test_a_wrong_scene_file_names_the_key(tmp_path, change, message):
    path = tmp_path / "s.yaml"
    path.write_text(to_yaml(msgspec.to_builtins(PLAIN) | change))
    with pytest.raises(FileError, match=message) as raised:
        load_scene(path)
    assert "s.yaml" in str(raised.value)


def test_a_scene_file_needs_only_what_has_no_default(tmp_path):
    path = tmp_path / "s.yaml"
    content = {key: msgspec.to_builtins(PLAIN)[key] for key in ("camera", "dock", "pose")} | {"water": "harbour"}
    path.write_text(to_yaml(content))
    assert load_scene(path).water == preset("harbour")
