import json
from dataclasses import replace

import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.app.cli import main
from dockpose.app.processing.comparison import compare, compared
from dockpose.simulate import render
from dockpose.simulate.files import save_scene
from dockpose.simulate.parts import Text
from dockpose.thresholds import METHODS, fixed

from tests.support.scenes import CAMERA, DOCK, random_scene

METHOD_KEYS = ["level", "groups", "on_ring", "status", "message", "candidates", "selected", "elapsed_ms"]
DOCK_OPTIONS = ["--camera", "camera.yaml", "--dock-diameter", "0.3", "--lights", "10"]


def test_every_method_but_fixed_is_compared_and_gives_what_estimate_gives(tank, capfd):
    assert main(["compare", "s1.png", "--json", "-"]) == 0
    captured = capfd.readouterr()
    line = json.loads(captured.out)
    assert captured.err == ""
    assert list(line) == ["source", "frame", "sha256", "methods"]
    assert (line["source"], line["frame"], len(line["sha256"])) == ("s1.png", 0, 64)
    assert list(line["methods"]) == [name for name in METHODS if name != "fixed"]
    assert all(list(method) == METHOD_KEYS for method in line["methods"].values())
    image = np.asarray(cv2.imread("s1.png", cv2.IMREAD_UNCHANGED))
    for name in ("hats", "otsu"):
        found, alone = line["methods"][name], estimate(image, CAMERA, DOCK, Settings(method=name)).to_dict()
        assert (found["level"], found["groups"]) == (alone["threshold"]["level"], alone["threshold"]["groups"])
        assert found["on_ring"] == 10
        assert found["candidates"] == alone["candidates"]
        assert found["selected"] == alone["selected"]


def test_unknown_values_are_null_and_no_key_is_left_out(tank, json_lines):
    (line,) = json_lines("compare", "dark.png", *DOCK_OPTIONS)
    for method in line["methods"].values():
        assert list(method) == METHOD_KEYS
        assert method["status"] == "no_lights"
        assert (method["groups"], method["on_ring"], method["candidates"], method["selected"]) == (0, None, [], None)


def test_hats_is_shown_without_the_levels_that_it_falls_back_on(monkeypatch):
    image, _ = render(random_scene(1))
    nothing = replace(METHODS["hats"], method=lambda histogram, min_area_px, level: fixed(histogram, 256))
    monkeypatch.setitem(METHODS, "hats", nothing)
    assert "each light was given its own" in estimate(image, CAMERA, DOCK).message
    hats = compare(image, CAMERA, DOCK)["hats"]
    assert hats.status == "no_lights"
    assert hats.threshold.level == 256


def test_without_outputs_a_table_is_printed(tank, capsys):
    assert main(["compare", "s1.png", "dark.png", *DOCK_OPTIONS]) == 0
    first, second = capsys.readouterr().out.strip().split("\n\n")
    rows = first.splitlines()
    assert rows[0] == "s1.png"
    assert rows[1].split()[:3] == ["method", "level", "groups"]
    assert [row.split()[0] for row in rows[2:]] == list(compared())
    hats = rows[2].split()
    assert hats[2:4] == ["10", "10"]
    assert "right: off by 0." in rows[2]
    # The columns stand under each other.
    assert len({row.index("off by") for row in rows[2:] if "off by" in row}) == 1
    assert "No lights: " in second.splitlines()[2]
    assert "off by" not in second
    assert main(["compare", "s1.png", *DOCK_OPTIONS, "--rotate", "90"]) == 0
    assert "right: off by 0." in capsys.readouterr().out.splitlines()[2]  # the truth turns with the picture


def test_a_damaged_yaml_beside_a_picture_does_not_matter_where_nothing_of_it_is_needed(tank, capsys):
    (tank / "s1.yaml").write_text("truth: [1, 2")
    assert main(["compare", "s1.png", *DOCK_OPTIONS]) == 0
    captured = capsys.readouterr()
    assert "pose found" in captured.out
    assert captured.err == ""


@pytest.mark.slow
@pytest.mark.parametrize("command", ["compare", "estimate"])
def test_masks_are_left_out_by_both_commands(tank, command, json_lines):
    scene = random_scene(1, position_m=(0.0, 0.0, 1.0))
    save_scene(msgspec.structs.replace(scene, texts=(Text(text="12:34", x_px=20, y_px=20),)), tank, "text")
    (line,) = json_lines(command, "text.png", "--mask", "10,10,90,40", "--mask", "0,460,4.5,20")
    if command == "estimate":
        assert line["settings"]["masks"] == [[10, 10, 90, 40], [0, 460, 4.5, 20]]
        assert line["threshold"]["groups"] == 10
    else:
        assert line["methods"]["hats"]["groups"] == 10


@pytest.mark.slow
@pytest.mark.parametrize("command", ["compare", "estimate"])
@pytest.mark.parametrize("mask", ["1,2,3", "1,2,3,x", "1,2,0,5", "nan,0,5,5", ""])
def test_a_mask_that_is_none_ends_with_2_and_one_sentence(tank, refusal, command, mask):
    sentence = refusal(command, "s1.png", f"--mask={mask}")
    assert sentence.startswith(f"dockpose: --mask {mask} must be left, top, width and height in pixels")


def test_pictures_whose_lights_are_known_make_one_table_of_all_methods(tank, capsys, tmp_path):
    image, truth = render(random_scene(1))
    lights = truth.lights_px[truth.visible]
    for name, shift in (("one", 0), ("two", 1)):
        cv2.imwrite(str(tank / f"{name}.png"), np.roll(image, shift, axis=1))
        places = [[float(x) + shift, float(y)] for x, y in lights]
        (tank / f"{name}.yaml").write_text(json.dumps({"lights_px": places, "snap": True}))
    assert main(["compare", "one.png", "two.png", "dark.png", *DOCK_OPTIONS, "--out", str(tmp_path / "out")]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines.index("2 pictures whose lights are known")
    assert lines[at + 2].split()[:5] == ["HATS", "2", str(2 * len(lights)), "of", str(2 * len(lights))]
    assert lines[at + 2].split()[7:] == ["2", "2", "2", "0.0", "0.0"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        f"methods.{end}" for end in ("csv", "png", "svg", "tex")
    ]


def test_lights_that_cannot_be_of_a_picture_are_named_with_it_and_the_others_are_compared(tank, capsys):
    (tank / "dark.yaml").write_text(json.dumps({"lights_px": [[5000, 10]]}))
    assert main(["compare", "dark.png", "s1.png", *DOCK_OPTIONS]) == 1
    captured = capsys.readouterr()
    assert "dark.png: light 1 is at 5000, 10, outside the picture" in captured.err
    assert captured.out.startswith("s1.png\n")


def test_labels_of_many_pictures_are_taken_and_a_table_without_known_lights_is_refused(tank, capsys):
    assert main(["compare", "dark.png", *DOCK_OPTIONS, "--out", "table.csv"]) == 2
    assert "of no picture the lights are known" in capsys.readouterr().err
    labels = {"images": [{"id": 1, "file_name": "other.png"}], "annotations": [{"image_id": 1, "keypoints": [5, 5, 2]}]}
    (tank / "labels.json").write_text(json.dumps(labels))
    assert main(["compare", "dark.png", *DOCK_OPTIONS, "--lights-at", "labels.json"]) == 2
    assert "has the lights of no picture here; the first that it names is other.png" in capsys.readouterr().err
