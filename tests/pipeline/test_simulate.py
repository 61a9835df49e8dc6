# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import math

import cv2
import msgspec
import numpy as np
import pytest

from pipeline import Camera, Dock
from pipeline.camera_files import FileError, to_yaml
from pipeline.circle_pose import circle_poses
from pipeline.port import FlatPort
from pipeline.simulate import (
    Lights,
    Pose,
    Scene,
    Sensor,
    load_scene,
    render,
    render_folder,
    render_parts,
    save_scene,
    truth_of,
)
from pipeline.simulate.psf import Psf
from pipeline.simulate.scene import Background, Glare, Lamp, Mirror, Occluder, Panel, Snow, Text
from pipeline.simulate.water import Water, preset
from tests.scenes import CAMERA, DOCK, random_scene

QUIET = Sensor(read_noise_levels=0.0, electrons_per_level=1e12)
DARK = Background(level=0.0)
PLAIN = Scene(camera=CAMERA, dock=DOCK, pose=Pose(position_m=(0.0, 0.0, 1.0)), sensor=QUIET, background=DARK)


def changed(**parts: object) -> Scene:
    return msgspec.structs.replace(PLAIN, **parts)


def near(image, point, reach=3):
    x, y = np.rint(point).astype(int)
    return image[y - reach : y + reach + 1, x - reach : x + reach + 1]


def test_truth_by_hand():
    truth = truth_of(PLAIN)
    np.testing.assert_allclose(truth.lights_px[0], [319.5 + 105, 239.5])  # 700 * 0.15 m / 1 m, on the x axis
    np.testing.assert_allclose(truth.lights_px[5], [319.5 - 105, 239.5])
    np.testing.assert_allclose(truth.centre_px, [319.5, 239.5])
    assert truth.ellipse.centre_px == pytest.approx((319.5, 239.5))
    assert truth.ellipse.semi_axes_px == pytest.approx((105, 105))
    assert truth.visible.all()


@pytest.mark.parametrize("seed", range(10))
def test_the_true_ellipse_leads_back_to_the_true_pose(seed):
    scene = random_scene(seed)
    truth = truth_of(scene)
    poses = circle_poses(truth.ellipse, CAMERA, DOCK.diameter)
    assert min(np.abs(pose.position_m - truth.position_m).max() for pose in poses) < 1e-6


def test_the_same_scene_gives_the_same_bytes_and_another_seed_other_noise():
    noisy = random_scene(1)
    first, _ = render(noisy)
    assert first.tobytes() == render(noisy)[0].tobytes()
    assert first.tobytes() != render(msgspec.structs.replace(noisy, seed=2))[0].tobytes()


def test_direct_light_fades_by_beer_and_lambert_along_each_path():
    near_light = render_parts(changed(water=Water(0.0, 0.0))).direct
    faded = render_parts(changed(water=Water(0.3, 0.4))).direct
    truth = truth_of(PLAIN)
    for point, place in zip(truth.lights_px, truth.lights_m, strict=True):
        ratio = near(faded, point).sum() / near(near_light, point).sum()
        assert ratio == pytest.approx(math.exp(-0.7 * np.linalg.norm(place)), rel=1e-3)


def test_a_light_far_away_falls_with_the_square_of_its_distance():
    lights = Lights(beam_exponent=0.0)
    clear = Water(0.0, 0.0)
    one = render_parts(changed(lights=lights, water=clear)).direct.sum()
    two = render_parts(changed(lights=lights, water=clear, pose=Pose(position_m=(0.0, 0.0, 2.0)))).direct.sum()
    assert one / two == pytest.approx((4 + 0.15**2) / (1 + 0.15**2), rel=0.01)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 4.0])
def test_a_tilted_light_falls_with_its_beam(exponent):
    lights, clear = Lights(beam_exponent=exponent), Water(0.0, 0.0)
    pose = Pose(position_m=(0.0, 0.0, 3.0), theta_y_deg=40.0)
    truth = truth_of(changed(pose=pose))
    tilted = render_parts(changed(lights=lights, water=clear, pose=pose)).direct.sum()
    even = render_parts(changed(lights=Lights(beam_exponent=0.0), water=clear, pose=pose)).direct.sum()
    unit = truth.lights_m / np.linalg.norm(truth.lights_m, axis=1, keepdims=True)
    assert tilted / even == pytest.approx(np.mean((-unit @ truth.normal) ** exponent), rel=0.02)


