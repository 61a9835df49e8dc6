import csv
import hashlib
import json
import shutil
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Dock, Entrance
from dockpose.app.cli import main
from dockpose.app.drawing.colours import MASK_COLOUR, bgr
from dockpose.app.inputs.pictures import load_sample, save_dock
from dockpose.camera.files import save_camera
from dockpose.lights.masks import hidden_pixels
from dockpose.sidecar import sample_names, sample_path
from dockpose.simulate import render
from dockpose.simulate.files import save_scene
from dockpose.simulate.parts import Text
from PIL import ExifTags, Image

from tests.support.scenes import CAMERA, DOCK, random_scene

KNOWN = ["--camera", "camera.yaml", "--dock-diameter", "0.3", "--lights", "10"]


def lines(text):
    return [json.loads(line) for line in text.splitlines()]


@pytest.mark.parametrize("name", sample_names())
def test_every_sample_scene_has_the_truth_among_its_two_candidates(name, json_lines):
    truth = load_sample(name).truth
    (line,) = json_lines("estimate", str(sample_path(name)))
    assert line["status"] == "ok"

    def angle_error(pose):
        return max(abs(pose[key] - getattr(truth, key)) for key in ("theta_x_deg", "theta_y_deg"))

    best = min(line["candidates"], key=angle_error)
    assert abs(best["position_m"][2] / truth.position_m[2] - 1) < 0.01
    assert angle_error(best) < 2


@pytest.mark.parametrize("command", ["estimate", "compare"])
def test_a_broken_picture_is_told_and_the_others_are_done(tank, capsys, command):
    assert main([command, "words.png", "s1.png", "gone.png", *KNOWN, "--json", "-"]) == 1
    captured = capsys.readouterr()
    assert [line["source"] for line in lines(captured.out)] == ["s1.png"]
    assert "words.png: is not a picture" in captured.err
    assert "gone.png: cannot be read" in captured.err


@pytest.mark.parametrize("command", ["estimate", "compare"])
def test_a_line_break_in_a_name_begins_no_line(command, tank, capsys):
    """A name might pretend to be another picture's result, or hide the escape sequence that clears the screen."""
    name = "a\nb.png: Dock found.\x1b[2J.png"
    Path("s1.png").rename(name)
    assert main([command, name, *KNOWN]) == 0
    told = capsys.readouterr().out
    assert told.startswith(r"a\nb.png: Dock found.\x1b[2J.png")
    assert "\x1b" not in told
    assert not any(line.startswith("b.png") for line in told.splitlines())


