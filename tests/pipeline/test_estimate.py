# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false

import json
import math
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, Settings, estimate
from dockpose.camera.image import turned
from dockpose.simulate import render

from tests.support.scenes import CAMERA, DOCK, random_scene


def errors(pose, truth):
    """Relative error of the range, and the angle between the normals in degrees."""
    range_error = abs(pose.position_m[2] / truth.position_m[2] - 1)
    return range_error, math.degrees(math.acos(min(1.0, float(pose.normal @ truth.normal))))


@pytest.mark.parametrize("seed", range(40))
def test_the_truth_is_among_the_candidates_of_a_random_scene(seed):
    image, truth = render(random_scene(seed))
    found = estimate(image, CAMERA, DOCK)
    assert found.status == "ok", found.message
    best = min((errors(pose, truth) for pose in found.candidates), key=lambda pair: pair[1])
    assert best[0] < 0.01
    assert best[1] < 2


def test_a_distorted_picture_gives_the_same_pose():
    bent = Camera(700, 700, 319.5, 239.5, 640, 480, (-0.25, 0.08, 0.0005, -0.0005, 0.0))
    image, truth = render(random_scene(5, camera=bent, position_m=(0.25, -0.15, 0.9)))
    with_lens = estimate(image, bent, DOCK)
    range_error, angle = min((errors(pose, truth) for pose in with_lens.candidates), key=lambda pair: pair[1])
    assert range_error < 0.01
    assert angle < 2
    without = estimate(image, CAMERA, DOCK)
    assert min(errors(pose, truth)[0] for pose in without.candidates) > 2 * range_error


@pytest.mark.parametrize("kind", ["grey", "bgr", "bgra", "16 bit", "12 bit", "big-endian", "float"])
def test_every_kind_of_picture_gives_the_same_pose(kind):
    image, _ = render(random_scene(2))
    pictures = {
        "grey": image,
        "bgr": np.repeat(image[:, :, None], 3, axis=2),
        "bgra": np.dstack([image, image, image, np.full_like(image, 255)]),
        "16 bit": image.astype(np.uint16) << 8,
        "12 bit": image.astype(np.uint16) << 4,
        "big-endian": (image.astype(np.uint16) << 8).astype(">u2"),
        "float": (image.astype(np.uint16) << 8) / 65535,
    }
    found = estimate(pictures[kind], CAMERA, DOCK)
    reference = estimate(image, CAMERA, DOCK)
    assert found.bits == {"16 bit": 16, "12 bit": 12, "big-endian": 16, "float": 16}.get(kind, 8)
    assert found.threshold.level == reference.threshold.level
    np.testing.assert_allclose(found.selected.position_m, reference.selected.position_m, atol=1e-4)


@pytest.mark.parametrize("kind", [str, Path])
def test_a_path_gives_what_the_picture_in_the_file_gives(kind, tmp_path):
    image, _ = render(random_scene(2))
    cv2.imwrite(str(tmp_path / "tank.png"), image)
    found, reference = estimate(kind(tmp_path / "tank.png"), CAMERA, DOCK), estimate(image, CAMERA, DOCK)
    assert found.to_dict() | {"elapsed_ms": 0} == reference.to_dict() | {"elapsed_ms": 0}
    with pytest.raises(ValueError, match=r"none\.png: cannot be read"):
        estimate(kind(tmp_path / "none.png"), CAMERA, DOCK)


def test_a_rescaled_picture_scales_the_camera_and_says_so():
    image, truth = render(random_scene(4))
    double = Camera(1400, 1400, 639.5, 479.5, 1280, 960)
    found = estimate(image, double, DOCK)
    assert "scaled from 1280 x 960 to 640 x 480" in found.message
    assert found.camera.fx == 700
    assert min(errors(pose, truth)[0] for pose in found.candidates) < 0.01


def test_a_picture_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="640 x 400"):
        estimate(np.zeros((400, 640), np.uint8), CAMERA, DOCK)


def dots(count: int) -> np.ndarray:
    image = np.full((480, 640), 10, np.uint8)
    for index in range(count):
        x, y = 100 + 90 * index, 100 + 37 * (index * index % 7)
        image[y : y + 5, x : x + 5] = 220
    return image