def test_the_middle_of_a_light_has_the_level_that_was_asked_for():
    # One light on the axis, 1 m ahead, in water that does nothing: level 150 by the definition of Lights.level. The
    # lamp is small against the blur, so that its disc is as good as the Gaussian of the definition.
    scene = changed(
        camera=Camera(700, 700, 320, 240, 640, 480),
        lights=Lights(level=150.0, radius_m=0.0005, missing=tuple(range(1, 10))),
        water=Water(0.0, 0.0),
        pose=Pose(position_m=(-0.15, 0.0, 1.0)),
        sensor=msgspec.structs.replace(QUIET, blur_px=1.5),
    )
    image, _ = render(scene)
    assert image[240, 320] == pytest.approx(150, rel=0.05)  # the pixel is square, not a point


def brute_force_glow(scene):
    """The glow of each lamp at every pixel, one after the other."""
    from pipeline.simulate import glow
    from pipeline.simulate.emitters import emitters_of

    y, x = np.mgrid[: scene.camera.height, : scene.camera.width]
    total = np.zeros(x.shape)
    for lamp in glow._lamps(scene, emitters_of(scene, truth_of(scene)), scene.water):
        dx, dy = x - lamp.centre_px[0], y - lamp.centre_px[1]
        angle = np.hypot(*np.tensordot(lamp.angle_of_px, np.stack([dx, dy]), axes=1))
        total += (
            lamp.energy
            * lamp.rad_per_px**2
            * np.interp(np.log(np.maximum(angle, 1e-7)), np.log(glow.ANGLES), lamp.glow)
        )
    return total


@pytest.mark.parametrize("model", ["voss", "hou", "gaussian"])
@pytest.mark.parametrize("water", ["clear", "coastal", "harbour"])
def test_the_fast_glow_is_the_glow_of_every_lamp_at_every_pixel(model, water):
    # A tenth of a grey level is far below what an 8-bit sensor stores.
    pose = Pose(position_m=(0.05, -0.03, 1.2), theta_x_deg=20.0, theta_y_deg=25.0)
    scene = changed(pose=pose, water=preset(water), psf=Psf(model=model), lights=Lights(level=1000.0))
    fast, slow = render_parts(scene).glow, brute_force_glow(scene)
    assert np.abs(fast - slow).max() < 0.1
    assert fast.sum() == pytest.approx(slow.sum(), rel=0.01)


def test_direct_glow_and_sum_as_in_figures_5_to_7():
    # Symmetric and asymmetric: in each the direct light piles up near the bright end of the histogram, and the glow
    # is dim and wide.
    for psf in (Psf(model="hou"), Psf(model="hou_poisson"), Psf(model="voss"), Psf(model="hou", tilt_deg=50.0)):
        pose = Pose(position_m=(0.0, 0.0, 1.5))
        bright = Lights(level=2500.0, radius_m=0.006, beam_exponent=0.0)
        rendering = render_parts(changed(psf=psf, pose=pose, lights=bright, water=preset("coastal"), seed=4))
        visible = truth_of(changed(pose=pose)).lights_px
        counts = np.bincount(rendering.image.ravel(), minlength=256)
        assert counts[255] > 10 * 20  # every light is some twenty saturated pixels
        assert counts[255] > 20 * counts[200:250].mean()  # a peak near the bright end
        assert counts[:60].sum() > 0.95 * counts.sum()
        for point in visible:
            assert near(rendering.image, point, 1).max() == 255
        rows, columns = np.mgrid[:480, :640]
        distance = np.min([np.hypot(columns - x, rows - y) for x, y in visible], axis=0)
        away = (distance > 12) & (distance < 20)
        assert rendering.direct[away].max() < 1e-3
        assert rendering.glow[away].mean() > 0.3 or psf.model == "hou_poisson"


def test_an_asymmetric_glow_is_wider_along_its_axis_and_keeps_its_energy():
    one = Lights(missing=tuple(range(1, 10)), level=3000.0)
    pose = Pose(position_m=(-0.15, 0.0, 1.0))
    scene = changed(lights=one, pose=pose, water=preset("harbour"), camera=Camera(700, 700, 320, 240, 640, 480))
    even = render_parts(scene).glow
    tilted = render_parts(msgspec.structs.replace(scene, psf=Psf(tilt_deg=60.0))).glow
    assert even[240, 320 + 30] == pytest.approx(even[240 + 30, 320], rel=0.02)
    assert tilted[240, 320 + 30] > 1.5 * tilted[240 + 30, 320]
    assert tilted[240 + 30, 320] != pytest.approx(tilted[240 - 30, 320], rel=0.01)
    assert tilted.sum() == pytest.approx(even.sum(), rel=0.1)


