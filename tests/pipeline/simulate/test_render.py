# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportArgumentType=false

import itertools
import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.pose.circle import circle_poses
from dockpose.simulate import Lights, Pose, Sensor, render, truth_of
from dockpose.simulate.emitters import emitters_of
from dockpose.simulate.optics import glow
from dockpose.simulate.optics.glow import light_of
from dockpose.simulate.optics.psf import Psf
from dockpose.simulate.optics.water import Water, preset
from dockpose.simulate.parts import Background, Glare, Lamp, Mirror, Occluder, Panel, Snow, Text, Wall

from tests.support.scenes import CAMERA, DOCK, PLAIN, QUIET, changed, near, random_scene


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
    near_light = light_of(changed(water=Water(0.0, 0.0)))[0]
    faded = light_of(changed(water=Water(0.3, 0.4)))[0]
    truth = truth_of(PLAIN)
    for point, place in zip(truth.lights_px, truth.lights_m, strict=True):
        ratio = near(faded, point).sum() / near(near_light, point).sum()
        assert ratio == pytest.approx(math.exp(-0.7 * np.linalg.norm(place)), rel=1e-3)


def test_a_light_far_away_falls_with_the_square_of_its_distance():
    lights = Lights(beam_exponent=0.0)
    clear = Water(0.0, 0.0)
    one = light_of(changed(lights=lights, water=clear))[0].sum()
    two = light_of(changed(lights=lights, water=clear, pose=Pose(position_m=(0.0, 0.0, 2.0))))[0].sum()
    assert one / two == pytest.approx((4 + 0.15**2) / (1 + 0.15**2), rel=0.01)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 4.0])
def test_a_tilted_light_falls_with_its_beam(exponent):
    lights, clear = Lights(beam_exponent=exponent), Water(0.0, 0.0)
    pose = Pose(position_m=(0.0, 0.0, 3.0), theta_y_deg=40.0)
    truth = truth_of(changed(pose=pose))
    tilted = light_of(changed(lights=lights, water=clear, pose=pose))[0].sum()
    even = light_of(changed(lights=Lights(beam_exponent=0.0), water=clear, pose=pose))[0].sum()
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


@pytest.mark.slow
@pytest.mark.parametrize(("bits", "limit_px"), [(8, 0.02), (16, 0.002)])
@pytest.mark.parametrize("water", ["clear", "tank"])
def test_the_centre_of_an_isolated_light_lies_at_the_truth_at_any_subpixel_place(water, bits, limit_px):
    # With 8 bits what is left is the rounding of the light's edges to whole grey levels.
    one = Lights(level=250.0, missing=tuple(range(1, 10)))
    sensor = msgspec.structs.replace(QUIET, bits=bits)
    rows, columns = np.mgrid[-12:13, -12:13]
    for x_px, y_px in itertools.product(300 + np.array([0.0, 0.13, 0.37, 0.5, 0.75, 0.88]), repeat=2):
        pose = Pose(position_m=((x_px - 319.5) / 700 - 0.15, (y_px - 239.5) / 700, 1.0))
        image, truth = render(changed(pose=pose, lights=one, sensor=sensor, water=preset(water)))
        np.testing.assert_allclose(truth.lights_px[0], (x_px, y_px))
        window = near(image, (x_px, y_px), 12).astype(float)
        window = np.maximum(window - np.median(window[0]), 0)  # what the glow adds evenly
        assert 50 < window.max() * 255 / ((1 << bits) - 1) < 250
        centre = np.array([(window * columns).sum(), (window * rows).sum()]) / window.sum() + np.rint((x_px, y_px))
        assert np.linalg.norm(centre - (x_px, y_px)) < limit_px


def brute_force_glow(scene):
    """The glow of each lamp at every pixel, one after the other."""
    y, x = np.mgrid[: scene.camera.height, : scene.camera.width]
    total = np.zeros(x.shape)
    for lamp in glow._lamps(scene, emitters_of(scene, truth_of(scene)), scene.water):
        dx, dy = x - lamp.centre_px[0], y - lamp.centre_px[1]
        angle = np.hypot(*np.tensordot(lamp.angle_of_px, np.stack([dx, dy]), axes=1))
        spread = np.interp(np.log(np.maximum(angle, 1e-7)), np.log(glow.ANGLES), lamp.glow)
        total += lamp.energy * lamp.rad_per_px**2 * spread
    return total