@pytest.mark.parametrize(
    ("image", "status", "stages", "words"),
    [
        (np.zeros((480, 640), np.uint8), "no_lights", ["threshold", "markers"], "No lights"),
        (np.full((480, 640), 255, np.uint8), "no_lights", ["threshold", "markers"], "No lights"),
        (dots(1), "too_few_markers", ["threshold", "markers"], "Only 1 group of"),
        (dots(4), "too_few_markers", ["threshold", "markers"], "Only 4 groups of"),
        (dots(6), "not_a_ring", ["threshold", "markers", "ring"], "None of the 6 groups of bright pixels"),
    ],
)
def test_a_picture_without_a_dock_is_a_result(image, status, stages, words):
    found = estimate(image, CAMERA, DOCK)
    assert found.status == status
    assert words in found.message
    for stage in ("threshold", "markers", "ring", "ellipse", "choice"):
        assert (getattr(found, stage) is not None) == (stage in stages)
    line = found.to_dict()
    assert line["candidates"] == []
    assert line["selected"] is None
    json.dumps(line, allow_nan=False)


def test_groups_that_are_all_too_small_are_told():
    image = np.zeros((480, 640), np.uint8)
    image[100, 100] = image[200, 300] = 220
    found = estimate(image, CAMERA, DOCK, Settings(method="fixed", level=150))
    assert found.message == "No lights: all 2 groups at level 150 are below 2 pixels."


def wild_pictures():
    """Pictures that show anything but a dock, drawn with fixed seeds."""
    rng = np.random.default_rng(11)
    yield rng.integers(0, 256, (48, 64), dtype=np.uint8)
    yield rng.integers(0, 65536, (48, 64), dtype=np.uint16)
    yield rng.integers(0, 2, (48, 64), dtype=np.uint8) * np.uint8(255)
    yield np.tile(np.arange(64, dtype=np.uint8) * 4, (48, 1))
    yield np.full((1, 1), 200, np.uint8)
    yield np.eye(48, 64, dtype=np.uint8) * np.uint8(250)
    for density in (0.001, 0.01, 0.05, 0.2):
        sparse = (rng.random((480, 640)) < density) * rng.integers(0, 256, (480, 640))
        yield sparse.astype(np.uint8)
    for _ in range(20):
        blobs = np.zeros((480, 640), np.uint8)
        for x, y, size in zip(*rng.integers(0, 470, (2, 12)), rng.integers(1, 9, 12), strict=True):
            blobs[y : y + size, x : x + size] = rng.integers(100, 256)
        yield blobs


@pytest.mark.parametrize("index", range(30))
def test_no_picture_raises_or_gives_nan(index):
    image = list(wild_pictures())[index]
    height, width = image.shape
    found = estimate(image, Camera(700, 700, width / 2, height / 2, width, height), DOCK)
    line = json.dumps(found.to_dict(), allow_nan=False)
    assert found.message
    assert "nan" not in line.lower()


def test_the_json_line_has_every_key_of_schema_1():
    image, _ = render(random_scene(1))
    line = estimate(image, CAMERA, DOCK).to_dict("scene.png", 3, 0.1, "abc")
    assert list(line) == [
        *("schema", "source", "frame", "time_s", "time_unix_s", "sha256", "status", "message"),
        *("image", "camera", "dock", "settings"),
        *("threshold", "markers", "ellipse", "candidates", "selected", "selected_by"),
        *("chosen", "entrance", "vehicle", "guidance", "extra_lights", "detection", "found_by", "by_hand"),
        "rivals",
        "elapsed_ms",
    ]
    assert (line["schema"], line["source"], line["frame"], line["time_s"], line["sha256"]) == (
        *(1, "scene.png", 3, 0.1, "abc"),
    )
    assert line["image"] == {"width": 640, "height": 480, "bits": 8}
    assert set(line["markers"][0]) == {"x_px", "y_px", "area_px", "on_ring", "light"}
    assert sorted(marker["light"] for marker in line["markers"]) == list(range(10))
    assert set(line["ellipse"]) == {"centre_px", "semi_axes_px", "angle_deg", "eccentricity", "rms_px"}
    assert set(line["candidates"][0]) == {
        *("position_m", "normal", "theta_x_deg", "theta_y_deg", "roll_deg", "centre_px", "probability", "rms_px"),
        *("sigma_position_m", "sigma_theta_deg", "quaternion_xyzw", "covariance_m_rad"),
        *("sigma_total_position_m", "sigma_total_theta_deg", "covariance_total_m_rad"),
    }
    assert line["threshold"]["groups"] == 10
    assert line["selected_by"] == "spacing"
    assert json.loads(json.dumps(line, allow_nan=False)) == line