def test_lights_under_a_flat_port_and_a_bent_lens_are_where_their_rays_go():
    camera = Camera(500, 500, 320, 240, 640, 480, (-0.2, 0.05, 0.0, 0.0, 0.0), FlatPort(0.03, 0.01))
    scene = changed(camera=camera, pose=Pose(position_m=(0.12, -0.1, 0.8)), lights=Lights(level=250.0))
    image, truth = render(scene)
    for point, place in zip(truth.lights_px, truth.lights_m, strict=True):
        start, ray = camera.ray_starts([point])[0], camera.rays([point])[0]
        along = (place - start) @ ray
        np.testing.assert_allclose(start + along * ray, place, atol=1e-9)
        window = near(image, point, 8).astype(float)
        rows, columns = np.mgrid[-8:9, -8:9]
        offset = np.array([(window * columns).sum(), (window * rows).sum()]) / window.sum()
        assert np.linalg.norm(np.rint(point) + offset - point) < 0.05


@pytest.mark.parametrize(
    "pose", [Pose(position_m=(0.0, 0.0, 1.0), theta_y_deg=180.0), Pose(position_m=(9.0, 0.0, 1.0))]
)
def test_a_dock_that_looks_away_or_is_out_of_view_is_an_empty_picture(pose):
    image, truth = render(changed(pose=pose))
    assert not truth.visible.any()
    assert image.max() == 0


def test_missing_and_flickering_lights_are_dark_and_not_visible():
    image, truth = render(changed(lights=Lights(missing=(2, 7))))
    assert np.flatnonzero(~truth.visible).tolist() == [2, 7]
    assert near(image, truth.lights_px[2]).max() < 5
    assert near(image, truth.lights_px[3]).max() > 50
    counts = [truth_of(changed(lights=Lights(flicker=0.3), seed=seed)).visible.sum() for seed in range(200)]
    assert np.mean(counts) == pytest.approx(7, abs=3 * math.sqrt(10 * 0.21 / 200))


def test_uneven_brightness_size_and_spacing_are_drawn():
    angles = (0.0, 30.0, 80.0, 100.0, 150.0, 180.0, 200.0, 260.0, 300.0, 340.0)
    lights = Lights(level=200.0, brightness=(1.0,) * 9 + (0.25,), angles_deg=angles)
    rendering = render_parts(changed(lights=lights))
    truth = rendering.truth
    np.testing.assert_allclose(truth.lights_px[1], [319.5 + 105 * math.cos(math.radians(30)), 239.5 + 52.5])
    dim, bright = near(rendering.direct, truth.lights_px[9]).sum(), near(rendering.direct, truth.lights_px[0]).sum()
    assert dim / bright == pytest.approx(0.25, rel=0.02)


def test_in_colour_red_dies_first():
    lights = Lights(level=200.0, colours=("red", "blue") * 5)
    sensor = msgspec.structs.replace(QUIET, colour="bgr")

    def share_of_red(z_m):
        pose = Pose(position_m=(0.0, 0.0, z_m))
        image, truth = render(changed(lights=lights, sensor=sensor, pose=pose, water=preset("clear")))
        red = near(image, truth.lights_px[0]).reshape(-1, 3).sum(axis=0)[2]
        blue = near(image, truth.lights_px[1]).reshape(-1, 3).sum(axis=0)[0]
        return red / blue

    # Pope and Fry: 0.265 1/m more absorption at 620 nm than at 460 nm; the two lights are equally far.
    assert share_of_red(2.0) / share_of_red(1.0) == pytest.approx(math.exp(-0.265), rel=0.05)


def test_a_bayer_sensor_gives_the_colours_back_where_they_change_slowly():
    light = Background(level=50.0, glares=(Glare(x_px=320.0, y_px=240.0, size_px=100.0, level=100.0),))
    grey = render(changed(background=light, lights=Lights(level=0.0)))[0]
    colour = render(
        changed(
            background=light,
            lights=Lights(level=0.0),
            sensor=Sensor(colour="bayer", read_noise_levels=0.0, electrons_per_level=1e12),
        )
    )[0]
    assert colour.shape == (480, 640, 3)
    assert np.abs(colour[2:-2, 2:-2].astype(int) - grey[2:-2, 2:-2, None]).max() <= 2