@pytest.mark.slow
@pytest.mark.parametrize("model", ["voss", "hou", "gaussian"])
@pytest.mark.parametrize("water", ["clear", "coastal", "harbour"])
def test_the_fast_glow_is_the_glow_of_every_lamp_at_every_pixel(model, water):
    # A tenth of a grey level is far below what an 8-bit sensor stores.
    pose = Pose(position_m=(0.05, -0.03, 1.2), theta_x_deg=20.0, theta_y_deg=25.0)
    scene = changed(pose=pose, water=preset(water), psf=Psf(model=model), lights=Lights(level=1000.0))
    fast, slow = light_of(scene)[1], brute_force_glow(scene)
    assert np.abs(fast - slow).max() < 0.1
    assert fast.sum() == pytest.approx(slow.sum(), rel=0.01)


def test_an_asymmetric_glow_is_wider_along_its_axis_and_keeps_its_energy():
    one = Lights(missing=tuple(range(1, 10)), level=3000.0)
    pose = Pose(position_m=(-0.15, 0.0, 1.0))
    scene = changed(lights=one, pose=pose, water=preset("harbour"), camera=Camera(700, 700, 320, 240, 640, 480))
    even = light_of(scene)[1]
    tilted = light_of(msgspec.structs.replace(scene, psf=Psf(tilt_deg=60.0)))[1]
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
    scene = changed(lights=lights)
    truth, direct = truth_of(scene), light_of(scene)[0]
    np.testing.assert_allclose(truth.lights_px[1], [319.5 + 105 * math.cos(math.radians(30)), 239.5 + 52.5])
    dim, bright = near(direct, truth.lights_px[9]).sum(), near(direct, truth.lights_px[0]).sum()
    assert dim / bright == pytest.approx(0.25, rel=0.02)


def test_the_dock_itself_may_say_where_its_lights_are():
    dock = Dock(0.3, angles_deg=(0.0, 90.0, 200.0))
    truth = truth_of(changed(dock=dock))
    np.testing.assert_allclose(truth.lights_px[1], [319.5, 239.5 + 105], atol=1e-9)
    other = Lights(angles_deg=(0.0, 80.0, 200.0))
    assert truth_of(changed(dock=dock, lights=other)).lights_px[1, 0] > 330  # as it was really built


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
    glare = Glare(x_px=320.0, y_px=240.0, size_px=100.0, level=100.0)
    light = {"background": Background(level=50.0, glares=(glare,)), "lights": Lights(level=0.0)}
    grey = render(changed(**light))[0]
    colour = render(changed(sensor=msgspec.structs.replace(QUIET, colour="bayer"), **light))[0]
    assert colour.shape == (480, 640, 3)
    assert np.abs(colour[2:-2, 2:-2].astype(int) - grey[2:-2, 2:-2, None]).max() <= 2


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


def test_the_background_may_be_coloured_and_the_panel_is_not():
    background = Background(level=100.0, colour=(0.5, 1.0, 0.25))
    scene = changed(background=background, panel=Panel(size_m=0.4, level=4.0), lights=Lights(level=0.0))
    image, _ = render(msgspec.structs.replace(scene, sensor=msgspec.structs.replace(QUIET, colour="bgr")))
    assert image[20, 20].tolist() == [50, 100, 25]
    assert image[240, 320].tolist() == [4, 4, 4]
    assert render(scene)[0][20, 20] == 100


def test_a_panel_keeps_its_outline_where_the_lens_bends_its_edges_inwards():
    camera = Camera(300, 300, 319.5, 239.5, 640, 480, (0.4, 0.0, 0.0, 0.0))
    light = {"background": Background(level=100.0), "lights": Lights(level=0.0)}
    image, _ = render(changed(camera=camera, panel=Panel(size_m=1.2, level=4.0), **light))
    middle_of_edge, corner = np.rint(camera.project([[0.0, -0.6, 1.0], [0.6, -0.6, 1.0]])).astype(int)
    assert corner[1] < middle_of_edge[1] - 20
    column, row = middle_of_edge
    assert image[row - 3, column] == 100
    assert image[row + 3, column] == 4
    assert image[corner[1] + 5, corner[0] - 5] == 4


def test_a_mirror_doubles_the_lights_above_the_surface():
    scene = changed(mirror=Mirror(height_m=0.25, ripple_deg=0.0), camera=Camera(400, 400, 319.5, 239.5, 640, 480))
    image, truth = render(scene)
    below = truth.lights_m[7] * [1, -1, 1] - [0, 0.5, 0]
    image_px = scene.camera.project(below[None])[0]
    assert near(image, image_px).max() > 20
    assert near(render(msgspec.structs.replace(scene, mirror=None))[0], image_px).max() < 5