def test_files_are_written_where_asked(tank, capsys):
    assert main(["estimate", "s1.png", "s2.png", "--json", "o.jsonl", "--csv", "o.csv", "--annotate", "out/a"]) == 0
    *sentences, told = capsys.readouterr().out.splitlines()
    assert [sentence.partition(":")[0] for sentence in sentences] == ["s1.png", "s2.png"]
    assert told == "2 of 2 pictures show a dock"
    assert main(["estimate", "s1.png", "s2.png", "--json", "o.jsonl", "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    from_json = lines((tank / "o.jsonl").read_text())
    assert [line["source"] for line in from_json] == ["s1.png", "s2.png"]
    assert from_json[1]["sha256"] == hashlib.sha256((tank / "s2.png").read_bytes()).hexdigest()
    with open(tank / "o.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["a_z_m"]) for row in rows] == [line["candidates"][0]["position_m"][2] for line in from_json]
    assert [row["lights_on_ring"] for row in rows] == ["10", "10"]
    drawn = cv2.imread(str(tank / "out/a/s2.png"))
    assert drawn.shape == (480, 640, 3)


def test_where_the_number_of_lights_would_help_it_is_asked_for(tank, capsys):
    rng = np.random.default_rng(0)
    specks = np.full((480, 640), 10, np.uint8)
    for x, y in rng.integers(10, 470, (30, 2)):
        specks[y : y + 3, x : x + 3] = 200
    cv2.imwrite("specks.png", specks)
    known = ["estimate", "specks.png", "--camera", "camera.yaml", "--dock-diameter", "0.3"]
    assert main(known) == 0
    assert "Give --lights N" in capsys.readouterr().out
    assert main([*known, "--lights", "10"]) == 0
    assert "Give --lights" not in capsys.readouterr().out


def test_a_fixed_level_and_a_minimum_area_are_used(tank, json_lines):
    (line,) = json_lines("estimate", "s1.png", "--level", "60", "--min-area", "100000")
    assert (line["threshold"]["method"], line["threshold"]["level"]) == ("fixed", 60)
    assert (line["settings"]["min_area_px"], line["status"]) == (100000, "no_lights")


def test_what_is_no_picture_is_named_before_a_camera_is_asked_for(tmp_path, capsys):
    (tmp_path / "dive.bag.gz").write_bytes(b"\x1f\x8b\x08" + bytes(40))
    assert main(["estimate", str(tmp_path / "dive.bag.gz")]) == 1
    assert "dive.bag.gz: is an archive; unpack it" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["s1.png", "--dock-diameter", "0"], "diameter is 0"),
        (["s1.png", "--dock-diameter", "0.3", "--lights", "2"], "lights is 2"),
        (["s1.png", "--lights", "10"], "--lights 10 needs --dock-diameter"),
        (["s1.png", "--camera", "none.yaml"], "none.yaml: cannot be read"),
        (["s1.png", "--camera", "words.png"], "words.png: holds no keys"),
        (["s1.png", "--level", "300"], "level is 300"),
        (["s1.png", "--min-area", "0"], "--min-area is 0"),
        (["s1.png", "--jobs", "0"], "--jobs is 0"),
        (["s1.png", "--rate", "nan"], "--rate is nan"),
        (["s1.png", "--vehicle", "words.png"], "--vehicle: "),
        (["s1.png", "--level", "30", "--method", "hats"], "does not go with --method hats"),
        (["s1.png", "--method", "fixed"], "needs --level"),
        (["words.png"], "which camera?"),
        (["words.png", "--camera", "camera.yaml"], "how large is the dock?"),
        (["s1.png", "--json", "no/such/folder.json"], "cannot be written"),
        (["s1.png", "--annotate", "words.png"], "cannot be made"),
        (["compare", "words.png"], "which camera?"),
        (["compare", "s1.png", "--json", "no/such/folder.json"], "cannot be written"),
    ],
)
def test_bad_arguments_end_with_2_and_one_sentence(tank, refusal, arguments, message):
    assert message in refusal(*([] if arguments[0] == "compare" else ["estimate"]), *arguments)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["s1.png", "--method", "magic"], "argument --method: invalid choice: 'magic'"),
        (["s1.png", "--fast"], "there is no option --fast"),
        (["s1.png", "--jsn=-"], "there is no option --jsn=-; did you mean --json?"),
        (["s1.png", "--rate", "often"], "argument --rate: invalid float value: 'often'"),
        ([], "give a SOURCE, or --session FOLDER"),
    ],
)
def test_an_unknown_method_or_option_ends_with_2_and_one_line(tank, capsys, arguments, told):
    with pytest.raises(SystemExit) as ended:
        main(["estimate", *arguments])
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"dockpose estimate: {told}")
    assert line.endswith(" (dockpose estimate --help lists the options)")