def test_a_mirror_doubles_the_lights_above_the_surface():
    scene = changed(mirror=Mirror(height_m=0.25, ripple_deg=0.0), camera=Camera(400, 400, 319.5, 239.5, 640, 480))
    image, truth = render(scene)
    below = truth.lights_m[7] * [1, -1, 1] - [0, 0.5, 0]
    image_px = scene.camera.project(below[None])[0]
    assert near(image, image_px).max() > 20
    assert near(render(msgspec.structs.replace(scene, mirror=None))[0], image_px).max() < 5


def test_everything_else_in_the_water_shows_where_it_should():
    assert near(render(changed(lamps=(Lamp(position_m=(0.3, 0.2, 1.0)),)))[0], (319.5 + 210, 239.5 + 140)).max() > 100
    assert (render(changed(snow=Snow(count=200)))[0] > 5).sum() > 200
    text = render(changed(texts=(Text(text="2026-11-20 IPC", x_px=400.0, y_px=20.0),)))[0]
    assert (text[20:37, 400:620] == 255).sum() > 100
    assert text[60:100, 450:620].max() < 10
    panel = changed(background=Background(level=100.0), panel=Panel(size_m=0.4, level=4.0), lights=Lights(level=0.0))
    image = render(panel)[0]
    assert image[240, 320] == 4
    assert image[240, 20] == 100
    gradient = render(changed(background=Background(level=50.0, gradient_x=40.0), lights=Lights(level=0.0)))[0]
    assert (gradient[:, 0].mean(), gradient[:, -1].mean()) == pytest.approx((30, 70), abs=1)
    veil = render(changed(background=Background(level=0.0, backscatter_level=50.0), lights=Lights(level=0.0)))[0]
    assert veil[240, 320] > veil[10, 10] + 3


def test_an_occluder_hides_the_light_behind_it():
    bar = Occluder(x_px=424.5, y_px=239.5, width_px=30.0, height_px=60.0, angle_deg=20.0, level=7.0)
    image, truth = render(changed(occluders=(bar,)))
    assert np.flatnonzero(~truth.visible).tolist() == [0]
    assert near(image, (424.5, 239.5)).max() == 7


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (10, np.uint16), (12, np.uint16), (16, np.uint16)])
def test_every_depth_saturates_at_its_own_end(bits, kind):
    sensor = msgspec.structs.replace(QUIET, bits=bits)
    image, _ = render(changed(sensor=sensor, lights=Lights(level=5000.0)))
    assert image.dtype == kind
    assert image.max() == (1 << bits) - 1


def test_shot_and_read_noise_have_their_variance():
    sensor = Sensor(read_noise_levels=2.0, electrons_per_level=20.0)
    image, _ = render(changed(sensor=sensor, background=Background(level=100.0), lights=Lights(level=0.0)))
    # Shot noise 100 / 20, read noise 2^2, rounding 1/12; the variance of 307200 pixels is known to 0.3 %.
    assert image.astype(float).var() == pytest.approx(5 + 4 + 1 / 12, rel=0.01)


def test_exposure_vignetting_gain_and_jpeg_do_what_they_say():
    light = {"background": Background(level=40.0), "lights": Lights(level=0.0)}

    def level(**values):
        return render(changed(sensor=msgspec.structs.replace(QUIET, **values), **light))[0]

    assert level(exposure=2.0).mean() == pytest.approx(80)
    assert level(gain=3.0).mean() == pytest.approx(120)
    corner = level(vignetting=0.5)
    assert corner[0, 0] == pytest.approx(20, abs=1)
    assert corner[240, 320] == 40
    assert level(jpeg_quality=50).mean() == pytest.approx(40, abs=1)


def test_motion_blur_draws_a_streak_of_its_length():
    sensor = msgspec.structs.replace(QUIET, motion_blur_px=20.0, motion_angle_deg=90.0)
    image, truth = render(changed(sensor=sensor, lights=Lights(level=800.0, radius_m=0.001)))
    x, y = np.rint(truth.lights_px[0]).astype(int)
    column = image[y - 30 : y + 31, x].astype(float)
    assert np.count_nonzero(column > column.max() / 2) == pytest.approx(20, abs=2)
    assert np.count_nonzero(image[y, x - 30 : x + 31] > column.max() / 2) < 6


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
        (lambda: Dock(0.3, 0), "lights is 0"),
    ],
)
def test_bad_numbers_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


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