@pytest.mark.parametrize(("side", "flip", "shift"), [("floor", 1, 0.6), ("left", 0, -0.6), ("right", 0, 0.6)])
def test_a_wall_shows_the_lights_again_dimly(side, flip, shift):
    wall = Wall(side=side, distance_m=0.3, share=0.3, rough_deg=0.0)
    scene = changed(walls=(wall,), camera=Camera(300, 300, 319.5, 239.5, 640, 480))
    image, truth = render(scene)
    light = int(np.argmax(truth.lights_m[:, flip] * np.sign(shift)))
    behind = truth.lights_m[light].copy()
    behind[flip] = shift - behind[flip]
    image_px = scene.camera.project(behind[None])[0]
    assert near(image, image_px).max() > 20
    assert near(image, image_px).max() < near(image, truth.lights_px[light]).max()
    assert near(render(msgspec.structs.replace(scene, walls=()))[0], image_px).max() < 5


def test_walls_are_refused_by_name():
    with pytest.raises(ValueError, match="wall side"):
        Wall(side="ceiling", distance_m=1.0)
    with pytest.raises(ValueError, match="wall share is"):
        Wall(side="floor", distance_m=1.0, share=1.5)


@pytest.mark.parametrize("exposure", [0.1, 1.0, 8.0])
def test_automatic_exposure_brings_the_mean_to_its_level(exposure):
    scene = changed(background=Background(level=20.0), sensor=Sensor(exposure=exposure, mean_level=60.0))
    assert render(scene)[0].mean() == pytest.approx(60, abs=1)
    with pytest.raises(ValueError, match="mean_level is 255"):
        Sensor(mean_level=255.0)


def test_sharpening_leaves_dark_halos_around_lamps_and_the_mean_as_it_is():
    sensor = Sensor(read_noise_levels=0.0, electrons_per_level=1e6)
    scene = changed(background=Background(level=60.0), lights=Lights(level=150.0), sensor=sensor)
    plain = render(scene)[0]
    sharp = render(msgspec.structs.replace(scene, sensor=msgspec.structs.replace(sensor, sharpening=1.0)))[0]
    assert plain.min() >= 59
    assert sharp.min() < 57
    assert sharp.max() > plain.max() + 10
    assert sharp.mean() == pytest.approx(plain.mean(), abs=0.1)


def test_rims_and_domes_add_their_share_of_light_around_and_in_front():
    close = Pose(position_m=(0.0, 0.0, 0.5))

    def of(rim: float, dome: float) -> np.ndarray:
        lights = Lights(level=20.0, radius_m=0.01, rim=rim, dome=dome)
        sensor = Sensor(read_noise_levels=0.0, electrons_per_level=1e6, bits=16)
        return render(changed(pose=close, lights=lights, background=Background(level=0.0), sensor=sensor))[0].astype(
            float
        )

    alone, rim, dome = of(0.0, 0.0), of(0.5, 0.0), of(0.0, 0.5)
    assert rim.sum() / alone.sum() == pytest.approx(1.5, rel=0.03)
    assert dome.sum() / alone.sum() == pytest.approx(1.5, rel=0.05)
    y, x = np.mgrid[: alone.shape[0], : alone.shape[1]]
    outwards = np.hypot(x - 319.5, y - 239.5)
    # A dome is nearer to the camera than its lamp, so that it lies farther out; a rim has its lamp's centre.
    means = [np.average(outwards, weights=image) for image in (alone, rim, dome)]
    assert means[1] == pytest.approx(means[0], abs=0.3)
    assert means[2] > means[0] + 0.3


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
    slope = Background(level=50.0, gradient_x=40.0, gradient_y=20.0)
    gradient = render(changed(background=slope, lights=Lights(level=0.0)))[0]
    assert (gradient[:, 0].mean(), gradient[:, -1].mean()) == pytest.approx((30, 70), abs=1)
    assert (gradient[0].mean(), gradient[-1].mean()) == pytest.approx((40, 60), abs=1)
    veil = render(changed(background=Background(level=0.0, backscatter_level=50.0), lights=Lights(level=0.0)))[0]
    assert veil[240, 320] > veil[10, 10] + 3


def test_an_occluder_hides_the_light_behind_it():
    bar = Occluder(x_px=424.5, y_px=239.5, width_px=30.0, height_px=60.0, angle_deg=20.0, level=7.0)
    image, truth = render(changed(occluders=(bar,)))
    assert np.flatnonzero(~truth.visible).tolist() == [0]
    assert near(image, (424.5, 239.5)).max() == 7