@pytest.mark.slow
def test_text_that_stays_put_over_pictures_of_one_size_is_masked_told_once_and_shown(tank, capsys):
    (tank / "film").mkdir()
    for index in range(10):
        scene = random_scene(4, position_m=(0.01 * index, 0.05, 1.0))
        text = Text(text="REC 7", x_px=20, y_px=430, height_px=20)
        save_scene(msgspec.structs.replace(scene, texts=(text,)), tank / "film", f"f{index}")
    save_scene(random_scene(5, camera=CAMERA.for_size(320, 240)), tank / "film", "g")
    assert main(["estimate", "film", "--json", "-", "--annotate", "out", "--mask", "600,0,40,40"]) == 0
    captured = capsys.readouterr()
    assert len(captured.err.splitlines()) == 1
    assert captured.err.startswith(f"dockpose: {Path('film', 'f7.png')}: something bright stays put")
    masks = [line["settings"]["masks"] for line in lines(captured.out)]
    assert masks[:8] == [[[600, 0, 40, 40]]] * 8
    assert masks[8][0] == [600, 0, 40, 40]
    letters = cv2.imread("film/f0.png", cv2.IMREAD_UNCHANGED) > 200
    letters[:400] = False
    assert letters.any()
    assert hidden_pixels((480, 640), masks[8][1:])[letters].all()
    # The picture of another size starts anew.
    assert masks[10] == [[600, 0, 40, 40]]
    shown = cv2.imread("out/f8.png")
    x, y, width, _ = (int(number) for number in masks[8][1])
    assert (shown[y, x : x + width] == bgr(MASK_COLOUR)).all()


def test_rotate_turns_picture_and_camera_and_a_tag_is_named_once(tank, capfd, json_lines):
    with Image.open("s1.png") as picture:
        exif = Image.Exif()
        exif[ExifTags.Base.Orientation] = 6
        for name in ("a.png", "b.png"):
            picture.save(name, exif=exif)
    assert main(["estimate", "a.png", "b.png", *KNOWN, "--json", "-"]) == 0
    captured = capfd.readouterr()
    plain = lines(captured.out)[0]
    assert captured.err.count("orientation tag 6") == 1
    assert "a.png: its orientation tag 6 says" in captured.err
    assert "--rotate 90" in captured.err
    (turned,) = json_lines("estimate", "a.png", *KNOWN, "--rotate", "90")
    (x, y, z), (image, camera) = plain["chosen"]["position_m"], (turned["image"], turned["camera"])
    np.testing.assert_allclose(turned["chosen"]["position_m"], (-y, x, z), atol=1e-5)
    assert (image["width"], image["height"], camera["width_px"], turned["rotate_deg"]) == (480, 640, 480, 90)
    (followed,) = json_lines("estimate", "s1.png", "--rate", "10", *KNOWN, "--rotate", "90")
    np.testing.assert_allclose(followed["chosen"]["position_m"], (-y, x, z), atol=1e-5)
    (compared,) = json_lines("compare", "s1.png", *KNOWN, "--rotate", "90")
    found = compared["methods"]["hats"]
    np.testing.assert_allclose(found["candidates"][found["selected"]]["position_m"], (-y, x, z), atol=1e-5)


def test_a_vehicle_gives_its_own_poses_and_guidance(tmp_path):
    image, truth = render(random_scene(3))
    cv2.imwrite(str(tmp_path / "one.png"), image)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    save_dock(Dock(DOCK.diameter, DOCK.lights, entrance=Entrance(standoff_m=0.5)), tmp_path / "dock.yaml")
    (tmp_path / "v.yaml").write_text("T_body_camera: {position_m: [0.2, 0.0, 0.1]}\nframe: frd\n")
    known = [word for name in ("camera", "dock") for word in (f"--{name}", str(tmp_path / f"{name}.yaml"))]
    to = ["--json", str(tmp_path / "a.jsonl"), "--csv", str(tmp_path / "a.csv")]
    assert main(["estimate", str(tmp_path / "one.png"), *known, "--vehicle", str(tmp_path / "v.yaml"), *to]) == 0
    line = json.loads((tmp_path / "a.jsonl").read_text())
    x, y, z = truth.position_m
    assert line["vehicle"]["position_m"] == pytest.approx([z + 0.2, x, y + 0.1], abs=0.02)
    (row,) = csv.DictReader((tmp_path / "a.csv").read_text().splitlines())
    assert float(row["vehicle_y_m"]) == line["vehicle"]["position_m"][1]
    assert float(row["vehicle_qw"]) == line["vehicle"]["quaternion_xyzw"][3]
    assert float(row["guidance_along_m"]) == line["guidance"]["along_m"]
    assert row["guidance_target"] == line["guidance"]["target"]
    assert float(row["guidance_target_z_m"]) == line["guidance"]["target_m"][2]