def test_settings_are_kept_in_the_line_and_read_back():
    settings = Settings(method="fixed", level=90, min_area_px=3, centroid="binary")
    image, _ = render(random_scene(1))
    line = estimate(image, CAMERA, DOCK, settings).to_dict()
    assert msgspec.convert(line["settings"], Settings) == settings
    assert msgspec.convert(line["camera"], Camera) == CAMERA
    assert msgspec.convert(line["dock"], Dock) == DOCK
    assert line["threshold"]["level"] == 90


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "magic"}, "method is 'magic'"),
        ({"centroid": "median"}, "centroid is 'median'"),
        ({"min_area_px": 0}, "min_area_px is 0"),
        ({"level": 256}, "level is 256"),
        ({"level": -1}, "level is -1"),
        ({"level": 12.5}, "level is 12.5"),
        ({"method": "fixed"}, "level is None; the method 'fixed' needs a level, 0 to 255"),
    ],
)
def test_bad_settings_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        Settings(**change)


def test_all_groups_that_are_seen_are_counted():
    # A lattice of 54 x 40 specks, of which 400 are looked at.
    picture = np.full((480, 640), 10, np.uint8)
    for y in range(10, 470, 11):
        for x in range(10, 630, 11):
            picture[y : y + 2, x : x + 2] = 200
    found = estimate(picture, CAMERA, DOCK)
    assert found.status == "not_a_ring"
    assert found.markers is not None
    assert found.markers.seen == len(range(10, 470, 11)) * len(range(10, 630, 11))
    assert f"400 largest of {found.markers.seen} groups repeat as in a lattice" in found.message


@pytest.mark.parametrize(("lights", "is_said"), [(4, True), (6, False)])
def test_poses_from_few_lights_say_that_offsets_are_not_used(lights, is_said):
    dock = Dock(0.30, lights, offsets_m=((0.001, 0.0, 0.001),) * lights)
    image, _ = render(random_scene(2, dock=dock))
    found = estimate(image, CAMERA, dock)
    assert found.status == "ok"
    assert ("the dock file's offsets are not used" in found.message) is is_said


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_the_turned_picture_with_the_turned_camera_gives_the_turned_pose(degrees):
    camera = msgspec.structs.replace(CAMERA, cx=300.0, cy=250.0, distortion=(-0.2, 0.05, 0.002, -0.001, 0.0))
    image, _ = render(random_scene(3, camera=camera))
    found = estimate(image, camera, DOCK).selected
    other = estimate(turned(image, degrees), camera.rotated(degrees), DOCK).selected
    assert found is not None
    assert other is not None
    angle = math.radians(degrees)
    about_axis = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(other.position_m, about_axis @ found.position_m, atol=1e-5)
    np.testing.assert_allclose(other.normal, about_axis @ found.normal, atol=1e-4)


def test_pixels_that_numpy_masks_are_not_looked_at():
    image, _ = render(random_scene(2))
    glare = image.copy()
    glare[20:60, 30:90] = 255
    hidden = np.zeros(image.shape, bool)
    hidden[20:60, 30:90] = True
    found = estimate(np.ma.array(glare, mask=hidden), CAMERA, DOCK)
    same = estimate(glare, CAMERA, DOCK, Settings(masks=((30, 20, 60, 40),)))
    np.testing.assert_array_equal(found.selected.position_m, same.selected.position_m)
    counts = [len(one.markers or ()) for one in (found, same, estimate(glare, CAMERA, DOCK))]
    assert counts[0] == counts[1] < counts[2]
    deep = np.repeat(glare[:, :, None], 3, axis=2)
    colour = estimate(np.ma.array(deep, mask=np.repeat(hidden[:, :, None], 3, axis=2)), CAMERA, DOCK)
    np.testing.assert_array_equal(colour.selected.position_m, same.selected.position_m)


@pytest.mark.parametrize("method", ["hats", "otsu", "hats_local"])
@pytest.mark.parametrize(
    ("camera", "dock"),
    [(CAMERA, Dock(0.4, 10)), (CAMERA, Dock(0.3, 8)), (Camera(690, 690, 319.5, 239.5, 640, 480), DOCK)],
)
def test_what_another_estimate_found_in_the_picture_is_taken_over_unchanged(method, camera, dock):
    settings = Settings(method=method)
    image = render(random_scene(3))[0]
    previous = estimate(image, CAMERA, DOCK, settings)
    anew, taken_over = (estimate(image, camera, dock, settings, previous=one) for one in (None, previous))
    assert anew.to_dict() | {"elapsed_ms": 0} == taken_over.to_dict() | {"elapsed_ms": 0}
    assert taken_over.markers.areas_px is previous.markers.areas_px
    other = estimate(image, camera, dock, Settings(method=method, min_area_px=9), previous=previous)
    assert other.markers.areas_px is not previous.markers.areas_px
