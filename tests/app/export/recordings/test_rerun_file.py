"""Recordings for Rerun, read back by its own reader and compared with the JSON lines of the same run."""

import json
import sys

import cv2
import numpy as np
import pytest
from dockpose.app.cli import main

from tests.support import bags
from tests.support.scenes import CAMERA

FRAMES, DARK = 8, 5
KNOWN = ["--dock-diameter", "0.30", "--lights", "10"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A folder with a bag, a camera file, and what `estimate --rerun --json` made of them."""
    folder = tmp_path_factory.mktemp("rerun")
    known = bags.write_approach(folder, FRAMES, [DARK])
    files = ["--rerun", str(folder / "a.rrd"), "--json", str(folder / "a.jsonl")]
    assert main(["estimate", str(folder / "run.mcap"), *known, *files]) == 0
    return folder


@pytest.fixture(scope="module")
def values(run):
    """By entity and component, the values by the number of the frame; and by timeline, the times."""
    reader = pytest.importorskip("rerun.chunk", reason="older ones have another reader").RrdReader(run / "a.rrd")
    found: dict[str, dict[str, dict[int, object]]] = {}
    for chunk in reader.stream():
        columns = chunk.to_record_batch().to_pydict()
        for name in columns.keys() - {"frame"}:
            by_frame = found.setdefault(chunk.entity_path, {}).setdefault(name, {})
            for frame, value in zip(columns.get("frame", [-1] * chunk.num_rows), columns[name], strict=True):
                if value is not None:
                    by_frame[frame] = value
    return found


def test_poses_chances_lights_and_words_are_those_of_the_lines(run, values):
    for line in map(json.loads, (run / "a.jsonl").read_text().splitlines()):
        frame = line["frame"]
        assert values["/status"]["TextLog:text"][frame][0].startswith(line["message"])
        if frame == DARK:
            assert frame not in values["/camera/pose_a"]["Transform3D:translation"]
            assert frame in values["/camera/pose_a"]["Clear:is_recursive"]
            assert values["/status"]["TextLog:level"][frame] == ["ERROR"]
            continue
        for name, candidate in zip(("pose_a", "pose_b"), line["candidates"], strict=True):
            entity = values[f"/camera/{name}"]
            assert entity["Transform3D:translation"][frame][0] == pytest.approx(candidate["position_m"], rel=1e-6)
            turn = entity["Transform3D:quaternion"][frame][0]
            assert turn == pytest.approx(candidate["quaternion_xyzw"], abs=1e-6)
            assert values[f"/chance/{name}"]["Scalars:scalars"][frame] == [candidate["probability"]]
            (ring, _) = values[f"/camera/{name}/ring"]["LineStrips3D:strips"][frame]
            assert np.linalg.norm(ring, axis=1) == pytest.approx(0.15, rel=1e-6)
        lights = np.array([(each["x_px"], each["y_px"]) for each in line["markers"] if each["on_ring"]])
        found = np.array(values["/camera/image/lights"]["Points2D:positions"][frame])
        assert found - 0.5 == pytest.approx(lights, abs=1e-3)
        (ellipse,) = values["/camera/image/ellipse"]["LineStrips2D:strips"][frame]
        nearest = np.linalg.norm(np.array(ellipse)[:, None] - found, axis=2).min(axis=0)
        assert nearest.max() < 0.1 * np.ptp(found)
        assert values["/chance/track"]["Scalars:scalars"][frame] == [line["track"]["probability"]]


def test_the_pictures_and_the_camera_are_there(values):
    image = values["/camera/image"]
    blob = image["EncodedImage:blob"][0][0]
    picture = cv2.imdecode(np.array(blob, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (480, 640, 3)
    assert len(image["EncodedImage:blob"]) == FRAMES
    assert pytest.approx(CAMERA.matrix) == np.reshape(image["Pinhole:image_from_camera"][0][0], (3, 3)).T


def test_the_timelines_are_those_of_the_bag(values):
    status = values["/status"]
    seconds = [status["time"][frame].total_seconds() for frame in range(FRAMES)]
    assert seconds == pytest.approx([0.1 * frame for frame in range(FRAMES)], abs=1e-6)
    assert status["time_of_day"][3].timestamp() == pytest.approx(bags.START_NS / 1e9 + 0.3, abs=1e-5)


def test_what_cannot_be_is_refused_in_a_sentence(run, monkeypatch, capsys):
    words = ["estimate", str(run / "run.mcap"), "--camera", str(run / "camera.yaml"), *KNOWN]
    assert main([*words, "--rerun", str(run / "a.txt")]) == 2
    assert "a.txt: must be NAME.rrd" in capsys.readouterr().err
    assert main([*words, "--rerun", str(run / "no" / "a.rrd")]) == 2
    assert "a.rrd: cannot be written" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main([*words, "--rerun", str(run / "b.rrd")]) == 2
    assert "needs Rerun: pip install 'dockpose[rerun]'" in capsys.readouterr().err
    assert not (run / "b.rrd").exists()
