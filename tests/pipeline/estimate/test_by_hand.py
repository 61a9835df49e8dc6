"""Poses of lights that somebody has set, beside the truth of simulated scenes."""

# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Dock, Tracker, estimate
from dockpose.sidecar import load_lights, sample_path
from dockpose.simulate import Approach, FilmPlan, film, render

from tests.support.scenes import CAMERA, DOCK, random_scene


@pytest.fixture(scope="module")
def scene():
    drawn = random_scene(3, position_m=(0.05, 0.0, 1.2))
    image, truth = render(drawn)
    return image, drawn.pose, truth.lights_px


def test_the_pose_is_that_of_the_lights(scene):
    image, pose, lights_px = scene
    clicked = lights_px + np.random.default_rng(1).normal(0, 1.5, lights_px.shape)
    snapped = estimate(image, CAMERA, DOCK, lights_px=clicked, snap=True)
    assert (snapped.status, snapped.found_by, snapped.detection) == ("ok", "hand", None)
    assert snapped.message.startswith(f"{len(lights_px)} lights set by hand; the dock is")
    np.testing.assert_allclose(snapped.selected.position_m, pose.position_m, atol=2e-3)
    exact = estimate(image, CAMERA, DOCK, lights_px=lights_px)
    np.testing.assert_array_equal(exact.markers.points_px, lights_px)
    np.testing.assert_allclose(exact.selected.position_m, pose.position_m, atol=1e-4)
    # Clicks of 0.7 pixels are worth less than centres that were fitted.
    assert exact.selected.sigma_position_m[2] > 0 < snapped.selected.sigma_position_m[2]


def test_what_was_set_stands_in_the_result_and_gives_it_again(scene):
    image, _, lights_px = scene
    first = estimate(image, CAMERA, DOCK, lights_px=lights_px, snap=[True, False] * (len(lights_px) // 2))
    line = first.to_dict()
    assert line["by_hand"]["lights_px"] == [list(light) for light in lights_px.tolist()]
    again = estimate(image, CAMERA, DOCK, lights_px=line["by_hand"]["lights_px"], snap=line["by_hand"]["snap"])
    assert again.to_dict() | {"elapsed_ms": 0} == line | {"elapsed_ms": 0}


def test_lights_of_pure_water_give_a_pose_as_well(scene):
    _, pose, lights_px = scene
    found = estimate(np.full((CAMERA.height, CAMERA.width), 20, np.uint8), CAMERA, DOCK, lights_px=lights_px, snap=True)
    np.testing.assert_allclose(found.selected.position_m, pose.position_m, atol=1e-4)


def test_one_light_that_does_not_fit_the_others_is_named(scene):
    image, _, lights_px = scene
    wrong = lights_px.copy()
    wrong[3] += [9.0, 0.0]
    found = estimate(image, CAMERA, DOCK, lights_px=wrong)
    assert "Light 4 is" in found.message
    off_px = float(found.message.partition("Light 4 is ")[2].split()[0])
    assert off_px == pytest.approx(9, rel=0.3)
    assert "from where" not in estimate(image, CAMERA, DOCK, lights_px=lights_px).message


@pytest.mark.parametrize(("lights", "count", "fewest"), [(10, 2, "3."), (None, 4, "5, or 3 where the number")])
def test_too_few_are_told_how_many_it_takes(scene, lights, count, fewest):
    image, _, lights_px = scene
    found = estimate(image, CAMERA, Dock(DOCK.diameter, lights), lights_px=lights_px[:count])
    assert found.status == "too_few_markers"
    assert found.message.startswith(f"{count} lights set by hand; a pose needs {fewest}")


def test_lights_on_a_line_are_no_ellipse(scene):
    image, *_ = scene
    line = np.column_stack([np.arange(60, 560, 50.0), np.full(10, 200.0)])
    assert estimate(image, CAMERA, DOCK, lights_px=line).status == "no_ellipse"


def test_more_lights_than_the_dock_has_are_refused(scene):
    image, _, lights_px = scene
    dock = msgspec.structs.replace(DOCK, lights=len(lights_px) - 1)
    with pytest.raises(ValueError, match=f"{len(lights_px)} lights set by hand; the dock has {dock.lights}"):
        estimate(image, CAMERA, dock, lights_px=lights_px)


def test_lights_that_are_set_are_followed_where_the_search_finds_none():
    drawn = random_scene(3, position_m=(0.05, 0.0, 2.0))
    frames = list(film(FilmPlan(scene=drawn, motion=Approach(frames=30, start_m=2.0, end_m=1.8, drift_m=0.02))))
    rng = np.random.default_rng(1)
    # Lamps of other rings all around, so that no search tells which is meant.
    specks = np.zeros(frames[0].image.shape, np.uint8)
    for x, y in rng.uniform(20, [CAMERA.width - 20, CAMERA.height - 20], (300, 2)):
        cv2.circle(specks, (int(x), int(y)), 2, 200, -1)
    images = [np.maximum(frame.image, specks) for frame in frames]
    tracker = Tracker(CAMERA, DOCK)
    first = tracker.see(images[0], frames[0].time_s, lights_px=frames[0].truth.lights_px, snap=True)
    by = [first.estimate.found_by]
    for frame, image in zip(frames[1:], images[1:], strict=True):
        found = tracker.see(image, frame.time_s)
        by.append(found.estimate.found_by)
        np.testing.assert_allclose(found.pose.position_m, frame.truth.position_m, atol=0.02)
        assert found.estimate.detection is None
    assert by == ["hand"] + ["following"] * 29


def test_the_yaml_beside_a_picture_says_where_lights_are(scene, tmp_path):
    image, _, lights_px = scene
    cv2.imwrite(str(tmp_path / "a.png"), image)
    places = ", ".join(f"[{x}, {y}]" for x, y in lights_px.tolist())
    (tmp_path / "a.yaml").write_text(f"lights_px: [{places}]\nsnap: true\n")
    found = estimate(tmp_path / "a.png", CAMERA, DOCK)
    assert found.found_by == "hand"
    assert found.by_hand.snap is True


@pytest.mark.parametrize(
    "text",
    [
        "x,y\n1.5,2\n3,4e1\n",
        "1.5 2\n3\t40\n",
        "1.5;2\n3;40",
        "lights_px: [[1.5, 2], [3, 40]]",
        '{"lights_px": [[1.5, 2], [3, 40]]}',
    ],
)
def test_lights_are_read_from_a_table_or_from_yaml(tmp_path, text):
    (tmp_path / "lights").write_text(text)
    assert load_lights(tmp_path / "lights").lights_px == ((1.5, 2.0), (3.0, 40.0))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "holds no keys"),
        ("x,y", "holds no keys"),
        ("a: 1", "has no key lights_px"),
        ("1,2\n3", "holds no keys"),
        ("lights_px: [[1, 2, 3]]", "lights_px"),
    ],
)
def test_a_file_without_lights_is_refused_by_its_name(tmp_path, text, why):
    (tmp_path / "lights").write_text(text)
    with pytest.raises(ValueError, match=f"lights: .*{why}"):
        load_lights(tmp_path / "lights")


def test_a_sample_has_none_beside_it():
    assert estimate("plain").found_by == "search"
    assert sample_path("plain").is_file()