def test_a_picture_without_a_camera_is_named_and_the_others_are_done(tank, capsys):
    cv2.imwrite("bare.png", np.zeros((480, 640), np.uint8))
    assert main(["estimate", "s1.png", "bare.png", "none*.png", "s2.png"]) == 1
    told = capsys.readouterr()
    assert told.out.splitlines()[-1] == "2 of 4 pictures show a dock; 2 left out"
    assert "bare.png: which camera? Give --camera C.yaml" in told.err
    assert "none*.png: no file matches" in told.err
    assert main(["estimate", "bare.png"]) == 2


def test_what_is_there_stays_where_no_source_can_be_read(tank):
    names = {"--json": "o.jsonl", "--csv": "o.csv", "--tum": "o.tum", "--out": "o.mcap"}
    for name in names.values():
        (tank / name).write_bytes(b"of yesterday")
    outputs = [word for pair in names.items() for word in pair]
    for source in ("gone.png", "words.png", "gone.mp4", "none*.png"):
        assert main(["estimate", source, *KNOWN, *outputs]) == 1
        assert {(tank / name).read_bytes() for name in names.values()} == {b"of yesterday"}


def test_chosen_poses_are_written_as_slam_tools_read_them(tank, capfd, refusal):
    for source, name in (("s1.png", "t1.png"), ("s1.png", "t2.png"), ("dark.png", "t3.png")):
        shutil.copy(source, name)
    words = ["estimate", "t[1-3].png", *KNOWN, "--quiet"]
    assert main([*words, "--rate", "4", "--tum", "o.tum", "--json", "o.jsonl"]) == 0
    found = lines((tank / "o.jsonl").read_text())
    poses = [(line["time_s"], line["chosen"]) for line in found[:2]]
    expected = [[time_s, *pose["position_m"], *pose["quaternion_xyzw"]] for time_s, pose in poses]
    np.testing.assert_array_equal(np.loadtxt("o.tum"), expected)
    assert [row[0] for row in expected] == [0.0, 0.25]
    assert main([*words[:-1], "--rate", "4", "--tum", "o.tum"]) == 0
    assert "--tum o.tum: 2 poses; left out: 1 frame without a chosen pose" in capfd.readouterr().out
    assert main([*words, "--tum", "o.tum"]) == 1
    assert "2 poses without a time left out" in capfd.readouterr().err
    assert "takes one source" in refusal("estimate", "t1.png", "film.mp4", *KNOWN, "--tum", "o.tum")


def test_results_and_other_files_in_place_of_a_source_or_dock_are_named(tank, capfd, refusal):
    assert (
        main(["estimate", "s1.png", *KNOWN, "--rate", "5", "--json", "r.jsonl", "--csv", "r.csv", "--tum", "r.tum"])
        == 0
    )
    assert main(["export", "s1.png", "--out", "r.zip"]) == 0
    Path("session.yaml").write_text("schema: 1")
    capfd.readouterr()
    names = {"r.jsonl": "a file of results", "r.csv": "a table of results", "r.tum": "poses", "r.zip": "a ZIP"}
    for name, words in names.items():
        assert f"{name}: is {words}" in refusal("estimate", name, *KNOWN, status=1)
    assert "s1.png: is a picture" in refusal("estimate", "s1.png", "--camera", "camera.yaml", "--dock", "s1.png")
    assert "estimate --session . does its frames again" in refusal("estimate", ".", *KNOWN)
