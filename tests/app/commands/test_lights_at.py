"""``--lights-at``: lights that somebody has set, of a picture and of a frame of a film."""

import shutil

import numpy as np
import pytest
from dockpose.app.cli import main
from dockpose.app.export.video import VideoFile
from dockpose.sidecar import sample_path
from dockpose.simulate import Approach, FilmPlan, film

from tests.support.scenes import DOCK, random_scene

PLAIN = str(sample_path("plain"))
KNOWN = ["--camera", "camera.yaml", "--dock-diameter", str(DOCK.diameter), "--lights", str(DOCK.lights)]


@pytest.fixture
def clicked(tank, json_lines):
    """A table of the lights of the plain sample, a pixel off."""
    (line,) = json_lines("estimate", PLAIN)
    places = [(one["x_px"] + 1, one["y_px"] - 1) for one in line["markers"] if one["on_ring"]]
    (tank / "lights.csv").write_text("x,y\n" + "".join(f"{x:.1f},{y:.1f}\n" for x, y in places))
    return line


def test_a_picture_has_the_pose_of_its_lights(clicked, json_lines):
    (line,) = json_lines("estimate", PLAIN, "--lights-at", "lights.csv", "--snap")
    assert (line["found_by"], line["detection"]) == ("hand", None)
    np.testing.assert_allclose(line["chosen"]["position_m"], clicked["chosen"]["position_m"], atol=1e-4)
    (exact,) = json_lines("estimate", PLAIN, "--lights-at", "lights.csv")
    # All are a pixel right and up: the camera of the sample has a focal length of 700 pixels.
    moved = np.subtract(exact["chosen"]["position_m"], clicked["chosen"]["position_m"])
    np.testing.assert_allclose(moved[:2], np.array([1, -1]) / 700 * clicked["chosen"]["position_m"][2], atol=2e-4)


def test_a_film_is_followed_from_the_frame_whose_lights_are_set(tank, json_lines, capfd):
    scene = random_scene(3, position_m=(0.05, 0.0, 2.0))
    frames = list(film(FilmPlan(scene=scene, motion=Approach(frames=8, start_m=2.0, end_m=1.9))))
    with VideoFile(tank / "film.mkv", 25.0) as video:
        for frame in frames:
            video.write(frame.image)
    np.savetxt(tank / "lights.csv", frames[3].truth.lights_px, delimiter=",")
    for more in ([], ["--jobs", "2"]):
        words = ["film.mkv", *KNOWN, "--lights-at", "lights.csv", "--at-frame", "3", *more]
        found = json_lines("estimate", *words)
        by = [line["found_by"] for line in found]
        assert by == ["search", "following", "following", "hand", *["following"] * 4]
        assert [line["detection"] is None for line in found] == [False] * 3 + [True] * 5
        for line, frame in zip(found, frames, strict=True):
            np.testing.assert_allclose(line["chosen"]["position_m"], frame.truth.position_m, atol=0.02)
    words[words.index("--at-frame") + 1] = "8"
    assert main(["estimate", *words]) == 1
    assert "film.mkv: has no frame 8, whose lights --lights-at sets" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ([PLAIN, "--snap"], "--snap and --at-frame go with --lights-at FILE"),
        ([PLAIN, "s1.png", "--lights-at", "lights.csv"], "or of a frame of one film; give one SOURCE"),
        ([PLAIN, "--lights-at", "lights.csv", "--at-frame", "2"], "these are lights of one picture, or of a frame of"),
        ([PLAIN, "--lights-at", "lights.csv", "--at-frame", "-1"], "--at-frame is -1; it must be at least 0"),
        ([PLAIN, "--lights-at", "camera.yaml"], "camera.yaml: has no key lights_px, and is no table of x, y"),
        ([PLAIN, "--lights-at", "lights.csv", "--rotate", "90"], "and do not go with --rotate"),
    ],
)
def test_what_does_not_go_with_lights_is_said(clicked, refusal, words, why):
    assert why in refusal("estimate", *words)


def test_results_say_that_nothing_checks_the_lights(clicked, capfd):
    assert main(["estimate", PLAIN, "--lights-at", "lights.csv"]) == 0
    assert "The lights were set by hand: nothing checks that they are a dock." in capfd.readouterr().out


def test_labels_that_export_writes_give_each_picture_its_lights_again(tank, json_lines, capfd):
    folder = tank / "some"
    folder.mkdir()
    for name in ("plain", "tilted"):
        for ending in (".png", ".yaml"):
            shutil.copy(sample_path(name).with_suffix(ending), folder)
    assert main(["export", "some", "--out", "labels.json"]) == 0
    assert capfd.readouterr().out == "labels.json\n"
    first = json_lines("estimate", "some")
    (folder / "more.png").write_bytes((folder / "plain.png").read_bytes())
    (folder / "more.yaml").write_bytes((folder / "plain.yaml").read_bytes())
    more, *again = json_lines("estimate", "some", "--lights-at", "labels.json")
    assert (more["found_by"], [line["found_by"] for line in again]) == ("search", ["hand"] * 2)
    for one, other in zip(first, again, strict=True):
        before, after = ([(mark["x_px"], mark["y_px"]) for mark in line["markers"]] for line in (one, other))
        away = np.linalg.norm(np.array(before)[:, None] - after, axis=2)
        assert away.min(axis=0).max() < 1e-6
